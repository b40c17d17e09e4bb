"""The network that tells object, table and room in a turn (src/grabcut/src/turn/network): its data and its training.

    python turn_network.py make MESHES PANORAMAS DATA
    python turn_network.py train DATA --minutes 84 --learning-rate 2e-3 -o src/grabcut/src/turn/network/weights.safetensors

With the packages of requirements-network.txt. Half of the turns are flat drawings: shapes that no mesh has, rooms of
stripes and spots, tables that fill the lower border, or none. The others are those of turns.py, of other objects and panoramas
than its `make` takes. DATA/train and DATA/validation get one file a turn: the observations and the shares of room, table
and object, as 16-bit numbers.
"""

import math

import cv2
import numpy as np
import torch
from torch.nn import functional

import efficientnet
import turns
import unet

SIZES = [(320, 240), (320, 240), (320, 180)]
LOW = 192
FRAMES = [32, 32, 32, 16, 12, 8]
# Turns of each view, and drawings beside them.
SHOTS, DRAWINGS = 3, 3
# As src/grabcut/src/turn/network/observations.rs describes them.
PLANES, EDGE, DARK, WHITE = 18, 0.05, 0.02, 250
MIRRORED_STEPS, WAVES = (14, 16), ((1, 7), (2, 9))
# Object, table, room.
CLASSES = 3
BATCH = 8


def observed(frames):
    """The planes, but for column and row, of frames of blue, green and red."""
    many = len(frames)
    colour = frames.astype(np.float32)[..., ::-1] / 255
    luma = colour @ np.array([0.299, 0.587, 0.114], np.float32)
    logs = np.log(np.stack([cv2.blur(frame, (3, 3), borderType=cv2.BORDER_REPLICATE) for frame in luma]) + DARK)
    spread = lambda deviation, scale, most: np.log1p(scale * deviation) / most
    apart = [colour[..., channel] - colour[..., 1] for channel in (0, 2)]
    planes = [*colour.mean(0).transpose(2, 0, 1), luma.min(0), luma.max(0), spread(luma.std(0), 100, 4)]
    planes.append(spread(np.sqrt(apart[0].var(0) + apart[1].var(0)), 100, 4))
    angle = 2 * np.pi * np.arange(many) / many
    rest = logs - logs.mean(0)
    waves = [2 / many * np.tensordot(of(order * angle).astype(np.float32), rest, 1) for order in (1, 2) for of in (np.cos, np.sin)]
    variance = (rest**2).mean(0)
    left = np.maximum(variance - sum(wave * wave for wave in waves) / 2, 0)
    planes += [np.clip(wave, -2, 2) for wave in waves]
    planes += [spread(np.sqrt(left), 100, 5), (left + 1e-5) / (variance + 1e-5), (frames.min(-1) >= WHITE).mean(0)]
    steps = np.zeros((2, *logs.shape), np.float32)
    steps[0, :, :, :-1], steps[1, :, :-1] = np.diff(logs, axis=2), np.diff(logs, axis=1)
    planes += [np.minimum((step / EDGE) ** 2, 1).mean(0) for step in steps]
    planes += [spread(step.std(0), 50, 3) for step in steps]
    return np.stack(planes)


def compressed(picture, quality):
    return cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_COLOR)


def save(path, frames, cover, rng):
    """Saves what is seen in some of the frames, in a height that the network can halve."""
    quality, many = int(rng.integers(70, 97)), rng.choice(FRAMES)
    chosen = np.round(np.arange(many) * len(frames) / many).astype(int) % len(frames)
    planes = observed(np.stack([compressed(frames[at], quality) for at in chosen]))
    height, width = planes.shape[1:]
    both = np.zeros((PLANES + 3, 256 if height > LOW else LOW, width), np.float16)
    both[:, :height] = np.concatenate([planes, np.clip(cover, 0, 1).transpose(2, 0, 1)])
    np.save(path, both)


