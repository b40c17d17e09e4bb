"""Rendered turns of objects that are hard to cut out, with ground truth, and how `relit-mask --auto` and its check do.

    python turns.py make MESHES PANORAMAS FOLDER --count 20 --seed 1000
    python turns.py measure relit-mask FOLDER

MESHES holds `.obj` and archives of Sweet Home 3D (`.sh3f`), PANORAMAS `.hdr`. The kinds take turns: objects with openings,
black ones, white ones, and objects before a white room. A third are built of bars, boxes and rings. They stand on a dark,
slightly glossy disc, lit by a panorama through a light transport of 360 directions (shadows, and the object's light
on the table). FOLDER/NUMBER-KIND-OBJECT gets `video.mkv` (Motion JPEG, one turn) and `mask_gt.png`, an antialiased mask.
`ffmpeg` writes the videos. turn_network.py learns from the same turns, but from other objects and panoramas: those here
are held out by a hash of their names.
"""

import argparse
import concurrent.futures
import pathlib
import re
import subprocess
import tempfile
import zipfile
import zlib

import cv2
import numpy as np

SIZE, FINE = (640, 480), 2
FRAMES = 150
DIRECTIONS = 360
KINDS = ["openings", "black", "white-room", "white"]
BUILT = ["chair", "rack", "mug", "rings", "basket", "lamp", "arch"]
OPEN = re.compile("chair|stool|shelf|rack|bike|cart|ladder|basket|table|lamp|wheel", re.I)
# What stands or hangs on nothing.
NOT_ON_TABLES = re.compile("window|door|wall|stair|fence|curtain|blind|roof|carpet|rug|picture|poster|mirror|frame|switch|outlet|floor", re.I)
# Held out: one object in seven, by a hash of its name, those whose licence allows no training, and five panoramas.
ONE_IN = 7
KEPT_APART = {"armadillo", "boot", "bunny", "demosthenes-low-res", "nefertiti-lowres", "spot", "springer"}
KEPT_ROOMS = {"autoshop_01", "brown_photostudio_02", "kloppenheim_05", "noon_grass", "studio_small_05"}
ROOM, TABLE, OBJECT = range(3)


def obj(lines):
    """Vertices, triangles, and the number of each triangle's material."""
    vertices, faces, names, parts = [], [], {}, []
    for line in lines:
        word, *rest = line.split() or [""]
        if word == "v":
            vertices.append([float(number) for number in rest[:3]])
        elif word == "usemtl":
            names.setdefault(line, len(names))
            part = names[line]
        elif word == "f":
            at = [int(corner.split("/")[0]) for corner in rest]
            at = [corner - 1 if corner > 0 else len(vertices) + corner for corner in at]
            faces += [[at[0], at[k], at[k + 1]] for k in range(1, len(at) - 1)]
            parts += [part if names else 0] * (len(at) - 2)
    return np.array(vertices), np.array(faces, int).reshape(-1, 3), np.array(parts, int)


def sources(folder):
    """The names of all objects, each with a function that reads it."""
    found = {path.stem: lambda path=path: obj(path.read_text().splitlines()) for path in sorted(folder.rglob("*.obj"))}
    for path in sorted(folder.rglob("*.sh3f")):
        with zipfile.ZipFile(path) as archive:
            names = [name for name in archive.namelist() if name.endswith(".obj") and not NOT_ON_TABLES.search(name)]

        def read(path=path, name=None):
            with zipfile.ZipFile(path) as archive:
                return obj(archive.read(name).decode("latin-1").splitlines())

        for name in sorted(names):
            found[pathlib.Path(name).stem] = lambda read=read, name=name: read(name=name)
    return found


def grid(points, part):
    """A closed surface through rows of points that close in themselves."""
    rows, columns = points.shape[:2]
    at = np.arange(rows * columns).reshape(rows, columns)
    right, down = np.roll(at, -1, 1), np.roll(at, -1, 0)
    corners = np.stack([at, right, np.roll(right, -1, 0), down], -1)[:-1].reshape(-1, 4)
    faces = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return points.reshape(-1, 3), faces, np.full(len(faces), part)


def tube(path, radius, part, sides=14):
    """A tube along points."""
    path = np.array(path, float)
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, [0.31, 0.17, 0.93])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)[None, :, None]
    rings = path[:, None] + radius * (np.cos(angle) * side[:, None] + np.sin(angle) * np.cross(along, side)[:, None])
    ends = [np.repeat(path[k][None, None], sides, 1) for k in (0, -1)]
    return grid(np.concatenate([ends[0], rings, ends[1]]), part)


