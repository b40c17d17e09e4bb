"""Photographs through Python against the same ones through the programs."""

import json
import multiprocessing

import numpy
import pytest
from conftest import RELIGHT, RELIT_MASK, ball, needs_mask, needs_relight, room, run, write_hdr, write_png

import relit


def forms():
    """The same photograph as it may come: an array, what stands in its file, and a mask or none."""
    image, mask = ball()
    alpha = numpy.where(mask, 255, 0).astype(numpy.uint8)
    black = numpy.where(mask[..., None], image, 0).astype(numpy.uint8)
    return {
        "mask": (image, mask),
        "alpha": (numpy.dstack([image, alpha]), None),
        "black background": (black, None),
        "16 bits": (image.astype(numpy.uint16) * 257, mask),
    }


def files(folder, image, mask):
    path = write_png(folder / "photo.png", image)
    if mask is None:
        return path, None
    return path, write_png(folder / "mask.png", numpy.where(mask, 255, 0).astype(numpy.uint8))


def stored(path):
    """The integers of a PNG of 16 bits."""
    return numpy.round(65535 * relit.read_image(path, transfer="linear").astype(numpy.float64)).astype(numpy.int64)


@needs_relight
@pytest.mark.parametrize("form", forms())
@pytest.mark.parametrize("highlights", ["auto", "on"])
def test_a_decomposition_is_the_program_s(tmp_path, form, highlights):
    image, mask = forms()[form]
    path, mask_path = files(tmp_path, image, mask)
    options = ["--mask", mask_path] if mask_path else []
    run(RELIGHT, "decompose", path, *options, "--specular", highlights, "-o", tmp_path / "out")
    figures = json.loads((tmp_path / "out/decomposition.json").read_text())
    found = relit.decompose(image, mask, highlights=highlights)

    assert numpy.array_equal(found.light, numpy.loadtxt(tmp_path / "out/light.txt"))
    assert (found.residual, found.saturated_fraction) == (figures["residual"], figures["specular"]["saturated_fraction"])
    assert found.mask.sum() == figures["mask"]["pixels"]
    for name, layer in (("albedo", found.albedo), ("shading", found.shading), ("specular", found.highlight)):
        white = numpy.float32(figures["white"][name])
        layer = numpy.broadcast_to(numpy.atleast_3d(layer), (*found.mask.shape, 3))
        assert numpy.array_equal(relit.to_srgb(layer / white, numpy.uint16), stored(tmp_path / f"out/{name}.png")), name
    normals = numpy.where(found.mask[..., None], 65535 * (found.normals.astype(numpy.float64) + 1) / 2, 0)
    assert abs(normals - stored(tmp_path / "out/normal.png")).max() <= 0.51
    if found.specular:
        assert numpy.allclose(found.specular, [figures["specular"][name] for name in ("reflectance", "smoothness")])


def test_a_path_and_its_array_are_one(tmp_path, photo):
    path, mask_path = files(tmp_path, *photo)
    one, other = relit.decompose(*photo), relit.decompose(path, str(mask_path))
    mixed = relit.decompose(path, photo[1])
    for name in ("normals", "albedo", "shading", "highlight", "confidence", "mask", "light"):
        assert numpy.array_equal(getattr(one, name), getattr(other, name)), name
        assert numpy.array_equal(getattr(one, name), getattr(mixed, name)), name


def test_layers_have_their_shapes_and_ranges(photo):
    image, mask = photo
    found = relit.decompose(image, mask)
    assert found.normals.shape == found.albedo.shape == image.shape
    assert found.shading.shape == found.highlight.shape == found.confidence.shape == mask.shape
    assert found.normals.dtype == found.confidence.dtype == numpy.float32
    assert numpy.allclose(numpy.linalg.norm(found.normals[mask], axis=1), 1, atol=1e-5)
    assert (found.normals[~mask] == 0).all() and (found.confidence[~mask] == 0).all()
    assert found.confidence.min() >= 0 and found.confidence.max() <= 1
    assert abs(found.shading[mask].mean() - 1) < 1e-3 and found.light.shape == (9, 3)


def test_linear_light_decomposes_as_its_encoding(photo):
    image, mask = photo
    encoded = image / 255.0
    linear = numpy.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    one, other = relit.decompose(image, mask), relit.decompose(linear.astype(numpy.float32), mask)
    assert numpy.allclose(one.normals, other.normals, atol=1e-2)
    assert numpy.array_equal(relit.to_srgb(linear), image)


