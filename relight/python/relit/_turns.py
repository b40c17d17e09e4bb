"""Whole turns solved, and the render layers."""

from __future__ import annotations

import dataclasses
import os

import numpy

from . import _relit
from ._arrays import angles, frames, light_source, warn, within


@dataclasses.dataclass(frozen=True)
class Turn:
    """What a whole turn shows of its object. Everything is as large as the shard's frames, and 0 outside the mask."""

    #: The session.
    name: str
    #: rows x columns x 3, float32: unit vectors, x right, y up, z to the viewer.
    normals: numpy.ndarray
    #: rows x columns x 3, float32, linear, from 0: in the units of a light that was given, else such that the mean shading
    #: is 1 in each channel. Of metal it is the colour of its reflection: render it with an albedo of 0.
    albedo: numpy.ndarray
    #: rows x columns x 3, float32, linear: the mean over the turn.
    shading: numpy.ndarray
    #: rows x columns, float32, 0 to 1: how far each normal is to be trusted; one half where it is expected to be off by
    #: 11.5 degrees.
    confidence: numpy.ndarray
    #: rows x columns, float32, degrees: how far each normal is expected to be off.
    expected_error: numpy.ndarray
    #: rows x columns, bool: the object.
    mask: numpy.ndarray
    #: 9 x 3, float64: the light of order 2 in the viewer's frame at the table's angle 0.
    light: numpy.ndarray
    #: Degrees: the median over the object of how far normals are expected to be off.
    expected_error_deg: float
    #: Reflectance, rows x columns x 3, and smoothness, rows x columns, for `render`; None of a diffuse object.
    specular: tuple | None


def solve_turn(shard, *, rotation=None, elevation=None, light=None, material="diffuse"):
    """Normals, albedo and light of a whole turn: a `Turn`.

    shard: the path of a shard (.tar) of relit-extract, or of a folder with one turn.
    rotation: "counter-clockwise" or "clockwise", seen from above; by default what the data set says of the rig, or what
        the frames show.
    elevation: degrees that the camera looks down on the table; by default what the data set says, or 18.
    light: the light, where it was measured, in the viewer's frame at the table's angle 0: coefficients (n x 3, or a path
        to .txt), or a panorama (rows x columns x 3, or a path).
    material: "diffuse" (with gloss or without) or "metal".

    The same as `relight turn`. What its user should know is said as warnings.
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
    turned=0.0,
    exposure="auto",
    order=48,
    diffuse_form="irradiance",
    specular_form="lobe",
):
    """An object that is given by its maps, under a light: rows x columns x 3, float32, linear.

    image = exposure x (albedo x irradiance + reflectance x integral of radiance times the lobe).

    normals: rows x columns x 3, x right, y up, z to the viewer, of any length; 0 where there is no surface.
    albedo: linear: one value, red, green and blue, or rows x columns x 3; not negative.
    light: coefficients (n x 3), a panorama (rows x columns x 3), or a path to either.
    specular: reflectance (as albedo) and smoothness (a value, or rows x columns), the exponent of Blinn and Phong.
    turned: degrees by which the light has turned about the vertical, from the viewer to the right; or several, for
        frames x rows x columns x 3.
    exposure: stops beyond a white diffuse surface under even light of radiance 1; or "auto": a white diffuse surface that
        faces the strongest light is white.
    order: of spherical harmonics to which a panorama is brought, 0 to 64.
    diffuse_form: "irradiance", or "released" as the paper's released code has it.
    specular_form: "lobe", close to the ground truth, or "power", the paper's formula.

    The same as `relight render`. `relit.torch.render` does it on tensors, with gradients.
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
    listed, is_one = angles(turned)
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
