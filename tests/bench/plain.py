"""Objects before plain and cluttered backgrounds, with ground truth, and how `relit-mask --auto` does on them.

    python plain.py make MESHES OBJECTS BACKGROUNDS FOLDER --count 240 --seed 1000
    python plain.py measure relit-mask FOLDER

MESHES holds `.obj`, OBJECTS `NAME.png` and `NAME.mask.png` as composites.py takes them, BACKGROUNDS pictures and panoramas
(.hdr). Every other picture is plain: one colour, a gradient, a vignette or a sweep from wall to floor, with a contact
shadow and often a cast one. The others are cluttered: crops of BACKGROUNDS, cloth, wood, a table's edge, shapes.
Everything is composed in linear light; blur, noise and JPEG follow. A picture is called NUMBER-plain-KIND or
NUMBER-cluttered-KIND.
"""

import argparse
import collections
import pathlib
import subprocess
import tempfile

import cv2
import numpy as np

SIZES = [(960, 720), (800, 800), (720, 960)]
PLAIN = ["solid", "linear", "vignette", "sweep"]
CLUTTER = ["picture", "picture", "picture", "cloth", "horizon", "shapes", "wood"]
OVERSAMPLED = 1.5


def read_mesh(path):
    """Vertices in a cube from -1 to 1, and triangles."""
    vertices, faces = [], []
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            vertices.append([float(number) for number in rest[:3]])
        elif word == "f":
            corners = [int(corner.split("/")[0]) - 1 for corner in rest]
            faces += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
    vertices = np.array(vertices)
    vertices -= (vertices.max(0) + vertices.min(0)) / 2
    return vertices / np.abs(vertices).max(), np.array(faces)


def rotation(yaw, pitch):
    a, b, c, d = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    return np.array([[1, 0, 0], [0, c, -d], [0, d, c]]) @ np.array([[a, 0, b], [0, 1, 0], [-b, 0, a]])