def ring(middle, radius, thick, part, upright=None):
    """A torus, lying, or upright and turned by an angle; as a tube."""
    turn = np.linspace(0, 2 * np.pi, 49)
    flat = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], 1)
    if upright is not None:
        flat = np.stack([np.cos(turn) * np.cos(upright), np.sin(turn), np.cos(turn) * np.sin(upright)], 1)
    return tube(np.array(middle) + radius * flat, thick, part)


def box(low, high, part):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    places = (np.array(low) + corners * (np.array(high) - low))[quads].reshape(-1, 3)
    at = np.arange(24).reshape(6, 4)
    return places, np.concatenate([at[:, [0, 1, 2]], at[:, [0, 2, 3]]]), np.full(12, part)


def turned(profile, part, sides=48):
    """A solid of revolution of points (radius, height)."""
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    profile = np.array(profile, float)
    points = np.stack([np.outer(profile[:, 0], np.cos(angle)), np.outer(profile[:, 1], np.ones(sides)), np.outer(profile[:, 0], np.sin(angle))], -1)
    return grid(points, part)


def built(kind, rng):
    """Parts of an object of bars, boxes and rings, that stands on y = 0."""
    w, d, h, t = rng.uniform(0.35, 0.6), rng.uniform(0.3, 0.5), rng.uniform(0.9, 1.5), rng.uniform(0.025, 0.06)
    legs = [(x * w, z * d) for x in (-1, 1) for z in (-1, 1)]
    if kind == "chair":
        parts = [tube([[x, 0, z], [x, h / 2, z]], t, 0) for x, z in legs]
        parts += [box([-w - t, h / 2, -d - t], [w + t, h / 2 + 1.5 * t, d + t], 1)]
        parts += [tube([[x, h / 2, -d], [x * 1.05, h, -d * 1.2]], t, 0) for x in np.linspace(-w, w, rng.integers(3, 6))]
        parts += [tube([[-w * 1.1, h, -d * 1.2], [w * 1.1, h, -d * 1.2]], t, 0)]
    elif kind == "rack":
        parts = [tube([[x, 0, z], [x, h, z]], t, 0) for x, z in legs]
        parts += [box([-w, y, -d], [w, y + t, d], 1) for y in np.linspace(0.12, 0.95, rng.integers(2, 5)) * h]
    elif kind == "mug":
        r = 0.75 * w
        parts = [turned([[0, 0], [r, 0], [r, h], [0.9 * r, h], [0.85 * r, 0.06], [0, 0.06]], 0)]
        parts += [ring([r, h / 2, 0], h * rng.uniform(0.26, 0.36), 1.2 * t, 1, 0)]
    elif kind == "rings":
        parts = [ring([0, 0.45 * h, 0], 0.45 * h - t, t, k % 2, angle) for k, angle in enumerate(rng.uniform(0, 3.14, rng.integers(1, 4)))]
        parts += [turned([[0, 0], [w * 0.6, 0], [w * 0.6, t], [0, 1.5 * t]], 1)]
    elif kind == "basket":
        parts = [ring([0, y * h * 0.6, 0], w * (0.8 + 0.3 * y), t * 0.8, 1) for y in (0.07, 0.5, 1)]
        turns = np.linspace(0, 6.28, rng.integers(9, 16))[:-1]
        foot = [np.array([np.cos(a), 0, np.sin(a)]) * w for a in turns]
        parts += [tube([0.8 * p, 1.1 * p + [0, h * 0.6, 0]], t * 0.7, 0) for p in foot]
        parts += [turned([[0, 0], [0.8 * w, 0], [0.8 * w, t], [0, t]], 0)] + [ring([0, h * 0.6, 0], 1.1 * w, t * 0.7, 0, rng.uniform(0, 3))]
    elif kind == "lamp":
        elbow, head = [-w * 0.9, h * 0.6, 0], [w * 0.7, h, d * 0.5]
        parts = [turned([[0, 0], [w * 0.7, 0], [w * 0.6, 0.08], [0, 0.1]], 1), tube([[0, 0.05, 0], elbow], t, 0), tube([elbow, head], t, 0)]
        shade = turned([[0, 0.3], [0.1, 0.3], [0.35, 0], [0.33, 0], [0, 0.26]], 1)
        parts += [(shade[0] + head - [0, 0.25, 0], *shade[1:])]
    else:
        parts = [box([-w, 0, -d], [-w + 5 * t, h, d], 0), box([w - 5 * t, 0, -d], [w, h, d], 0), box([-w, h, -d], [w, h + 4 * t, d], 1)]
        parts += [turned([[0, h + 4 * t], [w / 2, h + 4 * t], [w / 2, h + 8 * t], [0, h + 8 * t]], 0)] * (rng.random() < 0.5)
    vertices = np.concatenate([part[0] for part in parts])
    offsets = np.cumsum([0] + [len(part[0]) for part in parts[:-1]])
    faces = np.concatenate([part[1] + offset for part, offset in zip(parts, offsets)])
    return vertices, faces, np.concatenate([part[2] for part in parts])


def unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def normals(vertices, faces):
    """Each triangle's normal, and those of its corners, smooth but for creases."""
    edges = vertices[faces[:, 1:]] - vertices[faces[:, :1]]
    of_face = np.cross(edges[:, 0], edges[:, 1])
    smooth = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(smooth, faces[:, corner], of_face)
    of_face, smooth = unit(of_face)[:, None], unit(smooth)[faces]
    return of_face[:, 0], np.where((smooth * of_face).sum(-1, keepdims=True) < 0.7, of_face, smooth)


def raster(places, faces, size):
    """Of each pixel the nearest triangle (-1 for none) and its barycentric coordinates; places are x, y, 1/depth."""
    width, height = size
    corners = places[faces]
    low = np.clip(np.floor(corners[..., :2].min(1)), 0, [width, height]).astype(int)
    high = np.clip(np.ceil(corners[..., :2].max(1)) + 1, 0, [width, height]).astype(int)
    many = np.prod(np.maximum(high - low, 0), 1)
    a, b, c = (corners[:, k] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    depth, shown = np.full(width * height, -np.inf), np.full(width * height, -1)
    shares = np.zeros((width * height, 3))
    todo = np.flatnonzero((many > 0) & (np.abs(area) > 1e-9))
    for some in np.split(todo, np.searchsorted(np.cumsum(many[todo]), np.arange(3_000_000, many[todo].sum(), 3_000_000))):
        at = np.repeat(some, many[some])
        number = np.arange(len(at)) - np.repeat(np.cumsum(many[some]) - many[some], many[some])
        columns = (high - low)[at, 0]
        x, y = low[at, 0] + number % columns, low[at, 1] + number // columns
        u, v = x + 0.5, y + 0.5
        cross = lambda p, q: ((q[at, 0] - p[at, 0]) * (v - p[at, 1]) - (q[at, 1] - p[at, 1]) * (u - p[at, 0])) / area[at]
        share = np.stack([cross(b, c), cross(c, a), cross(a, b)], 1)
        inside = (share >= 0).all(1)
        at, pixel, share = at[inside], (y * width + x)[inside], share[inside]
        near = (share * corners[at, :, 2]).sum(1)
        np.maximum.at(depth, pixel, near)
        wins = near >= depth[pixel]
        shown[pixel[wins]], shares[pixel[wins]] = at[wins], share[wins]
    return shown, shares


def directions():
    k = np.arange(DIRECTIONS) + 0.5
    y, turn = 1 - 2 * k / DIRECTIONS, np.pi * (1 + 5**0.5) * k
    return np.stack([np.sqrt(1 - y * y) * np.cos(turn), y, np.sqrt(1 - y * y) * np.sin(turn)], 1)


def visible(points, to, surface, disc, cells=220):
    """Which of some points see the sky in a direction: a depth map of points of the surface, and the disc."""
    side = np.cross(to, [0.3, 0.2, 0.9])
    side /= np.linalg.norm(side)
    axes = np.stack([side, np.cross(to, side), to], 1).astype(np.float32)
    scale = cells / 4.6
    seen, own = surface @ axes, points @ axes
    cell = lambda at: (np.clip(at[:, :2] * scale + cells / 2, 0, cells - 1)).astype(int) @ [cells, 1]
    nearest = np.full(cells * cells, -np.inf, np.float32)
    np.maximum.at(nearest, cell(seen), seen[:, 2])
    free = own[:, 2] > nearest[cell(own)] - 2.5 / scale
    if to[1] < 0:
        hit = points - to * (points[:, 1] / to[1])[:, None]
        free &= np.hypot(hit[:, 0], hit[:, 2]) > disc
    return free


def sampled(panorama, at, turn):
    """The panorama's light in directions, after the room turned by an angle."""
    height, width = panorama.shape[:2]
    u = ((np.arctan2(at[..., 2], at[..., 0]) + turn) / (2 * np.pi) % 1) * width
    v = (np.arccos(np.clip(at[..., 1], -1, 1)) / np.pi * height - 0.5).clip(0, height - 1)
    padded = np.concatenate([panorama, panorama[:, :1]], 1)
    places = (place.reshape(len(at), -1).astype(np.float32) for place in (u, v))
    return cv2.remap(padded, *places, cv2.INTER_LINEAR)


def is_held_out(name):
    return name in KEPT_APART or zlib.crc32(name.encode()) % ONE_IN == 0


def panoramas(folder, held_out):
    """The panoramas of a folder that are held out, or the others."""
    found = sorted(folder.rglob("*.hdr")) + sorted(folder.rglob("*.exr"))
    return [path for path in found if (path.stem in KEPT_ROOMS) == held_out]


def read_panorama(path):
    if path.suffix == ".exr":
        import OpenEXR

        with OpenEXR.File(str(path)) as file:
            channels = file.channels()
            stacked = next((channels[name].pixels for name in ("RGB", "RGBA") if name in channels), None)
            light = stacked if stacked is not None else np.stack([channels[name].pixels for name in "RGB"], -1)
        light = light[..., 2::-1]
    else:
        light = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., :3]
    light = np.nan_to_num(light.astype(np.float32), posinf=3000)
    light = np.minimum(cv2.resize(light, (1024, 512), interpolation=cv2.INTER_AREA), 3000)
    return light / max(light[100:412].mean(), 1e-4)


