"""For your own networks in PyTorch: the render layers and the low-rank loss as plain tensor code with gradients, and data
sets for torch.utils.data.

    image = relit.torch.render(normals, albedo, light, specular=(reflectance, smoothness))
    loss = relit.torch.low_rank_loss(reflectances.flatten(1))

    data = relit.torch.TurnBatches("dataset", seed=1)
    loader = torch.utils.data.DataLoader(data, batch_size=None, num_workers=2)
    for images, masks, state in loader:
        ...
        data.load_state_dict(state)        # in a new process, before the loader is made

Maps are batch x channels x rows x columns, or channels x rows x columns; light is batch x n x 3, or n x 3 for all. All is
linear, in the axes of `relit.render`: x right, y up, z to the viewer.
"""

from __future__ import annotations

import functools
import math

import numpy
import torch.utils.data

from . import Cursor
from . import open as _open

#: What the paper's released code adds to every shading.
RELEASED_AMBIENT = 0.1
#: How many bands the lobe layer has beyond those of the light.
_MORE_BANDS = 8
#: How often the Gram matrix is squared: what is left of the second eigenvalue is its ratio to the first, to the power 256.
_SQUARINGS = 8
_TINY = 1e-20


def harmonics(order, directions):
    """The real spherical harmonics up to `order` of directions (... x 3 x rows x columns): ... x (order + 1)^2 x rows x
    columns, (l, m) at l (l + 1) + m, orthonormal, without the Condon-Shortley phase, pole at z."""
    x, y, z = directions.unbind(-3)
    values = [None] * (order + 1) ** 2
    diagonal, cos, sin = math.sqrt(1 / (4 * math.pi)), torch.ones_like(x), torch.zeros_like(x)
    for m in range(order + 1):
        if m:
            diagonal *= math.sqrt(1 + 0.5 / m)
            root = math.sqrt(2) if m == 1 else 1.0
            cos, sin = root * (cos * x - sin * y), root * (cos * y + sin * x)
        before, now = torch.zeros_like(z), torch.full_like(z, diagonal)
        for l in range(m, order + 1):
            values[l * (l + 1) + m] = now * cos
            values[l * (l + 1) - m] = now * sin if m else now * cos
            a, b = _legendre_step(l + 1, m)
            before, now = now, a * z * now - b * before
    return torch.stack(values, -3)


def _legendre_step(l, m):
    def root(l):
        return math.sqrt((4 * l * l - 1) / (l * l - m * m))

    return root(l), root(l) / root(l - 1) if l - 1 > m else 0.0


def _order(light):
    order = math.isqrt(light.shape[-2]) - 1
    if light.shape[-1] != 3 or (order + 1) ** 2 != light.shape[-2]:
        raise ValueError(f"the light has the shape {tuple(light.shape)}: give (order + 1)^2 coefficients x 3")
    return order


def _surface(normals):
    return (normals != 0).any(-3, keepdim=True)


def shading(normals, light, form="irradiance"):
    """The irradiance of unit normals (0 outside the object), from 0: the diffuse layer. `form` "released" is that of
    the paper's released code: the first nine coefficients, |L00|, and 0.1 more."""
    order = _order(light)
    if form == "released":
        order = min(order, 2)
        light = torch.cat([light[..., :1, :].abs(), light[..., 1 : (order + 1) ** 2, :]], -2)
    elif form != "irradiance":
        raise ValueError(f"form is {form!r}: give 'irradiance' or 'released'")
    factors = [_cosine_lobe(l) for l in range(order + 1) for _ in range(2 * l + 1)]
    weighted = light * light.new_tensor(factors)[:, None]
    ambient = RELEASED_AMBIENT if form == "released" else 0.0
    irradiance = torch.einsum("...brk,...bc->...crk", harmonics(order, normals), weighted)
    return (irradiance.clamp_min(0) + ambient) * _surface(normals)


