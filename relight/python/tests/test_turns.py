"""Turns through Python against the program's, on the data set RELIT_DATA."""

import json
import os
import pathlib
import warnings

import numpy
import pytest
from conftest import RELIGHT, needs_relight, run

import relit

DATA = os.environ.get("RELIT_DATA")
pytestmark = pytest.mark.skipif(not DATA, reason="RELIT_DATA names no data set")


@needs_relight
@pytest.mark.parametrize("given", [[], ["--material", "metal", "--elevation", "25", "--rotation", "clockwise"]])
def test_a_solved_turn_is_the_program_s(tmp_path, given):
    shard = next(pathlib.Path(DATA).glob("*.tar"))
    run(RELIGHT, "turn", shard, *given, "-o", tmp_path / "out")
    options = dict(zip([name[2:] for name in given[::2]], given[1::2]))
    if options:
        options["elevation"] = float(options["elevation"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", relit.RelitWarning)
        found = relit.solve_turn(shard, **options)
    figures = json.loads((tmp_path / "out/turn.json").read_text())
    assert numpy.array_equal(found.light, numpy.loadtxt(tmp_path / "out/light.txt"))
    assert found.expected_error_deg == figures["expected_error_deg"] and found.name == figures["turn"]
    stored = 65535 * relit.read_image(tmp_path / "out/normal.png", transfer="linear").astype(numpy.float64)
    normals = numpy.where(found.mask[..., None], 65535 * (found.normals.astype(numpy.float64) + 1) / 2, 0)
    assert abs(normals - stored).max() <= 0.51
    for name, layer in (("albedo", found.albedo), ("shading", found.shading)):
        layer = relit.to_srgb(layer / numpy.float32(figures["white"][name]), numpy.uint16)
        assert abs(layer - 65535 * relit.read_image(tmp_path / f"out/{name}.png", transfer="linear")).max() < 0.1
    assert (found.specular is None) == (figures["material"] == "diffuse")
    assert found.expected_error.shape == found.confidence.shape == found.mask.shape


def test_what_is_no_turn_is_an_exception(tmp_path):
    with pytest.raises(OSError):
        relit.solve_turn(tmp_path / "none.tar")
    with pytest.raises(ValueError):
        relit.solve_turn(tmp_path, rotation="up")
