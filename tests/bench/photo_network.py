"""The network that tells which object of a picture hints mean (src/grabcut/src/by_hints): its data and its training.

    relight synth samples --count 5000 --size 192 --views 1 --lightings 2 --meshes MESHES --panoramas PANORAMAS -o DATA/samples
    python photo_network.py make MESHES PANORAMAS DATA
    python photo_network.py train DATA --minutes 66 --learning-rate 2e-3 -o src/grabcut/src/by_hints/weights.safetensors

With the packages of requirements-network.txt. `make` renders scenes, objects on a disc in a room, by turns.py; DATA/scenes
gets one file a picture, colours and the object's coverage, and DATA/rooms the panoramas. `train` composes what it learns
from: three in ten are scenes, the others objects of scenes and samples, or drawn, on backgrounds that are panoramas, scenes,
or drawn.
"""

import multiprocessing

import cv2
import numpy as np
import torch
from torch.nn import functional

import efficientnet
import turns
import unet

cv2.setNumThreads(1)

SCENE, SHOTS, LIGHTINGS = (320, 240), 4, 2
# As src/grabcut/src/by_hints/odds.rs describes them.
SIDE, PLANES, SHOWN, AROUND = 192, 9, 5, 0.3
COARSE, FINE, RARE, MAX_RATIO = 3, 4, 1e-4, 5
UNMARKED, OBJECT, BACKGROUND = range(3)
HINTS = {"tight": 0.2, "loose": 0.24, "cut": 0.2, "whole": 0.04, "strokes": 0.16, "of object": 0.04, "both": 0.06, "dense": 0.06}
BATCH, FRESH, KEPT = 8, 4, 4000
# An object of fewer pixels is left out.
MIN_PIXELS = 60
LETTERS = "ABCDEGHKMNORSTUaegknors012358"


class BrightTable(turns.Paint):
    """Paint of a view whose table mostly has a colour, too."""

    def __init__(self, kind, view, rng):
        super().__init__(kind, view, rng)
        of_table = view.of_table
        if of_table.any() and rng.random() < 0.75:
            colour = rng.uniform(0.03, 0.85) * rng.uniform(0.5, 1, 3)
            mean = np.maximum(self.albedo[of_table].mean(0), 1e-3)
            self.albedo[of_table] = np.clip(self.albedo[of_table] / mean * colour, 0.01, 0.9)


def make(arguments):
    meshes = turns.sources(arguments.meshes)
    names = [name for name in meshes if not turns.is_held_out(name)]
    rooms = turns.panoramas(arguments.panoramas, held_out=False)
    for folder in ("scenes", "rooms"):
        (arguments.data / folder).mkdir(parents=True, exist_ok=True)
    for path in rooms:
        np.save(arguments.data / "rooms" / path.stem, turns.read_panorama(path).astype(np.float16))
    for number in range(arguments.seed, arguments.seed + arguments.views):
        rng = np.random.default_rng([number, 5])
        what, mesh = turns.draw_object(meshes, names, False, rng)
        try:
            view = turns.View(mesh, SCENE, rng)
        except (ValueError, IndexError) as why:
            print(f"{what} is left out: {why}", flush=True)
            continue
        cover = np.round(np.clip(view.cover[..., turns.OBJECT], 0, 1) * 255).astype(np.uint8)
        for shot in range(SHOTS):
            path = rooms[rng.integers(len(rooms))]
            picture = next(turns.pictures(view, None, path, 1, rng, BrightTable))
            np.save(arguments.data / "scenes" / f"{number:05}-{shot}", np.dstack([picture, cover]))


def filled(picture, known, blur):
    """A picture whose other pixels have the colours of the known ones next to them."""
    known = known.astype(np.float32)
    near = cv2.GaussianBlur(picture * known[..., None], (0, 0), blur)
    near = near / np.maximum(cv2.GaussianBlur(known, (0, 0), blur), 1e-3)[..., None]
    return np.where(known[..., None] > 0, picture, np.clip(near, 0, 1))


