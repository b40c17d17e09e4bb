"""The decomposing network: relight beside PyTorch, on one thread, in processor time.

    cargo build --release -p relight-train --features libtorch --example network_speed
    python network.py --program target/release/examples/network_speed

The same layers with random weights: steps of training (forward, backward, AdamW) on 24 pictures of
128 x 128, and one picture of 256 x 256 forward. PyTorch runs eagerly, in its default memory layout. Runs
are interleaved; the table gives medians of each run's best step, and how much less time relight takes. The last rows are
what it takes to light the photographs of such a step, and to cast a view.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import time

import torch
from torch import nn

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "relight/photo/tests/fixtures/nets"))
from make import Decomposer

INPUTS = 7


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
