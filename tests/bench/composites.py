"""Composites of objects on backgrounds, with ground truth, in the form that masks.py reads.

    python composites.py OBJECTS BACKGROUNDS FOLDER
    python masks.py relit-mask FOLDER --boxes tight,loose,cut

OBJECTS holds `NAME.png` and `NAME.mask.png` (white is object), BACKGROUNDS pictures and panoramas (.hdr). Each object
is put on so many random crops as `--each` says, at 25 to 55 % of their area's side, as bright as the crop times 2 to a
random power of -1 to 1, with a soft edge, noise and JPEG. The strokes of `NAME.scribble.png` are one in the object's
middle and four at the picture's sides, three quarters of each long.
"""

import argparse
import pathlib

import cv2
import numpy as np

SIZE = (640, 480)
QUALITY = 90
NOISE = 2.5


def background(path, rng):
    """A random crop of SIZE, 0 to 1 in display values."""
    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if picture is None:
        raise SystemExit(f"{path} is not a picture: leave pictures and panoramas alone in the folder")
    picture = picture[..., :3].astype(np.float32)
    if path.suffix == ".hdr":
        picture = np.clip(picture / np.quantile(picture, 0.97), 0, 1) ** (1 / 2.2)
    else:
        picture /= np.iinfo(np.uint8).max
    height, width = picture.shape[:2]
    least = max(SIZE[0] / width, SIZE[1] / height)
    scale = max(least, rng.uniform(0.4, 1.0))
    picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    picture = picture[: max(SIZE[1], picture.shape[0] * 9 // 10)]
    x = rng.integers(0, picture.shape[1] - SIZE[0] + 1)
    y = rng.integers(0, picture.shape[0] - SIZE[1] + 1)
    return picture[y : y + SIZE[1], x : x + SIZE[0]]


def cut_out(path):
    """An object's picture and coverage, cut to the coverage."""
    picture = cv2.imread(str(path)).astype(np.float32) / 255
    mask = cv2.imread(str(path.with_name(f"{path.stem}.mask.png")), cv2.IMREAD_GRAYSCALE)
    if mask is None or mask.shape != picture.shape[:2]:
        raise SystemExit(f"{path} has no mask of its size: put {path.stem}.mask.png beside it")
    rows, columns = np.nonzero(mask >= 128)
    box = np.s_[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    return picture[box], (mask[box] >= 128).astype(np.float32)


def composite(path, scene, rng):
    """The picture and the ground truth."""
    picture, mask = cut_out(path)
    side = rng.uniform(0.25, 0.55) * np.sqrt(SIZE[0] * SIZE[1])
    scale = min(side / np.sqrt(picture.shape[0] * picture.shape[1]), 0.9 * SIZE[1] / picture.shape[0],
                0.9 * SIZE[0] / picture.shape[1])
    picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    cover = cv2.resize(mask, picture.shape[1::-1], interpolation=cv2.INTER_AREA)
    height, width = cover.shape
    x = rng.integers(8, SIZE[0] - width - 7)
    y = rng.integers(8, SIZE[1] - height - 7)
    place = np.s_[y : y + height, x : x + width]
    seen = picture[cover > 0.9].mean() or 1
    picture = picture * np.clip(scene.mean() / seen * 2 ** rng.uniform(-1, 1), 0, 1 / max(picture.max(), 1e-3))
    truth = np.zeros(SIZE[::-1], np.float32)
    truth[place] = cover
    soft = cv2.GaussianBlur(truth, None, 0.7)[..., None]
    front = np.zeros_like(scene)
    front[place] = picture
    whole = scene * (1 - soft) + np.where(soft > 0, front, 0) * soft
    whole = whole * 255 + rng.normal(0, NOISE, whole.shape)
    return np.clip(np.rint(whole), 0, 255).astype(np.uint8), (truth >= 0.5).astype(np.uint8) * 255


def strokes(truth):
    """A white line along the object's middle, and red ones along the picture's sides where they leave the object."""
    marks = np.zeros((*truth.shape, 3), np.uint8)
    height, width = truth.shape
    near = cv2.dilate(truth, np.ones((9, 9), np.uint8)) > 0
    red = np.zeros(truth.shape, np.uint8)
    for start, end in (((width // 8, 12), (width * 7 // 8, 12)), ((width // 8, height - 12), (width * 7 // 8, height - 12)),
                       ((12, height // 8), (12, height * 7 // 8)), ((width - 12, height // 8), (width - 12, height * 7 // 8))):
        cv2.line(red, start, end, 255, 5)
    marks[(red > 0) & ~near] = (0, 0, 255)
    depth = cv2.distanceTransform(truth, cv2.DIST_L2, 5)
    white = cv2.dilate((depth > 0.8 * depth.max()).astype(np.uint8), np.ones((3, 3), np.uint8))
    marks[(white > 0) & (truth > 0)] = (255, 255, 255)
    return marks


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("objects", type=pathlib.Path)
    parser.add_argument("backgrounds", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--each", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    objects = sorted(path for path in arguments.objects.glob("*.png") if not path.name.endswith(".mask.png"))
    scenes = sorted(path for path in arguments.backgrounds.iterdir() if path.is_file())
    if not objects or not scenes:
        raise SystemExit("there is nothing to compose: OBJECTS holds NAME.png and NAME.mask.png, BACKGROUNDS pictures")
    rng = np.random.default_rng(arguments.seed)
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for index in range(arguments.each):
        for path in objects:
            picture, truth = composite(path, background(scenes[rng.integers(len(scenes))], rng), rng)
            name = arguments.folder / f"{path.stem}-{index}"
            cv2.imwrite(f"{name}.jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
            cv2.imwrite(f"{name}.gt.png", truth)
            cv2.imwrite(f"{name}.scribble.png", strokes(truth))


if __name__ == "__main__":
    main()