def test_many_come_in_their_order_and_a_bad_one_ends_nothing(photo):
    image, mask = photo
    pairs = [(numpy.roll(image, shift, 1), numpy.roll(mask, shift, 1)) for shift in range(-6, 6, 3)]
    pairs.insert(2, (image, numpy.zeros_like(mask)))
    found = list(relit.decompose_many(iter(pairs), threads=3, return_exceptions=True))
    assert isinstance(found[2], ValueError)
    del pairs[2], found[2]
    for pair, one in zip(pairs, found):
        assert numpy.array_equal(one.albedo, relit.decompose(*pair).albedo)
    with pytest.raises(ValueError):
        list(relit.decompose_many([(image, mask[:-1])]))
    # Nobody waits for what is not wanted any more.
    first = next(relit.decompose_many(pairs, threads=1))
    assert numpy.array_equal(first.albedo, found[0].albedo)


LIGHTS = {
    "lamp": (["--lamp", "60,30"], {"lamp": (60, 30)}),
    "warm lamp": (["--lamp", "-45,40,3200K,10", "--ambient", "0.4"], {"lamp": (-45, 40, "3200K", 10), "ambient": 0.4}),
    "panorama": (["--light", "room.hdr"], {"light": "array"}),
    "panorama, turned": (["--light", "room.hdr", "--turned", "70", "--field", "80"], {"light": "array", "turned": 70, "field": 80}),
    "coefficients": (["--light", "light.txt", "--white-balance", "auto"], {"light": "rows", "white_balance": "auto"}),
    "own": (["--own-light", "--exposure", "-1"], {"light": "own", "exposure": -1}),
    "white": (["--lamp", "10,80", "--background", "white", "--size", "100"], {"lamp": "10,80", "background": "white", "size": 100}),
    "in place": (["--lamp", "200,10", "--keep-background"], {"lamp": (200, 10), "background": "photo"}),
}


@pytest.fixture
def lights(tmp_path):
    """A panorama's and a light's file, and what stands in them."""
    write_hdr(tmp_path / "room.hdr", room())
    rows = numpy.array([[1.5, 1.2, 1], [0.3, 0.2, 0.5], [0.9, 0.5, 0.2], [-0.4, 0.1, 0]] + [[0.05, 0, -0.05]] * 5)
    numpy.savetxt(tmp_path / "light.txt", rows)
    return {"array": relit.read_image(tmp_path / "room.hdr"), "rows": rows}


@needs_relight
@pytest.mark.parametrize("light", LIGHTS)
def test_a_relit_photograph_is_the_program_s(tmp_path, monkeypatch, photo, lights, light):
    monkeypatch.chdir(tmp_path)
    path, mask_path = files(tmp_path, *photo)
    options, named = LIGHTS[light]
    run(RELIGHT, "relight", path, "--mask", mask_path, *options, "-o", "relit.exr")
    named = {name: lights.get(value, value) if isinstance(value, str) else value for name, value in named.items()}
    assert numpy.array_equal(relit.relight(*photo, **named), relit.read_image("relit.exr"))


def test_several_angles_are_several_pictures(photo):
    frames = relit.relight(*photo, lamp=(60, 30), turned=[0, 90])
    assert frames.shape == (2, *photo[0].shape)
    assert numpy.array_equal(frames[1], relit.relight(*photo, lamp=(60, 30), turned=90))


@needs_relight
def test_objects_in_another_picture_are_the_program_s(tmp_path, monkeypatch, photo, lights):
    monkeypatch.chdir(tmp_path)
    path, mask_path = files(tmp_path, *photo)
    object = [path, "--mask", mask_path]
    run(RELIGHT, "insert", *object, "--into", "room.hdr", "--at", "0.4,0.8", "--height", "0.5", "--size", "160,120", "-o", "room.exr")
    found = relit.insert([photo], lights["array"], (0.4, 0.8), 0.5, size=(160, 120))
    assert numpy.array_equal(found, relit.read_image("room.exr"))
    table = write_png(tmp_path / "table.png", ball(150, 200, 20)[0])
    two = [path, path, "--mask", mask_path, "--mask", mask_path, "--at", "0.3,0.9", "--at", "0.7,0.9", "--shadow", "0.5"]
    run(RELIGHT, "insert", *two, "--into", table, "--lamp", "60,30", "-o", "table.exr")
    found = relit.insert([photo, photo], ball(150, 200, 20)[0], [(0.3, 0.9), (0.7, 0.9)], shadow=0.5, lamp=(60, 30))
    assert numpy.array_equal(found, relit.read_image("table.exr"))


@needs_mask
def test_a_mask_is_the_program_s(tmp_path, photo):
    image, mask = photo
    path = write_png(tmp_path / "photo.png", image)
    box = (30, 10, 100, 100)
    run(RELIT_MASK, path, "--rect", ",".join(map(str, box)), "-o", tmp_path / "cut.png")
    found = relit.mask(image, box)
    assert numpy.array_equal(found, stored(tmp_path / "cut.png")[..., 0] > 0)
    assert (found != mask).mean() < 0.02
    assert numpy.array_equal(relit.mask(path, box), found)