class View:
    """An object on its table, seen by a camera: what of it each pixel shows, and from where that sees the sky."""

    def __init__(self, mesh, size, rng):
        width, height = self.size = size
        vertices, faces, parts = mesh
        vertices = vertices - (vertices.max(0) + vertices.min(0)) / 2
        yaw = rng.uniform(0, 6.28)
        vertices = vertices @ np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
        vertices /= max(np.hypot(vertices[:, 0], vertices[:, 2]).max(), rng.uniform(0.5, 0.7) * np.ptp(vertices[:, 1]))
        vertices[:, 1] -= vertices[:, 1].min() - 1e-3
        disc = rng.uniform(1.05, 1.8) if rng.random() < 0.75 else rng.uniform(1.8, 3.2)
        thick = rng.uniform(0.02, 0.25)
        edges = vertices[faces[:, 1:]] - vertices[faces[:, :1]]
        area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        chosen = rng.choice(len(faces), 80_000, p=area / area.sum())
        share = rng.dirichlet([1, 1, 1], len(chosen))
        surface = (vertices[faces[chosen]] * share[..., None]).sum(1).astype(np.float32)
        base = turned([[0, 0], [disc, 0], [disc, -thick], [0, -thick]], 0, 160)
        whole = np.concatenate([vertices, base[0]])
        triangles = np.concatenate([faces, base[1] + len(vertices)])

        # The camera looks down at the object.
        pitch, distance = np.radians(rng.uniform(6, 42)), rng.uniform(4.5, 10)
        back = np.array([0, np.sin(pitch), np.cos(pitch)])
        axes = np.stack([[1, 0, 0], -np.cross(back, [1, 0, 0]), -back], 1)
        eye = distance * back + [0, 0.42 * vertices[:, 1].max(), 0]
        seen = (whole - eye) @ axes
        if seen[:, 2].min() < 0.3:
            raise ValueError("part of the object is behind the camera")
        flat = seen[: len(vertices), :2] / seen[: len(vertices), 2:]
        zoom = rng.uniform(0.4, 0.85) * min(width / np.ptp(flat[:, 0]), height / np.ptp(flat[:, 1]))
        free = np.array(size) - zoom * np.ptp(flat, axis=0)
        middle = np.array([width / 2, height * rng.uniform(0.44, 0.5)]) + rng.uniform(-0.17, 0.17, 2) * free
        middle -= zoom * (flat.max(0) + flat.min(0)) / 2
        places = np.concatenate([FINE * (zoom * seen[:, :2] / seen[:, 2:] + middle), 1 / seen[:, 2:]], 1)
        fine = (FINE * width, FINE * height)
        shown, shares = raster(places, triangles, fine)

        # A point of the object and one of the table for each pixel that shows them.
        is_object = (shown >= 0) & (shown < len(faces))
        label = np.where(is_object, OBJECT, np.where(shown >= 0, TABLE, ROOM))
        shares_of = (np.float32(label == k).reshape(fine[1], fine[0]) for k in range(3))
        self.cover = np.stack([cv2.resize(fully, size, interpolation=cv2.INTER_AREA) for fully in shares_of], -1)
        hit = np.flatnonzero(shown >= 0)
        target = hit // fine[0] // FINE * width + hit % fine[0] // FINE
        _, first = np.unique(target * 3 + label[hit], return_index=True)
        hit, self.target = hit[first], target[first]
        self.of_table = ~is_object[hit]
        self.part_cover = self.cover.reshape(-1, 3)[self.target, label[hit]]
        weight = shares[hit] * places[triangles[shown[hit]], 2]
        weight /= weight.sum(1, keepdims=True)
        points = (whole[triangles[shown[hit]]] * weight[..., None]).sum(1)
        flat_normal, corner = normals(whole, triangles)
        normal = unit((corner[shown[hit]] * weight[..., None]).sum(1))
        towards = unit(eye - points)
        normal *= np.where((flat_normal[shown[hit]] * towards).sum(1, keepdims=True) < 0, -1, 1)
        self.points, self.normal, self.towards = (array.astype(np.float32) for array in (points, normal, towards))
        self.parts = np.where(self.of_table, -1, parts[np.minimum(shown[hit], len(faces) - 1)])
        self.ways = directions().astype(np.float32)
        above = self.points + np.float32(0.01) * self.normal
        self.lit = np.stack([visible(above, way, surface, disc, 160) for way in self.ways], 1)
        across, down = np.meshgrid(np.arange(width) + 0.5 - middle[0], np.arange(height) + 0.5 - middle[1])
        self.rays = unit(np.stack([across / zoom, down / zoom, np.ones_like(across)], -1) @ axes.T).astype(np.float32)

    def radiance(self, paint, sky):
        """The light of object and table in each frame, from the sky's by direction and frame."""
        many = sky.shape[1]
        upper = np.where(self.ways[:, 1] > 0, np.float32(1 / DIRECTIONS), 0)
        # A hidden direction above the table shows the object in its average light.
        bounced = paint.bounce * np.einsum("kfc,k->fc", sky, upper) * paint.albedo[~self.of_table].mean(0)
        facing = (self.normal * self.towards).sum(1)
        mirrored = 2 * facing[:, None] * self.normal - self.towards
        fresnel = paint.gloss + (1 - paint.gloss) * np.clip(1 - facing, 0, 1) ** 5 * paint.grazing
        light = sky.reshape(len(self.ways), -1)
        result = np.zeros((self.size[0] * self.size[1], many, 3), np.float32)
        for some in np.array_split(np.arange(len(self.points)), 8):
            diffuse = np.clip(self.normal[some] @ self.ways.T, 0, None) * np.float32(4 / DIRECTIONS)
            lobe = np.exp(np.log(np.clip(mirrored[some] @ self.ways.T, 1e-6, None)) * paint.power[some, None])
            lobe *= (fresnel[some] / np.maximum(lobe.sum(1), 1e-9))[:, None].astype(np.float32)
            free = self.lit[some].astype(np.float32)
            hidden = (1 - free) * (self.ways[:, 1] > 0)
            albedo, tint = (array[some, None].astype(np.float32) for array in (paint.albedo, paint.tint))
            of_paint = ((diffuse * free) @ light).reshape(-1, many, 3) + (diffuse * hidden).sum(1)[:, None, None] * bounced
            of_gloss = ((lobe * free) @ light).reshape(-1, many, 3) * tint + (lobe * hidden).sum(1)[:, None, None] * bounced
            shown = self.part_cover[some, None, None] * (albedo * of_paint + of_gloss)
            # A pixel may show both.
            for chosen in (self.of_table[some], ~self.of_table[some]):
                result[self.target[some][chosen]] += shown[chosen]
        return result


