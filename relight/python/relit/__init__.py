"""Decompose, relight and render photographs and whole turns, and read relit's data sets.

    d = relit.decompose("mug.jpg", "mug-mask.png")        # normals, albedo, shading, highlight, light
    picture = relit.relight("mug.jpg", "mug-mask.png", lamp=(60, 30))
    turn = relit.solve_turn("dataset/mug.tar")            # a whole turn
    image = relit.render(turn.normals, turn.albedo, turn.light, specular=turn.specular)
    matplotlib.pyplot.imshow(relit.to_srgb(image))

    for batch in relit.open("dataset").batches(seed=1):
        train(batch.images, batch.masks)

Input images: a path, or an array of rows x columns x 3 (red, green, blue) or 4 (with straight alpha): uint8 or uint16 in
sRGB, or float32 in linear light. Input masks: a path, or an array of rows x columns: bool, or white on the object.
Results are float32 and linear, rows x columns x 3; `to_srgb` converts them for a screen or a file.

Directions: x to the right, y up, z to the viewer. Light: float64, coefficients of spherical harmonics x 3 (red, green,
blue), nine for order 2, (l, m) at l (l + 1) + m, without the Condon-Shortley phase; or a panorama, rows x columns x 3,
twice as wide as high, whose centre is behind the object.

Work runs on all cores without Python's lock. Errors raise ValueError, or OSError for files, and say what to do; doubtful
results warn (RelitWarning).
"""

from ._photographs import (
    Decomposition,
    RelitWarning,
    decompose,
    decompose_many,
    insert,
    mask,
    read_image,
    relight,
    to_srgb,
)
from ._reader import Batch, Batches, Cursor, Dataset, open
from ._relit import __version__
from ._turns import Turn, render, solve_turn

__all__ = [
    "Batch",
    "Batches",
    "Cursor",
    "Dataset",
    "Decomposition",
    "RelitWarning",
    "Turn",
    "__version__",
    "decompose",
    "decompose_many",
    "insert",
    "mask",
    "open",
    "read_image",
    "relight",
    "render",
    "solve_turn",
    "to_srgb",
]
