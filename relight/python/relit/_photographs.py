"""Decompose, relight, insert and mask photographs."""

from __future__ import annotations

import collections
import concurrent.futures
import dataclasses
import json
import os

import numpy

from . import _relit
from ._arrays import (
    RelitWarning,
    angles,
    frames,
    is_path,
    light_source,
    mask_picture,
    photograph,
    picture,
    rectangle,
    warn,
    within,
)

#: Each photograph takes memory, gigabytes if it is large.
_MAX_SIDE_BY_SIDE = 4


@dataclasses.dataclass(frozen=True)
class Decomposition:
    """A photograph in layers, image = albedo x shading + highlight. Everything is as large as the photograph, and 0
    outside the mask."""

    #: rows x columns x 3, float32: unit vectors, x right, y up, z to the viewer.
    normals: numpy.ndarray
    #: rows x columns x 3, float32, linear, from 0: in units in which the mean shading is 1, with the light's colour.
    albedo: numpy.ndarray
    #: rows x columns, float32, linear, from 0: mean 1 under the mask.
    shading: numpy.ndarray
    #: rows x columns, float32, linear, from 0, in the photograph's units; 0 where no highlight was separated.
    highlight: numpy.ndarray
    #: rows x columns, float32, 0 to 1: how certain it is whether a dark pixel is paint or shadow, by the maps.
    #: Where it is low, albedo and shading may be wrong by the same factor.
    confidence: numpy.ndarray
    #: rows x columns, bool: the object.
    mask: numpy.ndarray
    #: 9 x 3, float64: the light around the object, grey, in units in which the mean shading is 1.
    light: numpy.ndarray
    #: Reflectance and smoothness of the whole object for `render`; None without a highlight that shows them.
    specular: tuple | None
    #: The part of the object's pixels that are saturated, 0 to 1.
    saturated_fraction: float
    #: The difference of the recomposed layers from the photograph: root mean square, over that of the photograph.
    residual: float


def decompose(image, mask=None, *, box=None, transfer=None, highlights="auto", mirror=True):
    """Decompose a photograph of an object into normals, albedo, shading, highlight and light: a `Decomposition`.

    image: a path, or rows x columns x 3 or 4: uint8 or uint16 (sRGB), float32 (linear).
    mask: a path, or rows x columns. Default: the image's alpha, or all but a black background.
    box: x, y, width and height of a rectangle around the object, pixels.
    transfer: "srgb", "gamma22" or "linear": the encoding of integers; by default as the file states.
    highlights: "auto" separates them where more than 5 % of the object is saturated; "on", "off".
    mirror: False does not average with the mirror image: faster, and slightly worse.

    Gives the same numbers as `relight decompose`.
    """
    found, notes = _relit.decompose(photograph(image, mask, box, transfer), highlights, mirror)
    warn(notes)
    return Decomposition(**found)


def decompose_many(photographs, *, threads=None, return_exceptions=False, **options):
    """Decompose many photographs in parallel; yields the decompositions in order.

    photographs: any iterable of images, or of pairs of image and mask. It is read ahead by up to two photographs per thread.
    threads: photographs decomposed in parallel; by default one per core, at most 4.
    return_exceptions: yield an exception in place of a decomposition and continue, instead of raising it.
    options: those of `decompose`.
    """
    threads = threads or min(_cores(), _MAX_SIDE_BY_SIDE)
    with concurrent.futures.ThreadPoolExecutor(threads, "relit") as pool:
        waiting = collections.deque()
        try:
            for one in photographs:
                pair = one if isinstance(one, tuple) else (one,)
                waiting.append(pool.submit(decompose, *pair, **options))
                if len(waiting) > 2 * threads:
                    yield _result(waiting.popleft(), return_exceptions)
            while waiting:
                yield _result(waiting.popleft(), return_exceptions)
        finally:
            for future in waiting:
                future.cancel()