def scaled(picture, size=None, factor=None):
    size = size or tuple(max(1, round(factor * side)) for side in picture.shape[1::-1])
    how = cv2.INTER_AREA if size[0] < picture.shape[1] else cv2.INTER_LINEAR
    return cv2.resize(np.ascontiguousarray(picture), size, interpolation=how)


class Sources:
    """Objects and backgrounds."""

    def __init__(self, data, held_out, rng):
        self.rng = rng
        part = lambda paths, each: [path for at, path in enumerate(sorted(paths)) if (at // each % 16 == 0) == held_out]
        self.scenes = part((data / "scenes").glob("*.npy"), SHOTS)
        self.samples = [path.parent for path in part((data / "samples").glob("*/sample.json"), LIGHTINGS)]
        self.rooms = [np.load(path) for path in sorted((data / "rooms").glob("*.npy"))]
        if not (self.scenes and self.samples and self.rooms):
            raise SystemExit(f"{data} holds no scenes, samples or rooms: make them first")

    def scene(self):
        """A picture, perhaps mirrored, and the object's coverage."""
        both = np.load(self.scenes[self.rng.integers(len(self.scenes))])
        if self.rng.random() < 0.5:
            both = both[:, ::-1]
        return np.ascontiguousarray(both[..., :3]), both[..., 3].astype(np.float32) / 255

    def cut_out(self):
        """A picture of an object, 0 to 1, and its coverage."""
        rng = self.rng
        if rng.random() < 0.22:
            picture, cover = self.printed()
        elif rng.random() < 0.45:
            folder = self.samples[rng.integers(len(self.samples))]
            picture = cv2.imread(str(folder / "image.png"))
            cover = cv2.imread(str(folder / "mask.png"), cv2.IMREAD_GRAYSCALE).astype(np.float32) / 255
        else:
            picture, cover = self.scene()
        rows, columns = np.nonzero(cover > 0.5)
        if len(rows) < MIN_PIXELS:
            return self.cut_out()
        place = np.s_[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
        picture, cover = picture[place].astype(np.float32) / 255, cover[place]
        solid = cover > 0.97
        if solid.sum() >= MIN_PIXELS:
            # Without the background it was before.
            picture = filled(picture, solid, 1.2)
        if rng.random() < 0.5:
            picture, cover = picture[:, ::-1], cover[:, ::-1]
        if rng.random() < 0.08:
            picture, cover = picture[::-1], cover[::-1]
        if rng.random() < 0.25:
            picture = picture[..., rng.permutation(3)]
        if rng.random() < 0.3:
            picture, cover = turned(picture, cover, rng.uniform(-40, 40))
        return picture, cover

    def printed(self):
        """A drawn object with a print, 8 bits, and its coverage: a card, a box, a tin or a lump."""
        rng = self.rng
        side = int(rng.integers(96, 256))
        faces = rng.choice([card, carton, tin, lump])(rng)
        cover, light = np.zeros((2, 2 * side, 2 * side), np.float32)
        for corners, brightness in faces:
            corners = [np.round((1 + 0.6 * corners) * side).astype(np.int32)]
            cv2.fillPoly(cover, corners, 1)
            cv2.fillPoly(light, corners, brightness)
        cover, light = scaled(cover, factor=0.5), scaled(light, factor=0.5)
        across = np.linspace(-1, 1, side)
        light = light * (1 + rng.uniform(-0.3, 0.3) * across + rng.uniform(-0.3, 0.3) * across[:, None])
        return np.clip(255 * self.pattern((side, side)) * light[..., None], 0, 255).astype(np.uint8), cover

    def pattern(self, size):
        """Panels, discs, bands and letters of few colours, leaves, or noise."""
        rng = self.rng
        chance = rng.random()
        if chance < 0.45:
            return self.leaves(size) if chance < 0.3 else self.texture(size)
        colours = rng.uniform(0, 255, (rng.integers(2, 5), 3))
        colour = lambda: colours[rng.integers(len(colours))].tolist()
        within = lambda least, most, side: int(rng.uniform(least, most) * side)
        wide, high = size
        picture = np.full((high, wide, 3), colours[0], np.uint8)
        for _ in range(rng.integers(1, 6)):
            x, y = within(-0.2, 0.9, wide), within(-0.2, 0.9, high)
            kind = rng.choice(["panel", "disc", "band"])
            if kind == "panel":
                cv2.rectangle(picture, (x, y), (x + within(0.1, 1, wide), y + within(0.1, 0.8, high)), colour(), -1)
            elif kind == "disc":
                cv2.circle(picture, (x, y), within(0.05, 0.5, wide), colour(), -1, cv2.LINE_AA)
            else:
                cv2.rectangle(picture, (0, y), (wide, y + within(0.03, 0.3, high)), colour(), -1)
        for _ in range(rng.integers(0, 8)):
            text = "".join(rng.choice(list(LETTERS), rng.integers(2, 9)))
            place, font = (within(-0.1, 0.8, wide), within(0, 1, high)), int(rng.integers(0, 5))
            cv2.putText(picture, text, place, font, rng.uniform(0.3, 2), colour(), int(rng.integers(1, 5)), cv2.LINE_AA)
        return picture.astype(np.float32) / 255

    def background(self, size):
        rng = self.rng
        kinds = [self.room, self.leaves, self.texture, self.other_scene, self.plain]
        scene = kinds[rng.choice(5, p=[0.42, 0.18, 0.15, 0.18, 0.07])](size)
        if rng.random() < 0.25:
            # Another ground below.
            line = rng.uniform(0.2, 0.8) * size[1] + np.linspace(-1, 1, size[0]) * rng.normal() * 20
            low = np.clip((np.arange(size[1])[:, None] - line) * 0.7 + 0.5, 0, 1)[..., None]
            scene = scene * (1 - low) + self.background(size) * low
        return scene.astype(np.float32)

    def room(self, size):
        rng = self.rng
        light = self.rooms[rng.integers(len(self.rooms))].astype(np.float32)
        height, width = light.shape[:2]
        wide = int(width * np.exp(rng.uniform(np.log(0.12), np.log(0.5))))
        high = min(height, wide * size[1] // size[0])
        x, y = rng.integers(0, width - wide + 1), rng.integers(0, height - high + 1)
        part = light[y : y + high, x : x + wide]
        level = max(np.quantile(part, rng.uniform(0.6, 0.98)), 1e-4)
        part = np.clip(part / level * rng.uniform(0.3, 1), 0, 1) ** (1 / 2.2)
        how = cv2.INTER_CUBIC if wide < size[0] else cv2.INTER_AREA
        return np.clip(cv2.resize(part, size, interpolation=how), 0, 1)

    def leaves(self, size):
        """Shapes of all sizes, each over those before: such pictures have the statistics of natural ones (Lee, Mumford
        and Huang, "Occlusion models for natural images", 2001)."""
        rng = self.rng
        base, spread = rng.uniform(0, 1, 3), rng.uniform(0.05, 0.5)
        picture = np.full((size[1], size[0], 3), base, np.float32)
        least = np.exp(rng.uniform(np.log(1.5), np.log(12)))
        for _ in range(rng.integers(60, 500)):
            r = min(least * (1 - rng.random()) ** (-1 / 1.6), 80)
            at = (int(rng.uniform(0, size[0])), int(rng.uniform(0, size[1])))
            colour = np.clip(base + 0.4 * rng.normal(0, spread, 3) + rng.normal(0, spread), 0, 1).tolist()
            kind = rng.choice(["ellipse", "box", "bar"])
            if kind == "ellipse":
                axes = (int(r) + 1, int(r * rng.uniform(0.2, 1)) + 1)
                cv2.ellipse(picture, at, axes, rng.uniform(0, 180), 0, 360, colour, -1, cv2.LINE_AA)
            elif kind == "box":
                corners = cv2.boxPoints((at, (2 * r, r * rng.uniform(0.3, 2)), float(rng.choice([0, rng.uniform(0, 90)]))))
                cv2.fillPoly(picture, [corners.astype(np.int32)], colour, cv2.LINE_AA)
            else:
                angle = rng.uniform(0, 6.28)
                end = (int(at[0] + 3 * r * np.cos(angle)), int(at[1] + 3 * r * np.sin(angle)))
                cv2.line(picture, at, end, colour, max(1, int(r * rng.uniform(0.1, 0.5))), cv2.LINE_AA)
        return picture

    def texture(self, size):
        """Noise of three scales around a colour."""
        rng = self.rng
        total = np.zeros((size[1], size[0], 3), np.float32)
        for scale in np.exp(rng.uniform(0, np.log(60), 3)):
            cells = rng.normal(0, 1, (int(size[1] / scale) + 2, int(size[0] / scale) + 2, 3)).astype(np.float32)
            if rng.random() < 0.75:
                cells = 0.25 * cells + 0.9 * cells[..., :1]
            how = rng.choice([cv2.INTER_CUBIC, cv2.INTER_LINEAR, cv2.INTER_NEAREST])
            total += cv2.resize(cells, size, interpolation=int(how)) * rng.uniform(0.2, 0.8)
        return np.clip(rng.uniform(0.05, 0.9, 3) * np.exp(total * rng.uniform(0.03, 0.5)), 0, 1)

    def other_scene(self, size):
        rng = self.rng
        picture, _ = self.scene()
        height, width = picture.shape[:2]
        share = rng.uniform(0.5, 1)
        high, wide = int(height * share), int(width * share)
        y, x = rng.integers(0, height - high + 1), rng.integers(0, width - wide + 1)
        return scaled(picture[y : y + high, x : x + wide].astype(np.float32) / 255, size)

    def plain(self, size):
        rng = self.rng
        ramp = np.linspace(-1, 1, size[1])[:, None, None] * rng.normal() + np.linspace(-1, 1, size[0])[:, None] * rng.normal()
        return np.clip(rng.uniform(0, 1, 3) + rng.uniform(-0.3, 0.3, 3) * ramp, 0, 1)


def card(rng):
    """Faces of a drawn object: corners from -1 to 1, and brightness."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * rng.uniform(0.4, 1, 2) + rng.normal(0, 0.08, (4, 2))
    return [(corners @ rotation(rng.uniform(-0.5, 0.5)), 1.0)]


def carton(rng):
    high, wide, deep = rng.uniform(0.5, 1), rng.uniform(0.3, 0.7), rng.uniform(0.1, 0.6) * rng.choice([-1, 1])
    up, side = rng.uniform(0.15, 0.5) * abs(deep), wide * np.sign(deep)
    front = [[-wide, -high], [wide, -high], [wide, high], [-wide, high]]
    flank = [[side, -high], [side + deep, -high - up], [side + deep, high - up], [side, high]]
    top = [[-wide, -high], [wide, -high], [wide + deep, -high - up], [-wide + deep, -high - up]]
    about, middle = rotation(rng.normal(0, 0.1)), [deep / 2, -up / 2]
    return [((np.array(face) - middle) @ about, rng.uniform(0.35, 1.2)) for face in (front, flank, top)]


def tin(rng):
    """Upright strips, the darker the farther from where the light comes from."""
    wide, high = rng.uniform(0.3, 0.7), rng.uniform(0.5, 1)
    bulge, lit = wide * rng.uniform(0.1, 0.4), rng.uniform(-0.5, 0.5)
    edges = np.linspace(-1, 1, 33)
    bend = bulge * np.sqrt(1 - edges**2)
    strips = zip(zip(edges, bend), zip(edges[1:], bend[1:]))
    corners = lambda a, b, c, d: np.array([[wide * a, -high - b], [wide * c, -high - d], [wide * c, high + d], [wide * a, high + b]])
    body = [(corners(*left, *right), np.clip(1.1 - 0.8 * (left[0] - lit) ** 2, 0.1, 1.2)) for left, right in strips]
    around = np.stack([wide * edges, bend], -1)
    lid = np.concatenate([around, -around]) - [0, high]
    return [*body, (lid, rng.uniform(0.5, 1.2))]


def lump(rng):
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    ellipse = lambda: np.stack([np.cos(angle), np.sin(angle)], -1) * rng.uniform(0.2, 0.7, 2) @ rotation(rng.uniform(0, np.pi))
    return [(ellipse() + rng.uniform(-0.5, 0.5, 2), 1.0) for _ in range(rng.integers(2, 5))]


def rotation(angle):
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def turned(picture, cover, angle):
    height, width = cover.shape
    about = cv2.getRotationMatrix2D((width / 2, height / 2), angle, 1)
    cosine, sine = abs(about[0, 0]), abs(about[0, 1])
    size = (int(height * sine + width * cosine) + 2, int(height * cosine + width * sine) + 2)
    about[:, 2] += [(size[0] - width) / 2, (size[1] - height) / 2]
    picture = cv2.warpAffine(np.ascontiguousarray(picture), about, size, borderMode=cv2.BORDER_REPLICATE)
    return picture, cv2.warpAffine(np.ascontiguousarray(cover), about, size)


def pasted(scene, picture, cover, at, edge):
    """The scene with an object at a place, and its coverage there."""
    (height, width), (high, wide), (x, y) = scene.shape[:2], cover.shape, at
    left, top, right, bottom = max(x, 0), max(y, 0), min(x + wide, width), min(y + high, height)
    truth, front = np.zeros((height, width), np.float32), np.zeros_like(scene)
    if right <= left or bottom <= top:
        return scene, truth
    to, of = np.s_[top:bottom, left:right], np.s_[top - y : bottom - y, left - x : right - x]
    truth[to], front[to] = cover[of], picture[of]
    soft = cv2.GaussianBlur(truth, (0, 0), edge)[..., None]
    return scene * (1 - soft) + filled(front, truth > 0.5, 1.5) * soft, truth


def composed(sources):
    """A picture of 8 bits, and the object's coverage."""
    rng = sources.rng
    if rng.random() < 0.3:
        picture, truth = sources.scene()
        if rng.random() < 0.2:
            picture = np.ascontiguousarray(picture[..., rng.permutation(3)])
    else:
        picture, truth = on_background(sources, SCENE if rng.random() < 0.7 else SCENE[::-1])
    return (picture, truth) if (truth > 0.5).sum() >= MIN_PIXELS else composed(sources)


def on_background(sources, size):
    rng = sources.rng
    scene = sources.background(size)
    for _ in range(rng.choice([0, 0, 1, 2])):
        picture, cover = sources.cut_out()
        factor = rng.uniform(0.15, 0.6) * min(size) / max(cover.shape)
        place = [int(rng.uniform(-0.3, 1) * side) for side in size]
        scene, _ = pasted(scene, scaled(picture, factor=factor), scaled(cover, factor=factor), place, 0.6)
    if rng.random() < 0.35:
        scene = cv2.GaussianBlur(scene, (0, 0), rng.uniform(0.7, 5))
    picture, cover = sources.cut_out()
    wanted = rng.uniform(0.22, 0.8) * np.sqrt(size[0] * size[1] / (cover.shape[0] * cover.shape[1]))
    factor = min(wanted, 0.95 * size[1] / cover.shape[0], 0.95 * size[0] / cover.shape[1])
    picture, cover = scaled(picture, factor=factor), scaled(cover, factor=factor)
    high, wide = cover.shape
    if rng.random() < 0.12:
        # Cut off by the picture's border.
        x, y = int(rng.uniform(-0.2 * wide, size[0] - 0.8 * wide)), int(rng.uniform(-0.1 * high, size[1] - 0.8 * high))
    else:
        x, y = int(rng.integers(0, size[0] - wide + 1)), int(rng.integers(0, size[1] - high + 1))
    picture = coloured(picture, cover, scene, scene[max(y, 0) : y + high, max(x, 0) : x + wide], sources)
    if rng.random() < 0.3:
        place = (x + int(rng.normal() * 0.15 * wide), y + int(abs(rng.normal()) * 0.1 * high))
        shadow = cv2.GaussianBlur(pasted(scene, picture, cover, place, 1)[1], (0, 0), rng.uniform(2, 12))
        scene = scene * (1 - rng.uniform(0.2, 0.7) * shadow)[..., None]
    whole, truth = pasted(scene, picture, cover, (x, y), rng.uniform(0.35, 1))
    whole = 255 * np.maximum(whole, 0) ** rng.uniform(0.8, 1.25) + rng.normal(0, rng.uniform(0.3, 5), whole.shape)
    whole = np.clip(np.rint(whole), 0, 255).astype(np.uint8)
    if rng.random() < 0.8:
        coded = cv2.imencode(".jpg", whole, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(60, 97))])[1]
        whole = cv2.imdecode(coded, cv2.IMREAD_COLOR)
    return whole, truth


def coloured(picture, cover, scene, around, sources):
    """An object as bright as the scene, sometimes in the colours of what is around it, or with a print."""
    rng = sources.rng
    inside = picture[cover > 0.5] if (cover > 0.5).any() else picture.reshape(-1, 3)
    if rng.random() < 0.8:
        brightness = scene.mean() / max(inside.mean(), 1e-3) * 2 ** rng.uniform(-1, 1)
        picture = picture * np.clip(brightness, 0, 1.3 / max(picture.max(), 1e-3))
    if rng.random() < 0.25:
        picture = picture + (around.reshape(-1, 3).mean(0) - inside.mean(0)) * rng.uniform(0.2, 0.8)
    size, chance = picture.shape[1::-1], rng.random()
    if chance < 0.15:
        shading = picture.mean(-1, keepdims=True)
        picture = sources.pattern(size) * shading / max(np.quantile(shading, 0.9), 1e-2) * rng.uniform(0.7, 1.2)
    elif chance < 0.4:
        picture = picture * (0.3 + 1.2 * (sources.texture(size) if rng.random() < 0.5 else sources.leaves(size)))
    return np.clip(picture, 0, 1).astype(np.float32)


def opened(bits, radius):
    """What is deeper than a radius inside, and what is farther than that outside."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    return cv2.erode(bits.astype(np.uint8), disc) > 0, cv2.dilate(bits.astype(np.uint8), disc) == 0


def stroke(marks, region, mark, width, rng):
    """Marks a part of a region along a broken line through its middle."""
    depth = cv2.distanceTransform(region.astype(np.uint8), cv2.DIST_L2, 3)
    rows, columns = np.nonzero(depth > 0.35 * max(depth.max(), 1e-3))
    if len(rows) == 0:
        return
    line = np.zeros(region.shape, np.uint8)
    places = [(int(columns[k]), int(rows[k])) for k in rng.integers(0, len(rows), rng.integers(2, 5))]
    for begin, end in zip(places, places[1:]):
        cv2.line(line, begin, end, 255, width)
    marks[(line > 0) & region] = mark


def hinted(truth, rng):
    """A box (left, top, right, bottom) or None, and marks."""
    height, width = truth.shape
    inside = truth > 0.5
    rows, columns = np.nonzero(inside)
    bounds = np.array([columns.min(), rows.min(), columns.max() + 1, rows.max() + 1])
    wide, high = bounds[2] - bounds[0], bounds[3] - bounds[1]
    marks = np.full(truth.shape, UNMARKED, np.uint8)
    kind = rng.choice(list(HINTS), p=list(HINTS.values()))
    if kind == "dense":
        deep, far = opened(inside, int(rng.integers(1, 14)))
        marks[deep], marks[far] = OBJECT, BACKGROUND
        box = clipped(bounds + [-2, -2, 2, 2], width, height) if rng.random() < 0.5 else None
        return (box, marks) if deep.any() else hinted(truth, rng)
    free = rng.uniform(0, 0.04, 4) * max(wide, high)
    if kind == "loose":
        free = (np.full(4, rng.uniform(0.03, 0.25)) if rng.random() < 0.5 else rng.uniform(0, 0.35, 4)) * max(wide, high)
    elif kind == "cut":
        for side in rng.choice(4, rng.choice([1, 1, 1, 2]), replace=False):
            free[side] = -rng.uniform(0.03, 0.22) * (wide, high)[side % 2]
    elif kind == "whole":
        free = np.abs(np.array([0, 0, width, height]) - bounds) - rng.uniform(0, 0.03, 4) * max(width, height)
    box = None if kind in ("strokes", "of object") else clipped(bounds + [-free[0], -free[1], free[2], free[3]], width, height)
    if box is not None and (min(box[2] - box[0], box[3] - box[1]) < 6 or not inside[box[1] : box[3], box[0] : box[2]].any()):
        return hinted(truth, rng)
    if kind in ("strokes", "of object", "both"):
        deep, far = opened(inside, 2)
        if box is not None:
            far &= within(box, truth.shape)
        if kind == "strokes" and rng.random() < 0.5:
            frame = np.zeros(truth.shape, np.uint8)
            margin = int(rng.uniform(2, 12))
            cv2.rectangle(frame, (margin, margin), (width - margin, height - margin), 255, int(rng.integers(1, 5)))
            marks[(frame > 0) & far] = BACKGROUND
        elif kind != "of object":
            for _ in range(rng.integers(1, 5)):
                stroke(marks, far, BACKGROUND, int(rng.integers(1, 6)), rng)
        for _ in range(rng.integers(1, 4)):
            stroke(marks, deep if deep.any() else inside, OBJECT, int(rng.integers(1, 5)), rng)
        if box is None and not (marks == OBJECT).any():
            return hinted(truth, rng)
    return box, marks


def clipped(box, width, height):
    return [max(0, int(box[0])), max(0, int(box[1])), min(width, int(np.ceil(box[2]))), min(height, int(np.ceil(box[3])))]


def within(box, shape):
    inside = np.zeros(shape, bool)
    inside[box[1] : box[3], box[0] : box[2]] = True
    return inside


def ratios(rgb, is_first, bits):
    """The logarithms of how much more often each pixel's colour is seen in the first part than in the rest."""
    red, green, blue = (rgb[..., channel].astype(int) >> (8 - bits) for channel in range(3))
    colours = (red << bits | green) << bits | blue
    if is_first.all() or not is_first.any():
        return np.zeros(colours.shape, np.float32)
    seen = (np.bincount(colours[part], minlength=1 << 3 * bits) / part.sum() + RARE for part in (is_first, ~is_first))
    first, rest = seen
    return np.clip(np.log(first / rest) / MAX_RATIO, -1, 1)[colours].astype(np.float32)


def observed(picture, box, marks):
    """The planes but for column and row, and the part of the picture that they show, with its width and height there."""
    height, width = marks.shape
    background = marks == BACKGROUND
    part = [0, 0, width, height]
    if box is not None:
        background |= ~within(box, marks.shape) & (marks != OBJECT)
        more = AROUND * max(box[2] - box[0], box[3] - box[1])
        part = clipped(np.array(box) + [-more, -more, more, more], width, height)
    left, top, right, bottom = part
    factor = SIDE / max(right - left, bottom - top)
    size = max(1, round((right - left) * factor)), max(1, round((bottom - top) * factor))
    small = lambda plane: scaled(plane[top:bottom, left:right], size)
    rgb = small(picture[..., ::-1])
    of_object, of_background = (small(of.astype(np.float32)) for of in (marks == OBJECT, background))
    is_background = of_background > 0.5
    planes = np.zeros((PLANES, SIDE, SIDE), np.float32)
    shown = [*rgb.transpose(2, 0, 1) / 255, of_object, of_background, np.ones_like(of_object)]
    shown += [ratios(rgb, ~is_background, bits) for bits in (COARSE, FINE)] + [ratios(rgb, of_object > 0.25, COARSE)]
    planes[:, : size[1], : size[0]] = shown
    return planes, part, size


def example(sources):
    """Planes, and the shares of object and background."""
    picture, truth = composed(sources)
    planes, (left, top, right, bottom), size = observed(picture, *hinted(truth, sources.rng))
    shares = np.zeros((2, SIDE, SIDE), np.float32)
    of_object = scaled(truth[top:bottom, left:right], size)
    shares[:, : size[1], : size[0]] = of_object, 1 - of_object
    return np.concatenate([planes, shares]).astype(np.float16)


def compose(data, seed, queue):
    """Fills a queue with examples, for ever."""
    sources = Sources(data, False, np.random.default_rng(seed))
    while True:
        queue.put(example(sources))


def varied(both, rng):
    """An example mirrored within its part, or brighter."""
    both = both.copy()
    if rng.random() < 0.5:
        wide = int(both[5].max(0).sum())
        both[:, :, :wide] = both[:, :, :wide][:, :, ::-1].copy()
    if rng.random() < 0.3:
        both[:3] = np.clip(both[:3] * np.float16(rng.uniform(0.7, 1.3)), 0, 1)
    return both


def batches(queue, rng):
    """Batches of the last examples, each of which is used about twice."""
    kept = []
    while True:
        kept = [*kept, *(queue.get(timeout=300) for _ in range(FRESH if kept else 200))][-KEPT:]
        chosen = [varied(kept[at], rng) for at in rng.integers(0, len(kept), BATCH)]
        yield apart(np.stack(chosen))


def apart(both):
    both = torch.from_numpy(both).float()
    return both[:, :PLANES].contiguous(memory_format=torch.channels_last), both[:, PLANES:]


def loss(logits, shares):
    entropy = functional.binary_cross_entropy_with_logits(logits, shares[:, :1], reduction="none")
    return unet.loss(logits, entropy, shares)


@torch.no_grad()
def overlap(network, examples):
    found = []
    for one in examples:
        seen, shares = apart(one[None])
        logits = network.eval()(seen)
        is_object, truth = (logits > 0) & (shares.sum(1, keepdim=True) > 0.5), shares[:, :1] > 0.5
        found.append(((is_object & truth).sum() / (is_object | truth).sum().clamp(min=1)).item())
    return turns.mean(np.array(found))


def network_of():
    return unet.Network(PLANES, 1, efficientnet.encoder(PLANES + 2), efficientnet.SKIPS)


def train(arguments):
    sources = Sources(arguments.data, True, np.random.default_rng(1))
    validation = [example(sources) for _ in range(100)]
    queue = multiprocessing.Queue(64)
    multiprocessing.Process(target=compose, args=(arguments.data, 7, queue), daemon=True).start()
    torch.manual_seed(0)
    network, mean = (network_of() for _ in range(2))
    efficientnet.take(network.encoder, shown=SHOWN)
    overlap_of = lambda network: overlap(network, validation)
    unet.fit(network, mean, batches(queue, np.random.default_rng(99)), loss, overlap_of, arguments)


def parity(arguments):
    """Planes and logits of a pattern, for the test of src/grabcut/src/by_hints/odds.rs."""
    network = unet.read(network_of(), arguments.weights)
    down, across = np.mgrid[0:SIDE, 0:SIDE]
    level = lambda channel: (3 * across + down * (5 + channel) + across * down // 7 + 60 * (across // 48) * channel) % 256
    picture = np.stack([level(channel) for channel in (2, 1, 0)], -1).astype(np.uint8)
    marks = np.zeros((SIDE, SIDE), np.uint8)
    marks[80:90, 70:100] = OBJECT
    planes, *_ = observed(picture, [40, 50, 150, 140], marks)
    with torch.no_grad():
        logits = network(torch.from_numpy(planes[None]))[0].numpy()
    for what, found in (("plane", planes), ("logit", logits)):
        for number, plane in enumerate(found):
            print(what, number, *(f"{plane[y, x]:.5f}" for x, y in ((7, 5), (90, 75), (120, 130))))


if __name__ == "__main__":
    unet.command_line(__doc__, make, train, parity, views=360)