def test_a_mask_follows_seeds(photo):
    image, mask = photo
    seeds = numpy.full(mask.shape, 128, numpy.uint8)
    seeds[55:65, 75:85], seeds[:5] = 255, 0
    assert (relit.mask(image, seeds=seeds) != mask).mean() < 0.05
    with pytest.raises(ValueError):
        relit.mask(image, seeds=numpy.full(mask.shape, 128, numpy.uint8))


@needs_relight
@pytest.mark.parametrize("specular", [None, (0.3, 60)])
@pytest.mark.parametrize("forms", [("irradiance", "lobe"), ("released", "power")])
def test_a_rendering_is_the_program_s(tmp_path, photo, lights, specular, forms):
    found = relit.decompose(*photo)
    normals = numpy.where(found.mask[..., None], 65535 * (found.normals + 1) / 2, 0)
    path = write_png(tmp_path / "normal.png", numpy.round(normals).astype(numpy.uint16))
    gloss = ["--reflectance", specular[0], "--smoothness", specular[1]] if specular else []
    form = ["--diffuse", forms[0], "--specular", forms[1]]
    colours = relit.read_image(path, transfer="linear")
    given = numpy.where((colours == 0).all(2, keepdims=True), 0, 2 * colours - 1)
    for light, option in (("array", ["--panorama", "room.hdr"]), ("rows", ["--light", "light.txt"])):
        option[1] = tmp_path / option[1]
        arguments = ["--normals", path, "--albedo", "0.8,0.5,0.3", *gloss, *form, *option, "--turned", "40"]
        run(RELIGHT, "render", *arguments, "-o", tmp_path / "lit.exr")
        options = {"specular": specular, "diffuse_form": forms[0], "specular_form": forms[1]}
        image = relit.render(given, (0.8, 0.5, 0.3), lights[light], turned=40, **options)
        assert numpy.array_equal(image, relit.read_image(tmp_path / "lit.exr"))


def test_what_cannot_be_is_an_exception(tmp_path, photo):
    image, mask = photo
    with pytest.raises(FileNotFoundError, match="none.png"):
        relit.decompose(tmp_path / "none.png")
    for faulty in (
        lambda: relit.decompose(image),
        lambda: relit.decompose(image, mask[1:]),
        lambda: relit.decompose(image, numpy.zeros_like(mask)),
        lambda: relit.decompose(image[..., 0], mask),
        lambda: relit.decompose(image.astype(int), mask),
        lambda: relit.decompose(image[:0], mask[:0]),
        lambda: relit.decompose(numpy.full(image.shape, numpy.nan, numpy.float32), mask),
        lambda: relit.decompose(image, mask, highlights="maybe"),
        lambda: relit.decompose(image, box=(0, 0, -5, 5)),
        lambda: relit.relight(image, mask),
        lambda: relit.relight(image, mask, light="own", lamp=(1, 2)),
        lambda: relit.relight(image, mask, lamp=(10, 200)),
        lambda: relit.relight(image, mask, lamp=(10, 20), background="light"),
        lambda: relit.relight(image, mask, light=numpy.zeros((9, 3))),
        lambda: relit.relight(image, mask, light=numpy.ones((8, 3))),
        lambda: relit.relight(image, mask, light=numpy.ones((8, 8, 3))),
        lambda: relit.relight(image, mask, lamp=(1, 2), exposure=numpy.nan),
        lambda: relit.insert([], image),
        lambda: relit.insert([photo], image, height=0),
        lambda: relit.insert([photo], image, height=numpy.nan),
        lambda: relit.insert([photo, photo], image, [(0.1, 0.9)] * 3),
        lambda: relit.mask(image),
        lambda: relit.mask(image, (500, 500, 10, 10)),
        lambda: relit.render(numpy.zeros((4, 4, 3)), numpy.ones((5, 4, 3)), numpy.ones((9, 3))),
        lambda: relit.render(numpy.zeros((4, 4, 3)), -1, numpy.ones((9, 3))),
        lambda: relit.to_srgb(image, float),
    ):
        with pytest.raises(ValueError):
            faulty()


def test_a_doubtful_mask_warns(photo):
    image, mask = photo
    with pytest.warns(relit.RelitWarning):
        relit.decompose(image, mask.astype(numpy.uint8))


def _use(image, mask):
    try:
        relit.decompose(image, mask)
    except RuntimeError:
        return
    raise SystemExit("the work went on in a forked process")


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork")
def test_a_forked_process_is_told_so(photo):
    relit.decompose(*photo)
    process = multiprocessing.get_context("fork").Process(target=_use, args=photo)
    process.start()
    process.join(60)
    assert process.exitcode == 0
