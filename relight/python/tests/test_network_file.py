"""The network as an ONNX file, run with onnxruntime and NumPy by the example."""

import pathlib
import sys

import numpy
import pytest
from conftest import RELIGHT, ball, needs_relight, run

onnxruntime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")
sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "examples"))
import network  # noqa: E402 - the example


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    path = tmp_path_factory.mktemp("network") / "relight.onnx"
    run(RELIGHT, "weights", "export", "-o", path)
    assert path.stat().st_size <= 20_000_000
    return onnxruntime.InferenceSession(path)


@needs_relight
@pytest.mark.parametrize("rows, columns", [(128, 128), (96, 160)])
def test_the_example_sees_a_ball_that_faces_the_viewer(session, rows, columns):
    image, mask = ball(rows, columns, 40)
    linear = (image / 255.0).astype(numpy.float32) ** numpy.float32(2.2)
    normals, albedo, shading, highlight, light = network.network_maps(session, linear, mask)
    assert normals[rows // 2, columns // 2, 2] > 0.8 and abs(numpy.linalg.norm(normals[mask], axis=1) - 1).max() < 1e-5
    assert albedo.shape == (rows, columns, 3) and shading[mask].min() > 0 and light.shape == (9,)
    for plane in (albedo, shading, highlight):
        assert not plane[~mask].any() and numpy.isfinite(plane).all()


@needs_relight
def test_the_file_says_what_it_takes_and_under_which_licence(session):
    facts = session.get_modelmeta().custom_metadata_map
    assert {"input", "maps", "light", "colour_space", "axes", "licence", "attribution"} <= set(facts)
    (taken,) = session.get_inputs()
    assert taken.shape == ["batch", 7, "height", "width"] and taken.type == "tensor(float)"
    assert [output.name for output in session.get_outputs()] == ["maps", "light"]