def drawn_mesh(path, size, rng):
    """A mesh in one or two colours with a highlight, drawn from back to front: light times coverage, and coverage."""
    width, height = (int(side * OVERSAMPLED) for side in size)
    vertices, faces = read_mesh(path)
    points = vertices @ rotation(rng.uniform(0, 6.28), rng.uniform(0, 0.5)).T
    scale = rng.uniform(0.28, 0.42) * min(width, height)
    middle = np.array([width * rng.uniform(0.42, 0.58), height * rng.uniform(0.42, 0.55)])
    places = middle + scale * points[:, :2] * [1, -1]
    triangles = points[faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-9
    normals[normals[:, 2] < 0] *= -1
    lamp = np.array([rng.uniform(-0.8, 0.8), rng.uniform(0.2, 0.9), 0.6])
    lamp /= np.linalg.norm(lamp)
    half = lamp + [0, 0, 1]
    half /= np.linalg.norm(half)
    first = rng.uniform(0.08, 0.9, 3) if rng.random() < 0.7 else np.ones(3) * rng.uniform(0.04, 0.85)
    second = rng.uniform(0.05, 0.9, 3)
    is_second = np.sin(triangles.mean(1) @ rng.normal(0, 4, 3)) > rng.uniform(0.2, 1.2)
    ambient = rng.uniform(0.2, 0.5)
    shading = ambient + (1 - ambient) * np.clip(normals @ lamp, 0, 1)
    colours = np.where(is_second[:, None], second, first) * shading[:, None]
    colours += rng.uniform(0, 0.4) * np.clip(normals @ half, 0, 1)[:, None] ** 40
    picture, mask = np.zeros((height, width, 3), np.float32), np.zeros((height, width), np.uint8)
    corners = np.round(places[faces] * 16).astype(np.int32)
    for k in np.argsort(triangles[:, :, 2].mean(1)):
        cv2.fillConvexPoly(picture, corners[k], colours[k].tolist(), cv2.LINE_8, 4)
        cv2.fillConvexPoly(mask, corners[k], 1, cv2.LINE_8, 4)
    small = [cv2.resize(image, size, interpolation=cv2.INTER_AREA) for image in (picture, mask.astype(np.float32))]
    return small[0], small[1]


def photographed(path, size, rng):
    """A photographed object: light times coverage, and coverage."""
    picture = (cv2.imread(str(path)).astype(np.float32) / 255) ** 2.2
    mask = cv2.imread(str(path.with_name(f"{path.stem}.mask.png")), cv2.IMREAD_GRAYSCALE)
    mask = cv2.erode((mask >= 128).astype(np.float32), np.ones((3, 3)))
    rows, columns = np.nonzero(mask)
    box = np.s_[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    picture, mask = picture[box] * mask[box][..., None] * rng.uniform(0.5, 1), mask[box]
    scale = rng.uniform(0.45, 0.65) * min(size[0] / mask.shape[1], size[1] / mask.shape[0])
    small = [cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) for image in (picture, mask)]
    height, width = small[1].shape
    x = (size[0] - width) // 2 + int(rng.uniform(-0.05, 0.05) * size[0])
    y = (size[1] - height) // 2 + int(rng.uniform(-0.05, 0.05) * size[1])
    whole, coverage = np.zeros((size[1], size[0], 3), np.float32), np.zeros((size[1], size[0]), np.float32)
    whole[y : y + height, x : x + width], coverage[y : y + height, x : x + width] = small
    return whole, coverage


def shadow(coverage, rng):
    """What is left of the ground's light beside an object."""
    rows, columns = np.nonzero(coverage > 0.5)
    width, foot = columns.max() - columns.min(), int(rows.max())
    near = coverage.copy()
    near[: max(foot - int(0.12 * (foot - rows.min())), 0)] = 0
    contact = cv2.GaussianBlur(near, (0, 0), max(2, 0.03 * width))
    left = 1 - rng.uniform(0.2, 0.6) * np.clip(1.2 * contact, 0, 1)
    if rng.random() < 0.8:
        lean, flat = 0.7 * rng.uniform(-0.9, 0.9), rng.uniform(0.15, 0.45)
        fall = np.float32([[1, -lean, lean * foot], [0, flat, foot * (1 - flat)]])
        cast = cv2.warpAffine(coverage, fall, coverage.shape[::-1])
        cast = cv2.GaussianBlur(cast, (0, 0), rng.uniform(0.015, 0.05) * width + 2)
        left *= 1 - rng.uniform(0.15, 0.55) * np.clip(cast, 0, 1)
    return left


def plain(kind, size, rng):
    y, x = np.mgrid[0 : size[1], 0 : size[0]].astype(np.float32)
    x, y = x / size[0] - 0.5, y / size[1] - 0.5
    if rng.random() < 0.5:
        colour = rng.uniform(0.03, 0.95, 3)
    else:
        colour = rng.choice([0.02, 0.1, 0.2, 0.4, 0.7, 0.9, 1.0]) * rng.uniform(0.9, 1.0, 3)
    grade = np.ones_like(x)
    if kind == "linear":
        angle = rng.uniform(0, 6.28)
        grade = 1 + rng.uniform(0.2, 0.8) * (np.cos(angle) * x + np.sin(angle) * y)
    elif kind == "vignette":
        grade = 1 - rng.uniform(0.3, 1.0) * ((x - rng.uniform(-0.15, 0.15)) ** 2 + (y - rng.uniform(-0.15, 0.15)) ** 2)
    elif kind == "sweep":
        floor = 1 / (1 + np.exp(-(y - rng.uniform(0.1, 0.3)) * rng.uniform(10, 20)))
        grade = 1 + rng.uniform(-0.25, 0.25) * floor + 0.2 * x * rng.uniform(-1, 1)
    tint = 1 + rng.uniform(-0.06, 0.06, 3) * y[..., None]
    return np.clip(colour * grade[..., None] * tint, 0, 1)


def crop(path, size, rng):
    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., :3].astype(np.float32)
    if path.suffix == ".hdr":
        picture = np.clip(picture * (0.25 / max(np.median(picture.mean(2)), 1e-6)), 0, 1)
    else:
        picture = (picture / 255) ** 2.2
    part = rng.uniform(0.35, 0.9)
    height, width = (max(8, int(part * side)) for side in picture.shape[:2])
    width = min(width, int(height * size[0] / size[1]) + 1)
    y, x = rng.integers(0, picture.shape[0] - height + 1), rng.integers(0, picture.shape[1] - width + 1)
    return cv2.resize(picture[y : y + height, x : x + width], size)


def cluttered(kind, backgrounds, size, rng):
    if kind == "picture":
        return crop(backgrounds[rng.integers(len(backgrounds))], size, rng)
    ground = plain("linear", size, rng)
    if kind == "horizon":
        edge = int(size[1] * rng.uniform(0.3, 0.75))
        ground[edge:] = plain("solid", size, rng)[edge:]
    elif kind == "shapes":
        for _ in range(rng.integers(4, 14)):
            corner = (rng.uniform(0, 1, 2) * size).astype(int)
            other = corner + (rng.uniform(0.08, 0.4, 2) * size).astype(int)
            colour = rng.uniform(0, 1, 3).tolist()
            if rng.random() < 0.5:
                cv2.rectangle(ground, corner.tolist(), other.tolist(), colour, -1)
            else:
                cv2.circle(ground, corner.tolist(), int(rng.uniform(0.05, 0.2) * size[0]), colour, -1)
    else:
        grain = rng.normal(0, 1, size[::-1]).astype(np.float32)
        across, down = (30, 1.5) if kind == "wood" else [rng.uniform(1.5, 8)] * 2
        grain = cv2.GaussianBlur(grain, (0, 0), sigmaX=across, sigmaY=down)
        ground = ground * (1 + rng.uniform(0.15, 0.5) * grain[..., None] / grain.std())
    return np.clip(ground, 0, 1)