class Paint:
    """Albedo, gloss and tint of the gloss of a view's points."""

    def __init__(self, kind, view, rng):
        on_object, points = ~view.of_table, view.points
        many = view.parts.max() + 1
        self.kind = kind if kind in ("black", "white") else str(rng.choice(["mixed", "black", "white", "grey"], p=[0.42, 0.22, 0.22, 0.14]))
        self.bounce, self.grazing = rng.uniform(0.3, 1), rng.uniform(0.05, 0.3)
        table = rng.uniform(0.012, 0.07) * rng.uniform(0.9, 1.1, 3)
        self.albedo = table * np.where(points[:, 1:2] < -1e-4, rng.choice([0.7, 1, 1, 4]), 1)
        if rng.random() < 0.25:
            # Marks and dust on the table.
            waves = np.sin(points @ rng.normal(0, 9, 3))[:, None] > rng.uniform(0.3, 0.95)
            self.albedo = self.albedo * np.where(waves, rng.uniform(0.7, 1.5), 1)
        colours = self.colours(many, rng)[view.parts[on_object]]
        if rng.random() < 0.6:
            colours = self.patterned(colours, points[on_object], rng)
        colours = np.clip(colours, 0.008, 0.92)
        gloss, power, self.tint = rng.uniform(0, 0.04), rng.uniform(8, 80), np.ones_like(self.albedo)
        if rng.random() < 0.3:
            gloss, power = rng.uniform(0.04, 0.25), rng.uniform(20, 250)
        if rng.random() < 0.1:
            gloss, power = rng.uniform(0.4, 0.8), rng.uniform(10, 120)
            self.tint[on_object] = colours.mean(0) / max(colours.mean(), 1e-3)
            colours = 0.1 * colours
        self.albedo[on_object] = colours
        of_table = (rng.uniform(0, 0.02), rng.uniform(15, 60)) if rng.random() < 0.6 else (rng.uniform(0.02, 0.08), rng.uniform(60, 300))
        self.gloss = np.where(view.of_table, of_table[0], gloss)
        self.power = np.where(view.of_table, of_table[1], power).astype(np.float32)

    def colours(self, many, rng):
        if self.kind == "black":
            colours = rng.uniform(0.015, 0.07, (many, 1)) * rng.uniform(0.85, 1.15, (many, 3))
        elif self.kind == "white":
            colours = rng.uniform(0.6, 0.88, (many, 1)) * rng.uniform(0.94, 1, (many, 3))
        elif self.kind == "grey":
            colours = rng.uniform(0.05, 0.6, (many, 1)) * rng.uniform(0.93, 1.07, (many, 3))
        else:
            colours = rng.uniform(0.05, 0.8, (many, 3)) * rng.uniform(0.3, 1, (many, 1))
        if self.kind != "mixed" and rng.random() < 0.3:
            colours[rng.integers(many)] = rng.uniform(0.03, 0.8, 3)
        return colours

    def patterned(self, colours, points, rng):
        scale = rng.uniform(2, 14)
        waves = sum(np.sin(points @ rng.normal(0, scale * (1 + 0.7 * k), 3) + rng.uniform(0, 6)) for k in range(rng.integers(1, 4)))
        edge = (waves - rng.uniform(-0.3, 1.4)) / rng.choice([0.02, 0.3])
        share = 1 / (1 + np.exp(-np.clip(edge, -30, 30)))[:, None]
        other = rng.uniform(0.03, 0.8, 3) * (0.4 if self.kind == "black" else 1)
        if rng.random() < 0.6:
            other = colours * rng.uniform(0.4, 1)
        return colours * (1 - share) + other * share


