"""Solve whole turns, and render."""

from __future__ import annotations

import dataclasses
import os

import numpy

from . import _relit
from ._arrays import angles, frames, light_source, warn, within


@dataclasses.dataclass(frozen=True)
class Turn:
    """The object of a whole turn. Everything is as large as the shard's frames, and 0 outside the mask."""

    #: The session.
    name: str
    #: rows x columns x 3, float32: unit vectors, x right, y up, z to the viewer.
    normals: numpy.ndarray
    #: rows x columns x 3, float32, linear, from 0: in the units of a given light, else such that the mean shading
    #: is 1 in each channel. For metal it is the colour of its reflection: render it with an albedo of 0.
    albedo: numpy.ndarray
    #: rows x columns x 3, float32, linear: the mean over the turn.
    shading: numpy.ndarray
    #: rows x columns, float32, 0 to 1: the confidence in each normal; one half at an expected error of
    #: 11.5 degrees.
    confidence: numpy.ndarray
    #: rows x columns, float32, degrees: the expected error of each normal.
    expected_error: numpy.ndarray
    #: rows x columns, bool: the object.
    mask: numpy.ndarray
    #: 9 x 3, float64: the light of order 2 in the viewer's frame at the table's angle 0.
    light: numpy.ndarray
    #: Degrees: the median over the object of the expected error of normals.
    expected_error_deg: float
    #: Reflectance, rows x columns x 3, and smoothness, rows x columns, for `render`; None for a diffuse object.
    specular: tuple | None


def solve_turn(shard, *, rotation=None, elevation=None, light=None, material="diffuse"):
    """Estimate normals, albedo and light of a whole turn: a `Turn`.

    shard: the path of a shard (.tar) of relit-extract, or of a folder with one turn.
    rotation: "counter-clockwise" or "clockwise", seen from above; by default that of the data set, or as estimated from
        the frames.
    elevation: degrees that the camera looks down on the table; by default that of the data set, or 18.
    light: the measured light, in the viewer's frame at table angle 0: coefficients (n x 3, or a path
        to .txt), or a panorama (rows x columns x 3, or a path).
    material: "diffuse" (with gloss or without) or "metal".

    The same as `relight turn`. Doubts about the result come as warnings.
    """
    found, sentences = _relit.solve_turn(os.fspath(shard), rotation, elevation, light_source(light), material)
    warn(sentences)
    return Turn(**found)


def render(
    normals,
    albedo,
    light,
    *,
    specular=None,
    light_angle=0.0,
    exposure="auto",
    order=48,
    diffuse_form="irradiance",
    specular_form="lobe",
):
    """Render an object from its maps in a light: rows x columns x 3, float32, linear.

    image = exposure x (albedo x irradiance + reflectance x integral of radiance times the lobe).

    normals: rows x columns x 3, x right, y up, z to the viewer, of any length; 0 outside the object.
    albedo: linear, from 0: one value, red, green and blue, or rows x columns x 3.
    light: coefficients (n x 3), a panorama (rows x columns x 3), or a path to either.
    specular: reflectance (as albedo) and smoothness (a value, or rows x columns), the Blinn-Phong exponent.
    light_angle: degrees by which the light is rotated about the vertical, from the viewer to the right; or several, for
        frames x rows x columns x 3.
    exposure: stops; 0 shows a white surface in even light of radiance 1 as white; "auto", one that faces the strongest
        light, and a single picture of an object that is lit from behind brighter.
    order: of the spherical harmonics of a panorama, 0 to 64.
    diffuse_form: "irradiance", or "released" as in the paper's released code.
    specular_form: "lobe", close to the ground truth, or "power", the paper's formula.

    The same as `relight render`. `relit.torch.render` does the same on tensors, with gradients.
    """
    normals = numpy.ascontiguousarray(normals, dtype=numpy.float32)
    if normals.ndim != 3 or normals.shape[2] != 3:
        raise ValueError(f"the normals have the shape {normals.shape}: give rows x columns x 3")
    gloss = None
    if specular is not None:
        reflectance, smoothness = specular
        gloss = _map("reflectance", reflectance, normals.shape), _map("smoothness", smoothness, normals.shape[:2])
    source = light_source(light)
    if source is None:
        raise ValueError("give the light: coefficients, a panorama or a path")
    listed, is_one = angles(light_angle)
    pictures = _relit.render(
        normals,
        _map("albedo", albedo, normals.shape),
        gloss,
        source,
        int(within("order", order, 0, 64)),
        listed,
        None if exposure == "auto" else within("exposure", exposure, -30.0, 30.0),
        diffuse_form,
        specular_form,
    )
    return frames(pictures, is_one)


def _map(what, values, shape):
    """Values for all pixels."""
    array = numpy.asarray(values, dtype=numpy.float32)
    try:
        return numpy.ascontiguousarray(numpy.broadcast_to(array, shape))
    except ValueError:
        raise ValueError(f"the {what} has the shape {array.shape}, and the normals have {shape[:2]} pixels") from None