def drawn_shape(size, rng):
    """The coverage of a few ellipses, boxes, rings, polygons and bars, with holes, and their middle and radius."""
    width, height = size
    fine = 4
    canvas = np.zeros((height * fine, width * fine), np.uint8)
    middle, radius = np.array([width * rng.uniform(0.4, 0.6), height * rng.uniform(0.42, 0.6)]), height * rng.uniform(0.18, 0.4)
    whole = lambda place: tuple(int(value * fine) for value in place)
    for number in range(rng.integers(1, 6)):
        at = middle if number == 0 else middle + rng.uniform(-1, 1, 2) * radius * [1, 0.9]
        r = radius * (rng.uniform(0.5, 1) if number == 0 else rng.uniform(0.15, 0.6))
        kind = rng.choice(["ellipse", "box", "ring", "polygon", "bar"])
        if kind == "ellipse":
            cv2.ellipse(canvas, whole(at), whole((r * rng.uniform(0.5, 1), r)), rng.uniform(0, 180), 0, 360, 255, -1)
        elif kind == "box":
            sides = (r * fine * rng.uniform(0.3, 1.6), r * fine * rng.uniform(0.8, 1.6))
            corners = cv2.boxPoints((whole(at), sides, float(rng.choice([0, rng.uniform(0, 90)]))))
            cv2.fillPoly(canvas, [corners.astype(np.int32)], 255)
        elif kind == "ring" and number > 0:
            thick = int(max(2, r * rng.uniform(0.12, 0.4)) * fine)
            cv2.ellipse(canvas, whole(at), whole((r, r * rng.uniform(0.6, 1.1))), 0, 0, 360, 255, thick)
        elif kind == "polygon":
            angle = np.sort(rng.uniform(0, 6.28, rng.integers(3, 7)))
            corners = at + r * rng.uniform(0.5, 1.1, (len(angle), 1)) * np.stack([np.cos(angle), np.sin(angle)], 1)
            cv2.fillPoly(canvas, [(corners * fine).astype(np.int32)], 255)
        else:
            angle = rng.uniform(0, 6.28)
            end = at + 1.3 * r * np.array([np.cos(angle), np.sin(angle)])
            cv2.line(canvas, whole(middle), whole(end), 255, int(max(1.5, rng.uniform(0.03, 0.25) * r) * fine))
    for _ in range(rng.choice([0, 1, 1, 2])):
        at, r = middle + rng.uniform(-0.5, 0.5, 2) * radius, radius * rng.uniform(0.1, 0.45)
        cv2.ellipse(canvas, whole(at), whole((r, r * rng.uniform(0.5, 1.2))), 0, 0, 360, 0, -1)
    cover = cv2.resize(canvas.astype(np.float32) / 255, size, interpolation=cv2.INTER_AREA)
    _, labels, figures, _ = cv2.connectedComponentsWithStats((cover > 0.5).astype(np.uint8), connectivity=8)
    areas = figures[1:, cv2.CC_STAT_AREA]
    if len(areas) == 0:
        raise ValueError("the drawing is empty")
    kept = np.isin(labels, 1 + np.flatnonzero(areas >= 0.3 * areas.max())).astype(np.uint8)
    return cover * cv2.dilate(kept, np.ones((3, 3), np.uint8)), middle, radius


def spots(size, rng, low, high):
    """Noise of three scales, in three channels."""
    total = np.zeros((size[1], size[0], 3), np.float32)
    for scale in np.exp(rng.uniform(np.log(low), np.log(high), 3)):
        cells = rng.normal(0, 1, (int(size[1] / scale) + 2, int(size[0] / scale) + 2, 3)).astype(np.float32)
        if rng.random() < 0.7:
            cells = 0.4 * cells + 0.8 * cells[..., :1]
        how = rng.choice([cv2.INTER_CUBIC, cv2.INTER_LINEAR, cv2.INTER_NEAREST])
        total += cv2.resize(cells, size, interpolation=how) * rng.uniform(0.2, 0.8)
    return total