def room_light(path, is_white, rng):
    """A panorama, mirrored, tinted or turned; or a white room with some of its light."""
    light = read_panorama(path)
    if rng.random() < 0.5:
        light = light[:, ::-1]
    if rng.random() < 0.3:
        light = light * rng.uniform(0.7, 1.3, 3).astype(np.float32)
    if is_white:
        # Walls of one brightness, and some of the panorama's light on the object.
        walls = rng.uniform(0.92, 1.08, 3).astype(np.float32)
        light = walls * (1 + rng.uniform(0, 0.3) * np.tanh(light - 1)) + np.where(light > 8, light * 0.5, 0)
    return np.roll(light, rng.integers(light.shape[1]), 1)


def pictures(view, kind, path, many, rng, paint_of=None):
    """The frames of a turn, one after another, and each row by row 8 bits of blue, green and red."""
    width, height = view.size
    paint = (paint_of or Paint)(kind, view, rng)
    is_white = kind == "white-room" or kind is None and rng.random() < 0.22
    light = room_light(path, is_white, rng)
    soft = np.tile(cv2.resize(light, (192, 96), interpolation=cv2.INTER_AREA), (1, 3, 1))
    soft = cv2.GaussianBlur(soft, (0, 0), 3)[:, 192:384]
    turns = 2 * np.pi * np.arange(many) / many * rng.choice([-1, 1])
    sky = np.stack([sampled(soft, view.ways, turn)[:, 0] for turn in turns], 1).astype(np.float32)
    still = view.radiance(paint, sky)
    covered = view.cover[..., OBJECT].ravel() > 0.99
    level = np.quantile((still[covered] if covered.any() else still).max(2), 0.97)
    if is_white:
        exposure = rng.uniform(0.9, 1.7)
    elif paint.kind == "white" and rng.random() < 0.5:
        exposure = rng.uniform(0.75, 1.5) / level
    else:
        bright = 0.25 if paint.kind == "black" else 0.8
        exposure = min(bright * rng.uniform(0.5, 1.5) / level, rng.uniform(0.6, 2.2) / np.quantile(light[100:412], 0.9))
    unsharp = cv2.GaussianBlur(light, (0, 0), rng.uniform(0.5, 3.5))
    camera = Camera(rng)
    for frame, turn in enumerate(turns):
        room = sampled(unsharp, view.rays, turn) * view.cover[..., ROOM, None]
        yield camera.picture(exposure * (room + still[:, frame].reshape(height, width, 3)), rng)


