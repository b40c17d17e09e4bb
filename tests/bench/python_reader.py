"""Images a second from shards through Python: the package `relit` beside `webdataset`.

    python python_reader.py FOLDER

Both give batches of 12 neighbours as 32-bit floating point arrays (channels first, 0 to 1), a mask each, and the parsed
record, in one process: `relit` with one thread of Rust. The runs are interleaved; the table gives medians.
"""

import argparse
import pathlib
import statistics
import time

import relit
from reader import run_webdataset


def run_relit(folder, threads):
    start = time.perf_counter()
    count = sum(len(batch) for batch in relit.open(folder).batches(threads=threads))
    return count / (time.perf_counter() - start)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    shards = [str(path) for path in sorted(pathlib.Path(arguments.folder).glob("*.tar"))]
    found = {1: ([], []), 2: ([], [])}
    for _ in range(arguments.runs):
        for workers, (ours, theirs) in found.items():
            ours.append(run_relit(arguments.folder, workers))
            theirs.append(run_webdataset(shards, workers))
    print("| workers | relit, images/s | webdataset, images/s | factor |\n| --- | --- | --- | --- |")
    for workers, (ours, theirs) in found.items():
        ours, theirs = statistics.median(ours), statistics.median(theirs)
        print(f"| {workers} | {ours:.0f} | {theirs:.0f} | {ours / theirs:.1f} |")


if __name__ == "__main__":
    main()