def drawn_room(size, rooms, rng):
    """A strip of light that closes in itself and passes behind the object in a turn."""
    width, height = size
    around = int(width / rng.uniform(0.1, 0.3))
    kind = rng.choice(["panorama", "spots", "white", "stripes"], p=[0.5, 0.25, 0.15, 0.1])
    if kind == "panorama":
        light = turns.read_panorama(rooms[rng.integers(len(rooms))])
        row, half = int(light.shape[0] * rng.uniform(0.3, 0.55)), max(4, int(light.shape[1] * height / around / 2))
        strip = cv2.resize(light[max(0, row - half) : row + half], (around, height), interpolation=cv2.INTER_LINEAR)
        strip = cv2.GaussianBlur(strip, (0, 0), rng.uniform(0.5, 8))
        strip *= rng.uniform(0.1, 0.8) / max(strip.mean(), 1e-3)
    elif kind == "spots":
        strip = np.exp(spots((around, height), rng, 6, 150) * rng.uniform(0.5, 1.5) + rng.uniform(-2.5, -0.3))
    elif kind == "stripes":
        colours = rng.uniform(0.02, 0.9, (1, max(2, around // rng.integers(8, 60)), 3)).astype(np.float32)
        strip = np.repeat(cv2.resize(colours, (around, 1), interpolation=cv2.INTER_NEAREST), height, 0)
    else:
        strip = rng.uniform(0.9, 1.5) * (1 + 0.1 * rng.uniform(0, 1) * spots((around, height), rng, 40, 200))
    return np.concatenate([strip, strip[:, : width + 2]], 1).astype(np.float32), around


def drawn_turn(size, rooms, many, rng):
    """The frames of a turn of a flat drawing, and the shares of room, table and object."""
    width, height = size
    cover, middle, radius = drawn_shape(size, rng)
    down, across = np.mgrid[0:height, 0:width].astype(np.float32)
    inside = (cover > 0.5).astype(np.uint8)
    relief = np.sqrt(cv2.distanceTransform(inside, cv2.DIST_L2, 5)) * rng.uniform(0.5, 3)
    relief = cv2.GaussianBlur(relief, (0, 0), rng.uniform(1, 4))
    bumps = cv2.GaussianBlur(rng.normal(0, 1, (height, width)).astype(np.float32), (0, 0), rng.uniform(3, 15))
    slope_down, slope_across = np.gradient(relief + bumps * rng.uniform(0, 30))
    is_flat = rng.random() < 0.12
    if is_flat:
        slope_across, slope_down = np.zeros_like(relief), np.zeros_like(relief)
    normal = turns.unit(np.stack([-slope_across, slope_down, np.full_like(relief, rng.uniform(0.5, 1.5))], -1))
    kinds = [rng.uniform(0.05, 0.8, 3), np.full(3, rng.uniform(0.012, 0.05)), np.full(3, rng.uniform(0.6, 0.9)), np.full(3, rng.uniform(0.05, 0.6))]
    base = kinds[rng.choice(4, p=[0.45, 0.2, 0.15, 0.2])]
    paint = np.broadcast_to(base, (height, width, 3))
    if rng.random() < 0.6:
        edge = (spots(size, rng, 4, 60)[..., :1] - rng.uniform(-0.5, 0.8)) / rng.choice([0.02, 0.3])
        share = 1 / (1 + np.exp(-np.clip(edge, -30, 30)))
        paint = paint * (1 - share) + share * (base * rng.uniform(0.3, 1) if rng.random() < 0.5 else rng.uniform(0.02, 0.8, 3))
    round_spot = lambda x, y, a, b: ((across - x) / a) ** 2 + ((down - y) / b) ** 2
    for _ in range(rng.choice([0, 0, 1, 2])):
        at, sides = middle + rng.uniform(-0.4, 0.4, 2) * radius, radius * rng.uniform(0.1, 0.45, 2)
        paint = np.where((round_spot(*at, *sides) < 1)[..., None], rng.uniform(0.01, 0.06), paint)
    unshaded = np.ones_like(relief)
    for _ in range(rng.choice([0, 0, 1, 2])):
        at, sides = middle + rng.uniform(-0.5, 0.5, 2) * radius, radius * rng.uniform(0.1, 0.4, 2)
        unshaded *= 1 - rng.uniform(0.3, 0.95) * np.exp(-round_spot(*at, *sides) ** rng.uniform(1, 4))
    chance, foot = rng.random(), middle[1] + 0.9 * radius
    if chance < 0.2:
        table = np.zeros_like(relief)
    elif chance < 0.55:
        line = middle[1] + radius * rng.uniform(0.2, 1.05) + rng.uniform(-0.05, 0.05) * (across - width / 2)
        table = np.clip(down - line + 0.5, 0, 1)
    else:
        a, b, top = radius * rng.uniform(1.1, 2.8), radius * rng.uniform(0.25, 1), middle[1] + radius * rng.uniform(0.6, 1)
        disc = lambda y: np.clip((1 - np.sqrt(round_spot(middle[0], y, a, b))) * min(a, b) + 0.5, 0, 1)
        table = np.maximum(disc(top), disc(top + radius * rng.uniform(0, 0.2)))
    table_paint = rng.uniform(0.01, 0.07) * rng.uniform(0.9, 1.1, 3)
    lamps = [(rng.uniform(0, 6.28), rng.uniform(0, 0.9), rng.uniform(0.3, 1.5)) for _ in range(rng.integers(1, 4))]
    even, contact, exposure = rng.uniform(0.1, 0.5), rng.uniform(0.2, 0.9), rng.uniform(0.5, 1.5)
    gloss, power = (rng.uniform(0, 0.3) if rng.random() < 0.4 else 0), rng.uniform(8, 80)
    strip, around = drawn_room(size, rooms, rng)
    camera = turns.Camera(rng)
    of_object, of_table = cover[..., None], (table * (1 - cover))[..., None]
    frames = []
    for turn in 2 * np.pi * np.arange(many) / many * rng.choice([-1, 1]):
        light, on_table, shine = even * (1 + 0.3 * normal[..., 1]), 1.3 * even, 0
        shadow = 1 - contact * np.exp(-round_spot(middle[0], foot, 1.1 * radius, 0.35 * radius))
        for angle, high, strength in lamps:
            to = np.array([np.sin(turn + angle) * np.cos(high), np.sin(high), np.cos(turn + angle) * np.cos(high)])
            light = light + strength * np.maximum(normal @ to, 0)
            on_table += strength * max(to[1], 0)
            cast = round_spot(middle[0] - 1.2 * radius * to[0], foot - 0.3 * radius * to[2], 0.9 * radius, 0.3 * radius)
            shadow = shadow * (1 - 0.5 * strength / (strength + 1) * np.exp(-cast))
            shine = shine + gloss * strength * np.maximum(normal @ turns.unit(to + [0, 0, 1]), 0) ** power
        place = turn / (2 * np.pi) * around % around
        room = strip[:, int(place) : int(place) + width] * (1 - place % 1) + strip[:, int(place) + 1 : int(place) + 1 + width] * (place % 1)
        if is_flat:
            flicker = rng.uniform(0.6, 1.2)
            light, on_table = np.full_like(relief, flicker), flicker
        shown = (paint * light[..., None] + np.asarray(shine)[..., None]) * unshaded[..., None]
        picture = room * (1 - of_object - of_table) + table_paint * on_table * shadow[..., None] * of_table + shown * of_object
        frames.append(camera.picture(exposure * picture, rng))
    return frames, np.concatenate([1 - of_object - of_table, of_table, of_object], -1)


def make(arguments):
    meshes = turns.sources(arguments.meshes)
    for part, held_out, views in (("validation", True, arguments.views // 8), ("train", False, arguments.views)):
        folder = arguments.data / part
        folder.mkdir(parents=True, exist_ok=True)
        names = [name for name in meshes if turns.is_held_out(name) == held_out]
        rooms = turns.panoramas(arguments.panoramas, held_out)
        for number in range(arguments.seed, arguments.seed + views):
            rng = np.random.default_rng([number, held_out])
            what, mesh = turns.draw_object(meshes, names, False, rng)
            try:
                view = turns.View(mesh, SIZES[rng.integers(len(SIZES))], rng)
            except (ValueError, IndexError) as why:
                print(f"{what} is left out: {why}", flush=True)
                continue
            for shot in range(SHOTS):
                frames = list(turns.pictures(view, None, rooms[rng.integers(len(rooms))], max(FRAMES), rng))
                save(folder / f"{number:05}-{shot}.npy", frames, view.cover, rng)
        for number in range(arguments.seed, arguments.seed + (0 if held_out else DRAWINGS * arguments.views)):
            rng = np.random.default_rng([number, 77])
            try:
                frames, cover = drawn_turn(SIZES[rng.integers(len(SIZES))], rooms, max(FRAMES), rng)
            except ValueError:
                continue
            save(folder / f"{number:05}-drawing.npy", frames, cover, rng)


def varied(turn, rng):
    """A turn mirrored, begun elsewhere, run backwards, with other colours, brightness and scales of the observations."""
    turn = turn.copy()
    if rng.random() < 0.5:
        turn = turn[:, :, ::-1].copy()
        for plane in MIRRORED_STEPS:
            turn[plane] = np.roll(turn[plane], -1, 1)
    begin = rng.uniform(0, 2 * np.pi)
    for order, plane in WAVES:
        cosine, sine = math.cos(order * begin), math.sin(order * begin)
        of_cosine, of_sine = turn[plane].astype(np.float32), turn[plane + 1].astype(np.float32)
        turn[plane], turn[plane + 1] = cosine * of_cosine - sine * of_sine, sine * of_cosine + cosine * of_sine
    if rng.random() < 0.5:
        turn[[plane + 1 for _, plane in WAVES]] *= -1
    if rng.random() < 0.3:
        turn[:3] = turn[rng.permutation(3)]
    turn[:5] *= np.float16(rng.uniform(0.85, 1.15))
    if rng.random() < 0.3:
        turn[:PLANES] *= 1 + rng.normal(0, 0.03, (PLANES, 1, 1)).astype(np.float16)
    return turn


def apart(turns_):
    """Observations, and the shares of object, table and room."""
    both = torch.from_numpy(turns_).float()
    return both[:, :PLANES].contiguous(memory_format=torch.channels_last), both[:, PLANES:].flip(1)


def loss(logits, shares):
    entropy = -(shares * functional.log_softmax(logits, 1)).sum(1, keepdim=True)
    return unet.loss(logits[:, :1] - logits[:, 1:].logsumexp(1, keepdim=True), entropy, shares)


@torch.no_grad()
def overlaps(network, paths):
    network.eval()
    found = []
    for path in paths:
        seen, shares = apart(np.load(path)[None])
        with torch.autocast("cpu", torch.bfloat16):
            logits = network(seen).float()
        is_object = (logits[:, 0] > logits[:, 1:].logsumexp(1)) & (shares.sum(1) > 0.5)
        truth = shares[:, 0] > 0.5
        found.append(((is_object & truth).sum() / (is_object | truth).sum().clamp(min=1)).item())
    return np.array(found)


def batches(folder, rng):
    """Batches of turns of one height, for ever."""
    paths = {LOW: [], 256: []}
    for path in sorted(folder.glob("*.npy")):
        paths[np.load(path, mmap_mode="r").shape[1]].append(path)
    if min(map(len, paths.values())) < BATCH:
        raise SystemExit(f"{folder} has too few turns: make at least 40 views")
    share = len(paths[LOW]) / sum(map(len, paths.values()))
    orders = {height: [] for height in paths}
    while True:
        height = LOW if rng.random() < share else 256
        if len(orders[height]) < BATCH:
            orders[height] = [paths[height][at] for at in rng.permutation(len(paths[height]))]
        seen, shares = apart(np.stack([varied(np.load(orders[height].pop()), rng) for _ in range(BATCH)]))
        # Some upright, as frames of a phone are.
        if rng.random() < 0.12:
            wide = height * 3 // 4 // 32 * 32
            begin = int(rng.integers(0, seen.shape[3] - wide + 1) * 0.5 + (seen.shape[3] - wide) * 0.25)
            seen, shares = (planes[..., begin : begin + wide] for planes in (seen, shares))
        # Some smaller, as small frames are.
        by = rng.choice([1, 2, 4], p=[0.78, 0.14, 0.08])
        if by > 1:
            low = LOW // by // 32 * 32 * by
            wide = seen.shape[3] // by // 32 * 32 * by
            seen, shares = (functional.avg_pool2d(planes[:, :, :low, :wide], int(by)) for planes in (seen, shares))
        yield seen, shares


def network_of():
    return unet.Network(PLANES, CLASSES, efficientnet.encoder(PLANES + 2), efficientnet.SKIPS)


def train(arguments):
    validation = sorted((arguments.data / "validation").glob("*.npy"))
    overlap = lambda network: turns.mean(overlaps(network, validation))
    torch.manual_seed(0)
    network, mean = (network_of() for _ in range(2))
    efficientnet.take(network.encoder)
    unet.fit(network, mean, batches(arguments.data / "train", np.random.default_rng(0)), loss, overlap, arguments)


def parity(arguments):
    """Logits of a pattern that moves, for the test of src/grabcut/src/turn/network/mod.rs."""
    network = unet.read(network_of(), arguments.weights)
    down, across = np.mgrid[0:72, 0:96]
    level = lambda turn, channel: (3 * across + down * (5 + channel) + turn * (across // 8 + 1) * (11 + channel) + across * down // 7) % 256
    frames = np.stack([np.stack([level(turn, channel) for channel in (2, 1, 0)], -1) for turn in range(8)]).astype(np.uint8)
    planes = np.zeros((1, PLANES, 96, 96), np.float32)
    planes[0, :, :72] = observed(frames)
    with torch.no_grad():
        logits = network(torch.from_numpy(planes))[0].numpy()
    for what, found in (("plane", planes[0]), ("logit", logits)):
        for number, plane in enumerate(found):
            print(what, number, *(f"{plane[y, x]:.5f}" for x, y in ((7, 5), (50, 33), (95, 71))))


if __name__ == "__main__":
    unet.command_line(__doc__, make, train, parity, views=760)
