"""The decomposing network: relight beside PyTorch, on one thread, in processor time.

    cargo build --release -p relight --features train --example network_speed
    python network.py --program target/release/examples/network_speed

The same layers with random weights: steps of training (forward, backward, AdamW) on 24 pictures of
128 x 128, and one picture of 256 x 256 forward. PyTorch runs eagerly, in its default memory layout. Runs
are interleaved; the table gives medians of each run's best step, and how much less time relight takes. The last rows are
what it takes to light the photographs of such a step, and to cast a view.
"""

import argparse
import json
import statistics
import subprocess
import time

import torch
from torch import nn
from torch.nn import functional

INPUTS, OUTPUTS, BLOCK, GROUP = 7, 9, 2, 16
ENCODER = (32, 64, 128, 256, 256)


class Layer(nn.Module):
    def __init__(self, inputs, outputs, stride=1, rectified=True):
        super().__init__()
        self.convolution = nn.Conv2d(inputs, outputs, 3, stride, 1)
        self.norm = nn.GroupNorm(outputs // GROUP, outputs)
        self.rectified = rectified

    def forward(self, value):
        value = self.norm(self.convolution(value))
        return functional.relu(value) if self.rectified else value


class Residual(nn.Module):
    def __init__(self, channels):
        super().__init__()
        self.layers = nn.Sequential(
            Layer(channels, channels), Layer(channels, channels, rectified=False)
        )

    def forward(self, value):
        return functional.relu(value + self.layers(value))


class Decomposer(nn.Module):
    def __init__(self):
        super().__init__()
        inputs = INPUTS * BLOCK * BLOCK
        self.encoder = nn.ModuleList()
        for step, outputs in enumerate(ENCODER):
            layers = [Layer(inputs, outputs, 1 if step == 0 else 2)]
            if step >= 2:
                layers.append(Residual(outputs))
            self.encoder.append(nn.Sequential(*layers))
            inputs = outputs
        self.middle = nn.Sequential(Residual(inputs), Residual(inputs))
        self.decoder = nn.ModuleList()
        for outputs, skip in zip(ENCODER[-2::-1], ENCODER[:0:-1]):
            self.decoder.append(Layer(inputs + skip, outputs))
            inputs = outputs
        self.head = nn.Sequential(
            Layer(2 * ENCODER[0], ENCODER[0]),
            nn.Conv2d(ENCODER[0], OUTPUTS * BLOCK * BLOCK, 3, 1, 1),
        )

    def forward(self, value):
        value = functional.pixel_unshuffle(value, BLOCK)
        features = []
        for step in self.encoder:
            value = step(value)
            features.append(value)
        value = self.middle(value)
        for step in self.decoder:
            value = step(torch.cat([value, features.pop()], 1))
            value = functional.interpolate(value, scale_factor=2, mode="bilinear")
        value = self.head(torch.cat([value, features.pop()], 1))
        return functional.pixel_shuffle(value, BLOCK)


def least(steps, call):
    call()
    times = []
    for _ in range(steps):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


def train(side, batch, steps):
    network = Decomposer()
    pictures = torch.rand(batch, INPUTS, side, side)
    adam = torch.optim.AdamW(network.parameters(), lr=1e-3)

    def step():
        network(pictures).square().mean().backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        adam.step()
        adam.zero_grad()

    return least(steps, step)


def forward(side, batch, steps):
    network = Decomposer().eval()
    pictures = torch.rand(batch, INPUTS, side, side)
    with torch.inference_mode():
        return least(steps, lambda: network(pictures))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True, help="the example network_speed")
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(1)

    def ours(*words):
        text = subprocess.run(
            [arguments.program, *map(str, words)], check=True, capture_output=True, text=True
        ).stdout
        return json.loads(text)["seconds"]

    print(f"{'':>34} {'PyTorch s':>10} {'relight s':>10} {'ratio':>6}")
    for name, theirs, what, side, batch, steps in (
        ("a step of training, 24 x 128 px", train, "train", 128, 24, 3),
        ("one picture of 256 px, libtorch", forward, "forward", 256, 1, 5),
        ("one picture of 256 px, decompose", forward, "inference", 256, 1, 5),
    ):
        pairs = [
            (theirs(side, batch, steps), ours(what, side, batch, steps))
            for _ in range(arguments.runs)
        ]
        a, b = (statistics.median(column) for column in zip(*pairs))
        print(f"{name:>34} {a:>10.4f} {b:>10.4f} {a / b:>6.2f}")
    for name, what, batch, steps in (
        ("24 photographs of 128 px lit", "light", 24, 5),
        ("a view of 128 px cast", "cast", 1, 12),
    ):
        seconds = [ours(what, 128, batch, steps) for _ in range(arguments.runs)]
        print(f"{name:>34} {'':>10} {statistics.median(seconds):>10.4f}")


if __name__ == "__main__":
    main()