def _cosine_lobe(l):
    """The coefficient of max(0, cos) of a band."""
    if l < 2:
        return (math.pi, 2 * math.pi / 3)[l]
    if l % 2:
        return 0.0
    sign = 1 if l % 4 == 2 else -1
    return sign * 2 * math.pi / ((l + 2) * (l - 1)) * math.comb(l, l // 2) / 2**l


def highlight(normals, reflectance, smoothness, light, form="lobe"):
    """The specular layer: reflectance (... x 3 x rows x columns, or what broadcasts) times the integral of radiance times the
    Blinn-Phong lobe; smoothness (... x 1 x rows x columns, or a number) is its exponent. `form` "power" is the formula of
    the paper, for the first nine coefficients."""
    smoothness = torch.as_tensor(smoothness, dtype=normals.dtype, device=normals.device).clamp_min(0.01)
    smoothness = smoothness.expand(*normals.shape[:-3], 1, *normals.shape[-2:])
    if form == "lobe":
        received = _lobe(normals, smoothness, light)
    elif form == "power":
        received = _power(normals, smoothness, light)
    else:
        raise ValueError(f"form is {form!r}: give 'lobe' or 'power'")
    return reflectance * received * _surface(normals)


def _lobe(normals, smoothness, light):
    """The light as a function of the half vector, convolved with the lobe (Funk-Hecke)."""
    order = _order(light)
    high = min(order + _MORE_BANDS, 64)
    half = light.new_tensor(_to_half_vectors(order, high)) @ light
    zonal = [2 * math.pi / (smoothness + 1), 2 * math.pi / (smoothness + 2)]
    for l in range(2, high + 1):
        zonal.append(zonal[l - 2] * (smoothness + 2 - l) / (smoothness + l + 1))
    bands = torch.cat([zonal[l] for l in range(high + 1) for _ in range(2 * l + 1)], -3)
    return torch.einsum("...brk,...bc->...crk", harmonics(high, normals) * bands, half).clamp_min(0)


@functools.lru_cache(maxsize=None)
def _to_half_vectors(order, high):
    """From the coefficients of light L to those of 4 cos(t) L(2t, p), at half vectors (t, p) on the viewer's side: by quadrature,
    exact to the last digits."""
    nodes, weights = numpy.polynomial.legendre.leggauss(12 + math.ceil((2 * order + high + 2) * math.pi / 4))
    polar = torch.from_numpy((nodes + 1) * math.pi / 4)[:, None]
    count = order + high + 1
    azimuth = torch.arange(count, dtype=torch.float64)[None] * (2 * math.pi / count)
    area = torch.from_numpy(weights)[:, None] * (math.pi / 4) * polar.sin() * (2 * math.pi / count)

    def directions(polar):
        flat = polar.sin()
        return torch.stack(torch.broadcast_tensors(flat * azimuth.cos(), flat * azimuth.sin(), polar.cos()))

    to, of = harmonics(high, directions(polar)), harmonics(order, directions(2 * polar))
    return torch.einsum("irk,jrk->ij", to * (4 * polar.cos() * area), of).numpy()


def _power(normals, smoothness, light):
    """The paper's sum of powers, where a negative base keeps its sign."""
    x, y, z = normals.unbind(-3)
    lobe = (math.pi, 2 * math.pi / 3, math.pi / 4)
    constants = (0.28209479177387814, 0.4886025119029199, 1.0925484305920792, 0.31539156525252005, 0.5462742152960396)
    c0, c1, c2, c3, c4 = (c * lobe[band] for c, band in zip(constants, (0, 1, 2, 2, 2)))
    square = z * z
    odd = 4 * square * z - 2 * z
    terms = torch.stack(
        [
            torch.full_like(x, c0),
            2 * c1 * y * z,
            c1 * (2 * square - 1),
            2 * c1 * x * z,
            4 * c2 * x * y * square,
            c2 * y * odd,
            c3 * (3 * (4 * square * square - 4 * square + 1) - 1),
            c2 * x * odd,
            4 * c4 * (x * x - y * y) * square,
        ],
        -3,
    )
    powers = terms.sign() * terms.abs().clamp_min(_TINY) ** smoothness
    return torch.einsum("...brk,...bc->...crk", powers, light[..., :9, :])


def render(normals, albedo, light, specular=None, diffuse_form="irradiance", specular_form="lobe"):
    """albedo x shading + highlight, in the paper's units: a white diffuse surface under even light of radiance 1 is pi.
    `specular`: reflectance and smoothness."""
    image = albedo * shading(normals, light, diffuse_form)
    return image if specular is None else image + highlight(normals, *specular, light, specular_form)


def low_rank_loss(rows):
    """The paper's low-rank loss of N reflectances of one object (N x d, or groups x N x d): the squared distance to the best
    approximation of rank one, which counts as a constant; the mean over groups."""
    rows = rows if rows.dim() == 3 else rows[None]
    with torch.no_grad():
        vector = _first_singular_vector(rows)
        nearest = vector @ (vector.transpose(1, 2) @ rows)
    return (rows - nearest).square().sum((1, 2)).mean()


def _first_singular_vector(rows):
    """groups x N x 1, by squaring the Gram matrix."""
    power = rows @ rows.transpose(1, 2)
    for squared in range(_SQUARINGS + 1):
        trace = power.diagonal(dim1=1, dim2=2).sum(1).clamp_min(_TINY)
        power = power / trace[:, None, None]
        if squared < _SQUARINGS:
            power = power @ power
    # Every column is a multiple of the vector; the longest is the most exact.
    longest = power.diagonal(dim1=1, dim2=2).argmax(1)
    column = power[torch.arange(len(power), device=power.device), :, longest]
    return (column / column.square().sum(1, keepdim=True).clamp_min(_TINY).sqrt())[..., None]


class TurnBatches(torch.utils.data.IterableDataset):
    """Images, masks and the state behind them, batch by batch. Each worker of a loader draws its own batches, like a
    rank of its own. With `n` workers the state advances after every `n`-th batch: resuming from it may read up to `n - 1`
    batches again, and misses none.

    A loop draws all samples up to the end of epoch `epochs - 1` (None: for ever), each epoch in an order of its own. A second
    loop begins where the first began, unless `set_epoch` was called. At the end of an epoch ranks may differ by a batch."""

    def __init__(self, path, batch=12, *, linear=False, rank=0, world_size=1, epochs=1, **options):
        self._path, self._linear = path, linear
        self._batch, self._epochs, self._options = batch, epochs, options
        self._rank, self._world_size = rank, world_size
        self._cursor = Cursor()

    def load_state_dict(self, state):
        self._cursor = Cursor.of(state)

    def set_epoch(self, epoch):
        """Lets the next loop draw this epoch alone; from the state that was loaded on, if that is in it."""
        if self._cursor.epoch != epoch:
            self._cursor = Cursor(epoch)
        self._epochs = epoch + 1

    def __iter__(self):
        worker = torch.utils.data.get_worker_info()
        count, number = (worker.num_workers, worker.id) if worker else (1, 0)
        # Opened here, so that each worker has its own files.
        batches = _open(self._path, linear=self._linear).batches(
            self._batch,
            rank=self._rank * count + number,
            world_size=self._world_size * count,
            cursor=self._cursor,
            epochs=self._epochs,
            **self._options,
        )
        state = self._cursor.state_dict()
        for batch in batches:
            # The cursor is after the batches of all workers: only the last worker's is after all that the loop has got.
            if number == count - 1:
                state = batch.cursor.state_dict()
            if batch.damaged:
                raise ValueError("; ".join(batch.damaged))
            yield (*batch.torch(), state)
            state = batch.cursor.state_dict()
