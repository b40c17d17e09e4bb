"""Masks of images with ground truth: relit-mask's and those of OpenCV's GrabCut (5 iterations, no clean-up), measured.

    python masks.py PROGRAM FOLDER [--boxes tight,loose,cut]

FOLDER has the form of the GrabCut data set: `NAME.jpg` (or .png, .bmp), the ground truth `NAME.gt.png` (0 background, 255
object, 128 does not count), and as hints `NAME.box.txt` (`x1 y1 x2 y2`, corners included) or `NAME.scribble.png` (black is
unknown, red background, a light colour object). `--boxes` makes boxes from the ground truth instead: 2 pixels around the
object, 12 % of its longer side around it, or without its left tenth. Wrong pixels are a part of those that count in box
and object, or in the image with scribbles; errors are 100 minus the intersection over union, in points.
"""

import argparse
import pathlib
import subprocess
import tempfile

import cv2
import numpy as np

WORSE_BY = 5.0


def made_box(truth, kind):
    """Left, top, width and height as a person would draw them, and the object's; None where they would hold the image."""
    rows, columns = np.nonzero(truth >= 128)
    left, top, right, bottom = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
    around = int(0.12 * max(right - left, bottom - top)) if kind == "loose" else 2
    begin = left + int(0.1 * (right - left)) if kind == "cut" else left - around
    box = clipped((begin, top - around, right + around, bottom + around), truth.shape)
    whole = (0, 0, truth.shape[1], truth.shape[0])
    return None if box == whole else (box, (min(box[0], left), min(box[1], top), max(box[2], right), max(box[3], bottom)))


def clipped(box, shape):
    return max(box[0], 0), max(box[1], 0), min(box[2], shape[1]), min(box[3], shape[0])


def hints(path, truth, boxes):
    """Name, box or None, marks or None, and the region in which errors count, for each hint of an image."""
    given = path.with_name(f"{path.stem}.box.txt")
    given = [int(number) for number in given.read_text().split()] if given.is_file() else None
    region = given and clipped((given[0], given[1], given[2] + 1, given[3] + 1), truth.shape)
    for kind in boxes:
        if made := made_box(truth, kind):
            yield kind, made[0], None, made[1]
    if region and not boxes:
        yield "box", region, None, region
    if (painted := cv2.imread(str(path.with_name(f"{path.stem}.scribble.png")))) is not None:
        marks = np.where(painted[..., 1] >= 100, 255, np.where(painted[..., 2] >= 100, 0, 128)).astype(np.uint8)
        yield "scribble", None, marks, region or (0, 0, truth.shape[1], truth.shape[0])


def ours(program, path, box, marks, folder):
    """The program's mask; nothing where it finds no object."""
    out = folder / "mask.png"
    if box:
        hint = ["--rect", f"{box[0]},{box[1]},{box[2] - box[0]},{box[3] - box[1]}"]
    else:
        cv2.imwrite(str(folder / "seeds.png"), marks)
        hint = ["--seeds", str(folder / "seeds.png")]
    run = subprocess.run([program, path, *hint, "-o", out, "--force"], capture_output=True, text=True)
    if run.returncode == 0:
        return cv2.imread(str(out), cv2.IMREAD_GRAYSCALE) >= 128
    if "no object was found" in run.stderr:
        return np.zeros(cv2.imread(str(path)).shape[:2], bool)
    raise SystemExit(f"{path}: {run.stderr.strip()}")


def opencv(path, box, marks):
    picture = cv2.imread(str(path))
    labels = np.full(picture.shape[:2], cv2.GC_BGD if box else cv2.GC_PR_BGD, np.uint8)
    if box:
        labels[box[1] : box[3], box[0] : box[2]] = cv2.GC_PR_FGD
    else:
        labels[marks == 255], labels[marks == 0] = cv2.GC_FGD, cv2.GC_BGD
    cv2.setRNGSeed(1)
    cv2.grabCut(picture, labels, None, np.zeros((1, 65)), np.zeros((1, 65)), 5, cv2.GC_INIT_WITH_MASK)
    return (labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)


def score(mask, truth, region):
    """The share of wrong pixels in the region, and the error in points."""
    counts, object_ = (truth < 64) | (truth > 191), truth > 191
    left, top, right, bottom = region
    part = np.s_[top:bottom, left:right]
    wrong = ((mask != object_) & counts)[part].sum() / max(counts[part].sum(), 1)
    either = ((mask | object_) & counts).sum()
    return wrong, 100 * (1 - ((mask & object_ & counts).sum() / either if either else 1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--boxes", type=lambda text: text.split(","), default=[])
    arguments = parser.parse_args()
    shown = (path for path in sorted(arguments.folder.iterdir()) if not path.name.startswith("."))
    images = [path for path in shown if path.suffix.lower() in (".jpg", ".jpeg", ".png", ".bmp")]
    images = [path for path in images if path.with_name(f"{path.stem}.gt.png").is_file()]
    if not images:
        raise SystemExit(f"{arguments.folder} holds no image with its ground truth, as in mug.jpg and mug.gt.png")
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        for path in images:
            truth = cv2.imread(str(path.with_name(f"{path.stem}.gt.png")), cv2.IMREAD_GRAYSCALE)
            for kind, box, marks, region in hints(path, truth, arguments.boxes):
                mine = score(ours(arguments.program, path, box, marks, pathlib.Path(folder)), truth, region)
                rows.setdefault(kind, []).append((path.stem, *mine, *score(opencv(path, box, marks), truth, region)))
    print(f"{'hint':9} images  wrong  OpenCV  ratio  error  OpenCV  difference      worse by {WORSE_BY:.0f} points")
    for kind, found in rows.items():
        numbers = np.array([row[1:] for row in found])
        wrong, error, peer_wrong, peer_error = numbers.mean(0)
        apart = numbers[:, 1] - numbers[:, 3]
        spread = apart.std(ddof=1) / np.sqrt(len(found)) if len(found) > 1 else np.nan
        worse = [row[0] for row, by in zip(found, apart) if by > WORSE_BY]
        print(f"{kind:9} {len(found):6}  {100 * wrong:4.1f} %  {100 * peer_wrong:4.1f} %  {wrong / max(peer_wrong, 1e-9):5.2f}  {error:5.1f}  "
              f"{peer_error:6.1f}  {apart.mean():+5.1f} +- {spread:4.1f}  {', '.join(worse) or 'none'}")


if __name__ == "__main__":
    main()
