"""The small U-Net of relit-mask (src/grabcut/src/unet): its layers, its training, and the file of its weights."""

import argparse
import concurrent.futures
import json
import math
import pathlib
import struct
import time

import numpy as np
import torch
from torch import nn
from torch.nn import functional
from torch.nn.functional import interpolate

WIDTHS, NARROW, HEAD = (24, 40, 56, 72, 88), 12, 16
# Residual blocks of the encoder at each size that begins with random weights.
RESIDUAL = 2
# A layer of so many weights is large.
MANY = 10_000
# The learning rate of what has learned already, as a share.
OF_LEARNED = 0.25
KINDS = {np.float16: "F16", np.int8: "I8"}


def layer(inputs, outputs):
    return nn.Sequential(nn.Conv2d(inputs, outputs, 3, 1, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(inplace=True))


class Residual(nn.Module):
    """Two layers whose output, nothing at first, is added to their input (as He et al., "Deep residual learning", 2016)."""

    def __init__(self, width):
        super().__init__()
        self.layers = nn.ModuleList([layer(width, width), layer(width, width)[:2]])
        nn.init.zeros_(self.layers[1][1].weight)

    def forward(self, planes):
        return planes + self.layers[1](self.layers[0](planes))


class Network(nn.Module):
    """Logits of `classes` from `planes`, to which column and row are added. `learned` are the blocks of the encoder's
    first sizes, which have learned already, and `skips` their channels."""

    def __init__(self, planes, classes, learned, skips):
        super().__init__()
        inputs = [planes + 2, *skips, *WIDTHS[len(skips) :]]
        own = [self.block(inputs[at], at) for at in range(len(skips), len(WIDTHS))]
        self.encoder = nn.ModuleList([*learned, *own])
        self.learned = len(skips)
        decoder = [
            nn.Sequential(layer(up + skip, out), layer(out, out))
            for up, skip, out in zip(WIDTHS[:0:-1], inputs[-2:0:-1], WIDTHS[-2::-1])
        ]
        decoder[-1] = decoder[-1][:1]
        self.decoder = nn.ModuleList(decoder)
        self.narrow = layer(WIDTHS[0], NARROW)
        self.head = nn.Sequential(layer(NARROW + inputs[0], HEAD), nn.Conv2d(HEAD, classes, 3, 1, 1))

    @staticmethod
    def block(inputs, at):
        width = WIDTHS[at]
        return nn.Sequential(layer(inputs, width), layer(width, width), *(Residual(width) for _ in range(RESIDUAL)))

    def groups(self, learning_rate):
        """The parameters, with their learning rates: those that have learned already change less."""
        learned = [*self.encoder[: self.learned].parameters()]
        known = set(map(id, learned))
        others = [own for own in self.parameters() if id(own) not in known]
        rates = [(learned, OF_LEARNED * learning_rate), (others, learning_rate)]
        return [{"params": own, "most": rate} for own, rate in rates if own]

    def forward(self, seen):
        many, _, height, width = seen.shape
        across = torch.linspace(-1, 1, width).expand(many, 1, height, width)
        down = torch.linspace(-1, 1, height)[:, None].expand(many, 1, height, width)
        sizes = [torch.cat([seen, across, down], 1)]
        for at, layers in enumerate(self.encoder):
            # Blocks that have learned halve by themselves.
            sizes.append(layers(sizes[-1] if at < self.learned else functional.avg_pool2d(sizes[-1], 2)))
        planes = sizes.pop()
        for layers in self.decoder:
            planes = layers(torch.cat([interpolate(planes, scale_factor=2.0), sizes.pop()], 1))
        planes = interpolate(self.narrow(planes), scale_factor=2.0)
        return self.head(torch.cat([planes, sizes[0]], 1))


def loss(log_odds, entropy, shares):
    """Cross-entropy, four times as much along the object's outline, and half of what Dice's coefficient lacks.

    `log_odds` are those of the object, whose shares are the first; `entropy` is of each pixel.
    """
    counts = shares.sum(1, keepdim=True)
    of_object = shares[:, :1]
    near = functional.max_pool2d(of_object, 7, 1, 3) + functional.max_pool2d(-of_object, 7, 1, 3) > 0.5
    weight = counts * (1 + 3 * near.float())
    found = torch.sigmoid(log_odds) * counts
    total = lambda of: of.sum((1, 2, 3))
    dice = (2 * total(found * of_object) + 1) / (total(found) + total(of_object) + 1)
    return (entropy * weight).sum() / weight.sum() + 0.5 * (1 - dice).mean()


def prepared(source):
    """What a generator yields, each made while the one before is used."""
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        upcoming = pool.submit(next, source)
        while True:
            ready, upcoming = upcoming.result(), pool.submit(next, source)
            yield ready


def fit(network, mean, batches, loss_of, overlap_of, arguments):
    """Trains a network for some minutes; `mean` becomes the running mean of its weights, which is written.

    `loss_of` is called with logits and shares, `overlap_of` with the mean network for its overlap as text.
    """
    network.to(memory_format=torch.channels_last)
    if arguments.begin:
        network.load_state_dict(torch.load(arguments.begin))
    mean.load_state_dict(network.state_dict())
    optimiser = torch.optim.AdamW(network.groups(arguments.learning_rate), weight_decay=1e-2)
    begun, recent = time.monotonic(), []
    for step, (seen, shares) in enumerate(prepared(batches)):
        done = (time.monotonic() - begun) / 60 / arguments.minutes
        if done >= 1:
            break
        for group in optimiser.param_groups:
            group["lr"] = group["most"] * min(1, step / 100 + 0.01) * (0.5 + 0.5 * math.cos(math.pi * done) + 0.002)
        network.train()
        with torch.autocast("cpu", torch.bfloat16):
            logits = network(seen)
        value = loss_of(logits.float(), shares)
        optimiser.zero_grad()
        value.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        recent = [*recent[-99:], value.item()]
        decay = min(0.995, (step + 1) / (step + 10))
        with torch.no_grad():
            for averaged, own in zip(mean.parameters(), network.parameters()):
                averaged.lerp_(own, 1 - decay)
            for averaged, own in zip(mean.buffers(), network.buffers()):
                averaged.copy_(own)
        if step % 500 == 499:
            print(f"step {step + 1}, loss {np.mean(recent):.4f}, overlap {overlap_of(mean)}", flush=True)
            torch.save(mean.state_dict(), arguments.output.with_suffix(".pt"))
    print(f"{step} steps, overlap {overlap_of(mean)}")
    torch.save(mean.state_dict(), arguments.output.with_suffix(".pt"))
    write(mean, arguments.output)


def convolutions(network):
    """Of each convolution the name of its layer, itself, and its normalisation or None."""
    modules = dict(network.named_modules())
    for name, module in modules.items():
        if isinstance(module, nn.Conv2d):
            parent = name.rpartition(".")[0]
            normal = modules.get(f"{parent}.1")
            has_normal = isinstance(normal, nn.BatchNorm2d)
            yield parent if has_normal else name, module, normal if has_normal else None


@torch.no_grad()
def write(network, path):
    """The weights as safetensors, with the normalisation in the convolutions: 16-bit numbers, of large layers integers of
    8 bits with a scale for each output channel."""
    tensors = {}
    for name, convolution, normal in convolutions(network):
        weight, bias = convolution.weight, convolution.bias
        if normal:
            scale = normal.weight / torch.sqrt(normal.running_var + normal.eps)
            weight, bias = weight * scale[:, None, None, None], normal.bias - normal.running_mean * scale
        of_layer = {"weight": weight, "bias": bias}
        if weight.numel() >= MANY:
            of_layer["scale"] = weight.abs().amax((1, 2, 3)).clamp(min=1e-6) / 127
            tensors[f"{name}.weight"] = torch.round(of_layer.pop("weight") / of_layer["scale"][:, None, None, None]).numpy().astype(np.int8)
        for part, numbers in of_layer.items():
            tensors[f"{name}.{part}"] = numbers.numpy().astype(np.float16)
    header, data = {}, b""
    for name, tensor in sorted(tensors.items()):
        own = tensor.tobytes()
        header[name] = {"dtype": KINDS[tensor.dtype.type], "shape": list(tensor.shape), "data_offsets": [len(data), len(data) + len(own)]}
        data += own
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    path.write_bytes(struct.pack("<Q", len(text)) + text + data)


def read(network, path):
    """Takes written weights, after which the normalisation does nothing."""
    data = path.read_bytes()
    begin = 8 + struct.unpack("<Q", data[:8])[0]
    tensors = {}
    for name, entry in json.loads(data[8:begin]).items():
        first, last = (begin + offset for offset in entry["data_offsets"])
        kind = next(kind for kind, name_of in KINDS.items() if name_of == entry["dtype"])
        numbers = np.frombuffer(data[first:last], kind).reshape(entry["shape"])
        tensors[name] = torch.from_numpy(numbers.astype(np.float32))
    with torch.no_grad():
        for name, convolution, normal in convolutions(network):
            scale = tensors.get(f"{name}.scale", torch.ones(1))[:, None, None, None]
            convolution.weight.copy_(tensors[f"{name}.weight"] * scale)
            (normal or convolution).bias.copy_(tensors[f"{name}.bias"])
            if normal:
                normal.reset_running_stats()
                nn.init.constant_(normal.weight, math.sqrt(1 + normal.eps))
    return network.eval()


def command_line(description, make, train, parity, views):
    """Runs `make`, `train` or `parity` of a network's program with the arguments that were typed; `views` is how many are
    made unless told."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(required=True)
    making = verbs.add_parser("make")
    for name in ("meshes", "panoramas", "data"):
        making.add_argument(name, type=pathlib.Path)
    making.add_argument("--views", type=int, default=views)
    making.add_argument("--seed", type=int, default=0)
    making.set_defaults(run=make)
    training = verbs.add_parser("train")
    training.add_argument("data", type=pathlib.Path)
    training.add_argument("--minutes", type=float, default=60)
    training.add_argument("--learning-rate", type=float, default=3e-3)
    training.add_argument("--from", dest="begin", type=pathlib.Path, help="a checkpoint (.pt) to begin with")
    training.add_argument("-o", "--output", type=pathlib.Path, required=True)
    training.set_defaults(run=train)
    comparing = verbs.add_parser("parity")
    comparing.add_argument("weights", type=pathlib.Path)
    comparing.set_defaults(run=parity)
    arguments = parser.parse_args()
    arguments.run(arguments)