def _cores():
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _result(future, return_exceptions):
    error = future.exception()
    if error is None or not return_exceptions:
        return future.result()
    return error


def relight(
    image,
    mask=None,
    *,
    light=None,
    lamp=None,
    ambient=0.15,
    light_angle=0.0,
    background=None,
    fov=60.0,
    white_balance="adapted",
    exposure=0.0,
    size=None,
    box=None,
    transfer=None,
    highlights="auto",
):
    """Relight the object of a photograph: rows x columns x 3, float32, linear.

    image, mask, box, transfer, highlights: see `decompose`.
    light: a panorama (rows x columns x 3, or a path to .hdr or .exr), coefficients (n x 3, or a path to .txt), or "own",
        the photograph's estimated light.
    lamp: (azimuth, elevation[, colour][, size]), or "60,30,3200K,10": degrees about the vertical (0 at the viewer,
        90 on the right, 180 behind) and above the horizon; colour "#ffd9b0" or "3200K"; size in degrees.
    ambient: ambient light, as a part of the lamp's, 0 to 10.
    light_angle: degrees by which the light is rotated about the vertical, from the viewer to the right; or several, for
        frames x rows x columns x 3.
    background: "photo", "light" (the panorama), "grey", "black" or "white"; by default the panorama that lights the
        object, the photograph for its own light, or grey.
    fov: degrees of a panorama that the picture's longer side shows, 1 to 150.
    white_balance: "adapted", a lamp as an eye sees it that adapts to it in part; "light"; or "auto" as by a camera that is balanced for it.
    exposure: stops. With 0 the strongest light is as strong as in the photograph.
    size: the longest side of the result, pixels; by default the photograph's.

    The same as `relight relight`.
    """
    if isinstance(light, str) and light == "own":
        if lamp is not None:
            raise ValueError("light and lamp are given: give one")
        source = None
    else:
        source = light_source(light, lamp, ambient)
        if source is None:
            raise ValueError('give the new light: light=, or lamp=(azimuth, elevation); "own" keeps the photograph\'s')
    listed, is_one = angles(light_angle)
    pictures, notes = _relit.relight(
        photograph(image, mask, box, transfer),
        source,
        listed,
        background,
        within("fov", fov, 1.0, 150.0),
        white_balance,
        within("exposure", exposure, -20.0, 20.0),
        None if size is None else int(within("size", size, 16, 16384)),
        highlights,
    )
    warn(notes)
    return frames(pictures, is_one)