class Camera:
    """Noise, curve, white balance, flicker, shake and blur of a camera."""

    def __init__(self, rng):
        self.noise, self.curve, self.contrast = rng.uniform(0.1, 2.5) * 1e-3, rng.uniform(0.85, 1.2), rng.uniform(0, 0.35)
        self.flicker = rng.uniform(0, 0.04) if rng.random() < 0.4 else 0
        self.shake = rng.uniform(0, 0.7) if rng.random() < 0.3 else 0
        self.balance, self.blur = rng.uniform(0.9, 1.1, 3), rng.uniform(0.3, 0.9)

    def picture(self, light, rng):
        height, width = light.shape[:2]
        light = np.minimum(light * self.balance * (1 + self.flicker * rng.normal()), 4).astype(np.float32)
        light = cv2.GaussianBlur(light, (0, 0), self.blur)
        if self.shake:
            moved = np.float32([[1, 0, rng.normal() * self.shake], [0, 1, rng.normal() * self.shake]])
            light = cv2.warpAffine(light, moved, (width, height), borderMode=cv2.BORDER_REPLICATE)
        spread = np.sqrt(self.noise * np.maximum(light, 0) + 1e-6) * 0.35
        light = np.clip(light + spread * rng.standard_normal(light.shape, np.float32), 0, 1)
        coded = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055) ** self.curve
        coded = (1 - self.contrast) * coded + self.contrast * coded * coded * (3 - 2 * coded)
        return np.round(coded * 255).astype(np.uint8)


def draw_object(meshes, names, is_open, rng):
    """The name of an object, often with openings, and its mesh."""
    chance = rng.random()
    if chance < 0.33:
        what = str(rng.choice(BUILT))
        return what, built(what, rng)
    with_openings = [name for name in names if OPEN.search(name)] or names
    what = str(rng.choice(with_openings if is_open or chance < 0.55 else names))
    return what, meshes[what]()


def write_video(path, size, frames):
    command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "bgr24", "-s", f"{size[0]}x{size[1]}", "-r", "30", "-i", "-"]
    command += ["-c:v", "mjpeg", "-q:v", "3", "-pix_fmt", "yuvj422p", "-threads", "1", path]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as coder:
        for picture in frames:
            coder.stdin.write(picture.tobytes())
    if coder.returncode:
        raise SystemExit(f"ffmpeg could not write {path}")


def make(arguments):
    meshes = sources(arguments.meshes)
    names = [name for name in meshes if is_held_out(name)]
    rooms = panoramas(arguments.panoramas, held_out=True)
    number, last = arguments.seed, arguments.seed + arguments.count
    while number < last:
        rng = np.random.default_rng(number)
        kind = KINDS[number % len(KINDS)]
        what, mesh = draw_object(meshes, names, kind == "openings", rng)
        path = rooms[rng.integers(len(rooms))]
        number += 1
        try:
            view = View(mesh, SIZE, rng)
        except (ValueError, IndexError) as why:
            print(f"{number - 1:04}-{kind}-{what} is left out: {why}", flush=True)
            continue
        folder = arguments.folder / f"{number - 1:04}-{kind}-{what}"
        folder.mkdir(parents=True, exist_ok=True)
        mask = cv2.GaussianBlur(view.cover[..., OBJECT], (0, 0), 0.6)
        cv2.imwrite(str(folder / "mask_gt.png"), np.round(mask * 255).astype(np.uint8))
        write_video(folder / "video.mkv", SIZE, pictures(view, kind, path, FRAMES, rng))
        print(folder.name, path.stem, flush=True)


def overlap(mask, truth):
    return (mask & truth).sum() / max((mask | truth).sum(), 1)


def read_mask(path):
    return cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) >= 128


