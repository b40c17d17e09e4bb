"""Images a second from shards: relight's reader beside the Python package `webdataset`.

    cargo build --release -p relight-core --example read_turns
    python reader.py --reader target/release/examples/read_turns FOLDER

Both give the same: batches of 12 neighbours as 32-bit floating point arrays (channels first, 0 to
1), a mask each, and the parsed record. With two workers webdataset runs in two processes, each over
every second shard (of a single one both read all); relight uses two threads. The runs are
interleaved, so that a change of the machine's load meets both; the table gives medians.
"""

import argparse
import io
import json
import multiprocessing
import pathlib
import statistics
import subprocess
import time

import numpy as np
import webdataset as wds
from PIL import Image

BATCH = 12


def decode(sample):
    image = np.asarray(Image.open(io.BytesIO(sample["png"])))
    mask = np.asarray(Image.open(io.BytesIO(sample["mask.png"])))
    image = np.ascontiguousarray(image.transpose(2, 0, 1), dtype=np.float32) / np.float32(255)
    mask = (mask >= 128).astype(np.float32)[None]
    return image * mask, mask, json.loads(sample["json"])


def read(shards):
    """Reads all samples of the shards; how many there are."""
    dataset = wds.WebDataset(shards, shardshuffle=False).map(decode).batched(BATCH)
    count = 0
    for images, masks, _ in dataset:
        assert images.dtype == masks.dtype == np.float32
        count += len(images)
    return count


def run_webdataset(shards, workers):
    start = time.perf_counter()
    if workers == 1:
        count = read(shards)
    else:
        parts = [shards[index::workers] or shards[:1] for index in range(workers)]
        with multiprocessing.Pool(workers) as pool:
            count = sum(pool.map(read, parts))
    return count / (time.perf_counter() - start)


def run_relight(reader, folder, workers):
    """The example's own count of images a second, opening included."""
    text = subprocess.run(
        [reader, folder, str(workers)], check=True, capture_output=True, text=True
    ).stdout
    return json.loads(text)["per_second"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--reader", required=True, help="the example read_turns")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("folder", help="a folder of shards")
    arguments = parser.parse_args()
    shards = sorted(str(path) for path in pathlib.Path(arguments.folder).glob("*.tar"))
    print(f"{'workers':>8} {'webdataset':>12} {'relight':>12} {'ratio':>7}")
    for workers in (1, 2):
        theirs, ours = [], []
        for _ in range(arguments.runs):
            theirs.append(run_webdataset(shards, workers))
            ours.append(run_relight(arguments.reader, arguments.folder, workers))
        a, b = statistics.median(theirs), statistics.median(ours)
        print(f"{workers:>8} {a:>12.0f} {b:>12.0f} {b / a:>7.2f}")


if __name__ == "__main__":
    main()
