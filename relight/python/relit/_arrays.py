"""Arguments of the user, converted to those of `_relit`."""

from __future__ import annotations

import os
import warnings

import numpy


class RelitWarning(UserWarning):
    """A result that should be checked."""


def warn(sentences):
    for sentence in sentences:
        warnings.warn(sentence, RelitWarning, stacklevel=3)


def is_path(given):
    return isinstance(given, (str, os.PathLike))


def picture(given, what="image"):
    """A path, or a contiguous array of rows, columns and 3 or 4 channels: uint8, uint16 or float32."""
    if is_path(given):
        return os.fspath(given)
    array = numpy.asarray(given)
    if array.ndim != 3 or array.shape[2] not in (3, 4):
        raise ValueError(f"the {what} has the shape {array.shape}: give rows x columns x 3 or 4, or a path")
    if array.size == 0:
        raise ValueError(f"the {what} has no pixels")
    if array.dtype.kind == "f":
        array = array.astype(numpy.float32, copy=False)
    if array.dtype not in (numpy.uint8, numpy.uint16, numpy.float32):
        raise ValueError(f"the {what} has the type {array.dtype}: give uint8 or uint16 (sRGB), or float32 (linear)")
    return numpy.ascontiguousarray(array)


def mask_picture(given):
    """A mask as a picture: white on the object."""
    if given is None or is_path(given):
        return given if given is None else os.fspath(given)
    array = numpy.asarray(given)
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[..., 0]
    if array.ndim != 2:
        raise ValueError(f"the mask has the shape {array.shape}: give rows x columns, or a path")
    if array.dtype.kind in "bf":
        array = numpy.where(array >= 0.5, numpy.uint8(255), numpy.uint8(0))
    return picture(numpy.repeat(array[..., None], 3, axis=2), "mask")


def rectangle(box):
    """x, y, width and height, pixels."""
    if box is None:
        return None
    numbers = [int(number) for number in box]
    if len(numbers) != 4 or min(numbers[2:]) < 0 or max(map(abs, numbers)) >= 2**31:
        raise ValueError(f"box is {tuple(box)}: give x, y, width and height in pixels")
    return tuple(numbers)


def photograph(image, mask=None, box=None, transfer=None):
    return picture(image), mask_picture(mask), rectangle(box), transfer


def light_source(light, lamp=None, ambient=0.15):
    """A lamp, coefficients, a panorama or a path; None if neither light nor lamp is given."""
    if lamp is not None:
        if light is not None:
            raise ValueError("light and lamp exclude each other: give one")
        text = lamp if isinstance(lamp, str) else ",".join(str(part) for part in lamp)
        return text, within("ambient", ambient, 0.0, 10.0)
    if light is None or is_path(light):
        return None if light is None else os.fspath(light)
    array = numpy.asarray(light)
    if array.ndim == 2:
        return numpy.ascontiguousarray(array, dtype=numpy.float64)
    return picture(array, "light")


def within(what, value, least, most):
    value = float(value)
    if not least <= value <= most:
        raise ValueError(f"{what} is {value:g}: give {least:g} to {most:g}")
    return value


def angles(light_angle):
    """A list of angles, and whether a single one was given."""
    is_one = numpy.ndim(light_angle) == 0
    listed = [light_angle] if is_one else list(light_angle)
    return [within("light_angle", angle, -36000.0, 36000.0) for angle in listed], is_one


def frames(pictures, is_one):
    """One picture, or frames x rows x columns x 3."""
    return pictures[0] if is_one else numpy.stack(pictures)
