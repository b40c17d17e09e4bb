"""The whole job as a Python script with OpenCV does it: decode, mask, crop, measure, scale, shard.

A peer for bench.py. Written to be fast: it touches the crop only, leaves every loop over pixels
to OpenCV, and encodes in threads, which OpenCV allows by releasing the interpreter's lock.
"""

import argparse
import collections
import concurrent.futures
import json
import pathlib

import cv2
import numpy as np
import webdataset

SATURATED = 250
GATE = 0.05


class Job:
    """What is the same for every frame."""

    def __init__(self, mask, crop, size, png_level):
        x, y, w, h = crop
        self.window = (slice(y, y + h), slice(x, x + w))
        self.mask = mask[self.window]
        self.interior = cv2.erode(self.mask, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))
        self.mask_px = cv2.countNonZero(self.mask)
        self.size = (size, size)
        self.small_mask = cv2.resize(self.mask, self.size, interpolation=cv2.INTER_NEAREST)
        self.png = [] if png_level is None else [cv2.IMWRITE_PNG_COMPRESSION, png_level]
        self.mask_png = self.encode(self.small_mask)

    def encode(self, image):
        return cv2.imencode(".png", image, self.png)[1].tobytes()

    def sample(self, index, frame):
        source = frame[self.window]
        all_over = cv2.inRange(source, (SATURATED,) * 3, (255,) * 3)
        none_over = cv2.inRange(source, (0,) * 3, (SATURATED - 1,) * 3)
        saturated = cv2.countNonZero(cv2.bitwise_and(all_over, self.mask))
        dark = cv2.countNonZero(cv2.bitwise_and(none_over, self.mask))
        laplacian = cv2.Laplacian(cv2.cvtColor(source, cv2.COLOR_BGR2GRAY), cv2.CV_16S)
        deviation = cv2.meanStdDev(laplacian, mask=self.interior)[1]
        masked = cv2.bitwise_and(source, source, mask=self.mask)
        small = cv2.resize(masked, self.size, interpolation=cv2.INTER_AREA)
        small = cv2.bitwise_and(small, small, mask=self.small_mask)
        record = {
            "index": index,
            "mask_px": self.mask_px,
            "saturated_px": saturated,
            "saturated_fraction": saturated / self.mask_px,
            "saturated_any_px": self.mask_px - dark,
            "spec_net": saturated / self.mask_px > GATE,
            "mean_rgb": cv2.mean(source, mask=self.mask)[2::-1],
            "sharpness": float(np.ravel(deviation)[0]) ** 2,
        }
        return {
            "__key__": f"bench/{index:04}",
            "png": self.encode(small),
            "mask.png": self.mask_png,
            "json": json.dumps(record).encode(),
        }


def frames(video):
    capture = cv2.VideoCapture(str(video))
    while True:
        more, frame = capture.read()
        if not more:
            return
        yield frame


def samples(job, video, threads):
    """The samples in order, with a few frames under way in each thread."""
    waiting = collections.deque()
    with concurrent.futures.ThreadPoolExecutor(threads) as pool:
        for index, frame in enumerate(frames(video)):
            waiting.append(pool.submit(job.sample, index, frame))
            if len(waiting) > 4 * threads:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--video", type=pathlib.Path, required=True)
    parser.add_argument("--mask", type=pathlib.Path, required=True)
    parser.add_argument("--crop", required=True, help="X,Y,W,H")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--png-level", type=int, help="OpenCV's own default where not given")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    args = parser.parse_args()

    cv2.setNumThreads(1)  # The threads are used for whole frames.
    mask = cv2.imread(str(args.mask), cv2.IMREAD_GRAYSCALE)
    if mask is None:
        parser.error(f"cannot read the mask {args.mask}")
    crop = tuple(int(number) for number in args.crop.split(","))
    job = Job(cv2.threshold(mask, 127, 255, cv2.THRESH_BINARY)[1], crop, args.size, args.png_level)
    pattern = str(args.out / "bench-%04d.tar")
    with webdataset.ShardWriter(pattern, maxcount=1_000_000, maxsize=1e12, verbose=0) as shard:
        for sample in samples(job, args.video, args.threads):
            shard.write(sample)


if __name__ == "__main__":
    main()