def insert(
    objects,
    into,
    at=None,
    height=None,
    *,
    rotation=None,
    tint=None,
    gloss=None,
    shadow=None,
    brightness=None,
    light=None,
    lamp=None,
    ambient=0.15,
    light_angle=0.0,
    size=(1280, 960),
    fov=60.0,
    down=10.0,
    tilt=None,
    match=True,
    white_balance="adapted",
    exposure=0.0,
    transfer=None,
    highlights="auto",
):
    """Insert objects of photographs into another picture, with their shadows: rows x columns x 3, float32, linear.

    objects: from back to front: images, pairs of image and mask, or paths of captured objects (.relit).
    into: a photograph, or a panorama: a file of it, or a float32 array twice as wide as high.

    For all objects, or a list with one for each:
    at: the centre of an object's lower edge, (x, y) in parts of the picture's sides from the upper left corner; by default
        next to each other at 0.9.
    height: in parts of the picture's, 0.4 by default.
    rotation: degrees in the plane, counter-clockwise.
    tint: (red, green, blue) that its albedo is multiplied with.
    gloss: (reflected part of even light, smoothness), in place of the estimated gloss.
    shadow: strength of its shadow, 0 to 1.
    brightness: stops.

    For the picture:
    light, lamp, ambient: see `relight`; by default the light of `into`.
    light_angle: degrees by which the light, and a panorama behind the objects with it, is rotated.
    size, fov, down: for a panorama, width and height of the picture in pixels, its angle of view along the longer side,
        and how many degrees the camera looks down.
    tilt: degrees that the camera looks down on the ground; by default from the panorama and `at`, or 20.
    match: whether brightness, white balance and grain of the objects follow the picture.
    white_balance: see `relight`. exposure: of a panorama, stops from the automatic one.
    transfer, highlights: of the objects' photographs, see `decompose`.

    The same as `relight insert`.
    """
    pairs = [one if isinstance(one, tuple) else (one,) for one in objects]
    beside = [((place + 0.5) / len(pairs), 0.9) for place in range(len(pairs))]
    described = [{"photo": ""} for _ in pairs]
    for name, values, parts in (
        ("at", beside if at is None else at, 2),
        ("height", height, 1),
        ("rotation", rotation, 1),
        ("tint", tint, 3),
        ("gloss", gloss, 2),
        ("shadow", shadow, 1),
        ("exposure", brightness, 1),
    ):
        for one, value in zip(described, _one_each(name, values, parts, len(pairs))):
            one[name] = value
    scene = {
        "background": "",
        "size": [int(side) for side in size],
        "fov": float(fov),
        "down": float(down),
        "tilt": None if tilt is None else float(tilt),
        "light": {"angle": float(light_angle)},
        "match": bool(match),
        "white_balance": white_balance,
        "exposure": float(exposure),
        "object": described,
    }
    image, notes = _relit.insert(
        [photograph(*pair, transfer=transfer) for pair in pairs],
        picture(into, "background"),
        json.dumps(scene, allow_nan=False),
        light_source(light, lamp, ambient),
        highlights,
    )
    warn(notes)
    return image


def _one_each(name, values, parts, count):
    """A value for each object; empty if none is given."""
    if values is None or count == 0:
        return []
    array = numpy.asarray(values, dtype=numpy.float64)
    shape = (count,) if parts == 1 else (count, parts)
    if array.shape == shape[1:]:
        array = numpy.broadcast_to(array, shape)
    if array.shape != shape:
        raise ValueError(f"{name} has the shape {array.shape} for {count} objects: give one, or one for each")
    return array.tolist()


def mask(image, box=None, *, seeds=None, keep_all=False):
    """The object's mask by GrabCut: rows x columns, bool.

    image: see `decompose`.
    box: x, y, width and height of a rectangle around the object, pixels.
    seeds: a painted image of the same size, or a path to a PNG: white is object, black is background, all else is unknown.
        Or rows x columns: 255, 0, and 128 for unknown.
    keep_all: keep every part, not only the largest.

    The same as `relit-mask` on one frame.
    """
    if seeds is not None:
        painted = is_path(seeds) or numpy.ndim(seeds) == 3
        seeds = picture(seeds, "picture of seeds") if painted else mask_picture(seeds)
    found, warnings = _relit.mask(picture(image), rectangle(box), seeds, keep_all)
    warn(warnings)
    return found


def read_image(path, *, transfer=None):
    """Read the picture at `path` as linear light, as the programs do: rows x columns x 3 (or 4, with alpha), float32, linear.

    PNG, JPEG, WebP, TIFF, BMP, GIF, OpenEXR and Radiance HDR, turned as they are displayed, in the primaries of sRGB.
    transfer: "srgb", "gamma22" or "linear": the encoding of integers; by default as the file states.
    """
    return _relit.read_image(os.fspath(path), transfer)


def to_srgb(image, dtype=numpy.uint8):
    """Convert `image`, linear light of any shape, to sRGB of `dtype` uint8 or uint16, clipped to 0 to 1."""
    image = numpy.ascontiguousarray(image, dtype=numpy.float32)
    if numpy.dtype(dtype) == numpy.uint8:
        return _relit.to_srgb8(image)
    if numpy.dtype(dtype) == numpy.uint16:
        return _relit.to_srgb16(image)
    raise ValueError(f"dtype is {dtype}: give uint8 or uint16")