def make(arguments):
    meshes = sorted(arguments.meshes.glob("*.obj"))
    objects = [path for path in sorted(arguments.objects.glob("*.png")) if not path.stem.endswith(".mask")]
    backgrounds = sorted(path for path in arguments.backgrounds.iterdir() if path.suffix in (".hdr", ".jpg", ".png"))
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for number in range(arguments.seed, arguments.seed + arguments.count):
        rng = np.random.default_rng(number)
        size = SIZES[rng.integers(len(SIZES))]
        if rng.random() < 0.7:
            picture, coverage = drawn_mesh(meshes[rng.integers(len(meshes))], size, rng)
        else:
            picture, coverage = photographed(objects[rng.integers(len(objects))], size, rng)
        if number % 2 == 0:
            name, kind = "plain", PLAIN[number // 2 % len(PLAIN)]
            ground = plain(kind, size, rng)
        else:
            name, kind = "cluttered", rng.choice(CLUTTER)
            ground = cluttered(kind, backgrounds, size, rng)
        light = picture + ground * shadow(coverage, rng)[..., None] * (1 - coverage[..., None])
        light = cv2.GaussianBlur(light.astype(np.float32), (0, 0), 0.9)
        noise = np.sqrt(np.maximum(light, 0) * 4e-4 * rng.uniform(0.05, 1) + 1e-6)
        light = np.clip(light + noise * rng.normal(0, 1, light.shape), 0, 1)
        coded = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
        path = arguments.folder / f"{number:04}-{name}-{kind}"
        quality = [cv2.IMWRITE_JPEG_QUALITY, 80 + number % 4 * 5]
        cv2.imwrite(f"{path}.jpg", np.round(coded * 255).astype(np.uint8), quality)
        cv2.imwrite(f"{path}.gt.png", (coverage > 0.5).astype(np.uint8) * 255)


def overlap(mask, truth):
    """Intersection over union; pixels of neither 0 nor 255 do not count."""
    counts = (truth == 0) | (truth == 255)
    mask, truth = (mask >= 128) & counts, (truth == 255) & counts
    return (mask & truth).sum() / max((mask | truth).sum(), 1)


def measure(arguments):
    results = collections.defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted(arguments.folder.glob("*.jpg")):
            output = pathlib.Path(folder) / "mask.png"
            command = [arguments.program, path, "--auto", "--force", "-o", output]
            is_made = subprocess.run(command, capture_output=True).returncode == 0
            parts = path.stem.split("-")
            kind = " ".join(parts[1:3]) if len(parts) > 2 else "photograph"
            truth = cv2.imread(str(path.with_name(f"{path.stem}.gt.png")), cv2.IMREAD_GRAYSCALE)
            found = overlap(cv2.imread(str(output), cv2.IMREAD_GRAYSCALE), truth) if is_made else None
            results[kind].append(found)
            if arguments.each and is_made:
                print(f"{path.stem}: {found:.3f}")
    print("| background | pictures | masks made | mean overlap | least | below 0.9 |")
    print("| --- | --- | --- | --- | --- | --- |")
    for kind, found in sorted(results.items()):
        made = np.array([overlap for overlap in found if overlap is not None])
        figures = f"{made.mean():.3f} | {made.min():.3f} | {(made < 0.9).sum()}" if len(made) else "| |"
        print(f"| {kind} | {len(found)} | {len(made)} | {figures} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(required=True)
    making = verbs.add_parser("make")
    for name in ("meshes", "objects", "backgrounds", "folder"):
        making.add_argument(name, type=pathlib.Path)
    making.add_argument("--count", type=int, default=240)
    making.add_argument("--seed", type=int, default=1000)
    making.set_defaults(run=make)
    measuring = verbs.add_parser("measure")
    measuring.add_argument("program", type=pathlib.Path)
    measuring.add_argument("folder", type=pathlib.Path)
    measuring.add_argument("--each", action="store_true", help="print the overlap of each mask")
    measuring.set_defaults(run=measure)
    arguments = parser.parse_args()
    arguments.run(arguments)


if __name__ == "__main__":
    main()