def planted(truth, rng):
    """Masks without a fault, and masks with one, by name."""
    area, disc = truth.sum(), lambda size: cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    as_bytes = truth.astype(np.uint8)
    right = {"exact": truth, "narrow": cv2.erode(as_bytes, disc(3)) > 0, "wide": cv2.dilate(as_bytes, disc(3)) > 0}
    wrong = {}
    _, holes, figures, _ = cv2.connectedComponentsWithStats((~truth).astype(np.uint8), connectivity=4)
    inside = [hole for hole in range(1, len(figures)) if hole != holes[0, 0]]
    hole = max(inside, key=lambda hole: figures[hole, cv2.CC_STAT_AREA], default=0)
    if hole and cv2.morphologyEx((holes == hole).astype(np.uint8), cv2.MORPH_OPEN, disc(5)).sum() >= 0.003 * area:
        wrong["opening"] = truth | (holes == hole)
    # A whisker of two rows where the object reaches furthest to the left, or else to the right.
    rows, columns = np.nonzero(truth)
    for y, end, reach in ((rows[columns.argmin()], columns.min(), -36), (rows[columns.argmax()], columns.max(), 36)):
        if 50 < end < SIZE[0] - 50:
            wrong["whisker"] = truth.copy()
            wrong["whisker"][y : y + 2, min(end, end + reach) : max(end, end + reach)] = True
            break
    # A round piece of 1 to 3 % of the object beside its outline: room, or table.
    for name, half in (("piece above", rows < np.quantile(rows, 0.5)), ("piece below", rows > np.quantile(rows, 0.7))):
        radius = int(np.ceil(1.3 * (rng.uniform(0.01, 0.02) * area / 2.2) ** 0.5))
        outline = (as_bytes - cv2.erode(as_bytes, disc(3)))[rows, columns] > 0
        for at in rng.permutation(np.flatnonzero(outline & half))[:50]:
            blob = cv2.circle(np.zeros_like(as_bytes), (int(columns[at]), int(rows[at])), radius, 1, -1) > 0
            if 0.01 * area <= (blob & ~truth).sum() <= 0.03 * area:
                wrong[name] = truth | blob
                break
    return right, wrong


def verdict(program, session, mask, path):
    cv2.imwrite(path, mask.astype(np.uint8) * 255)
    answer = subprocess.run([program, "check", session, "--mask", path, "--json"], capture_output=True, text=True).stdout
    found = re.search(r'"verdict": ?"(\w+)"', answer)
    return found.group(1) if found else "failed"


def judge(program, session, check):
    """A turn's name, the overlap of its mask, and the verdicts on other masks."""
    truth = read_mask(session / "mask_gt.png")
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/mask.png"
        made = subprocess.run([program, session, "--auto", "--force", "-o", path], capture_output=True).returncode == 0
        own = overlap(read_mask(path), truth) if made else 0.0
        masks = planted(truth, np.random.default_rng(int(session.name.split("-")[0]))) if check else ({}, {})
        verdicts = [{what: verdict(program, session, mask, path) for what, mask in some.items()} for some in masks]
    print(f"{session.name}: {own:.3f}", *(f"{what} {says}" for some in verdicts for what, says in some.items()), sep=", ", flush=True)
    return session.name, own, verdicts


def mean(values):
    error = np.std(values, ddof=1) / len(values) ** 0.5 if len(values) > 1 else 0
    return f"{np.mean(values):.3f} ± {error:.3f}"


def measure(arguments):
    sessions = sorted(path.parent for path in arguments.folder.glob("*/mask_gt.png"))
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        judged = list(pool.map(lambda session: judge(arguments.program, session, arguments.check), sessions))
    print("| turns | overlap | least | 0.97 or more |\n| --- | --- | --- | --- |")
    for kind in ["", *KINDS]:
        some = [own for name, own, _ in judged if re.fullmatch(rf"\d+-{kind}(-(?!room-).*)?" if kind else ".*", name)]
        if some:
            print(f"| {len(some)} {kind or 'all'} | {mean(some)} | {min(some):.3f} | {sum(value >= 0.97 for value in some)} |")
    for which, title in enumerate(("right masks", "faults")) if arguments.check else ():
        verdicts = [turn[which] for _, _, turn in judged]
        for what in ["", *dict.fromkeys(what for turn in verdicts for what in turn)]:
            turns = [[says for name, says in turn.items() if what in name] for turn in verdicts]
            turns = [turn for turn in turns if turn]
            counts = {says: sum(turn.count(says) for turn in turns) for says in ("wrong", "fits", "unknown")}
            # The masks of a turn are not independent: the standard error is that of the turns.
            print(f"{title}, {what or 'all'}: {counts}; wrong by turns {mean([np.mean([says == 'wrong' for says in turn]) for turn in turns])}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(required=True)
    making = verbs.add_parser("make")
    for name in ("meshes", "panoramas", "folder"):
        making.add_argument(name, type=pathlib.Path)
    making.add_argument("--count", type=int, default=20)
    making.add_argument("--seed", type=int, default=1000)
    making.set_defaults(run=make)
    measuring = verbs.add_parser("measure")
    measuring.add_argument("program", type=pathlib.Path)
    measuring.add_argument("folder", type=pathlib.Path)
    measuring.add_argument("--check", action="store_true", help="measure the check, too")
    measuring.set_defaults(run=measure)
    arguments = parser.parse_args()
    arguments.run(arguments)


if __name__ == "__main__":
    main()
