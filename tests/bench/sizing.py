"""What one session of 1500 samples costs relit-extract, by the size of its frames: for the table in docs/guide/cluster.md.

    python tests/bench/sizing.py target/release/relit-extract [--threads 2] [--folder FOLDER]

The turn of the fixtures is scaled up and encoded as cameras do, 1500 frames or, above 1920 x 1080, 300 of them. Time is
processor time, which does not depend on what else runs; that of 300 frames is taken five times. Disk is the most that
the data set's folder held at any moment. Needs the program ffmpeg.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import threading

FIXTURE = pathlib.Path(__file__).resolve().parents[2] / "fixtures" / "20261120T093015Z-cow"
SIZES = [(640, 480), (1280, 960), (1920, 1080), (3840, 2160)]
FRAMES = 1500
FEW = 300
CODECS = {
    "Motion JPEG": ["-c:v", "mjpeg", "-pix_fmt", "yuvj422p", "-q:v", "3"],
    "H.264": ["-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-g", "30", "-bf", "0"],
}


def ffmpeg(*arguments):
    subprocess.run(["ffmpeg", "-v", "error", "-y", *map(str, arguments)], check=True)


def scaled(size):
    """The middle of the picture in another shape, so that the object is not distorted."""
    width, height = size
    return f"scale={width}:{height}:force_original_aspect_ratio=increase:flags=%s,crop={width}:{height}"


def disk(folder):
    total = 0
    for root, _, names in os.walk(folder):
        for name in names:
            try:
                total += os.stat(os.path.join(root, name)).st_blocks * 512
            except FileNotFoundError:
                pass
    return total


def extract(program, video, mask, out, frames, options):
    """Processor seconds, peak memory, most bytes on disk, and bytes of the shard."""
    command = [program, video, "--mask", mask, "-o", out, "--frames", frames, *options]
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL)
    most, ended = [0], threading.Event()

    def watch():
        while not ended.wait(0.02):
            most[0] = max(most[0], disk(out))

    watcher = threading.Thread(target=watch)
    watcher.start()
    _, status, usage = os.wait4(process.pid, 0)
    ended.set()
    watcher.join()
    if os.waitstatus_to_exitcode(status) not in (0, 3):
        sys.exit(f"{' '.join(map(str, command))} failed")
    shard = next(pathlib.Path(out).glob("*.tar")).stat().st_size
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, most[0], shard


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--folder", type=pathlib.Path, help="where clips are kept for the next run")
    arguments = parser.parse_args()
    temporary = tempfile.TemporaryDirectory()
    folder = arguments.folder or pathlib.Path(temporary.name)
    folder.mkdir(parents=True, exist_ok=True)
    print("| frames | codec | video | processor time | memory | disk while writing | shard, 256 | shard, native |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for size in SIZES:
        name = f"{size[0]}x{size[1]}"
        mask = folder / f"{name}.png"
        ffmpeg("-i", FIXTURE / "mask_gt.png", "-vf", scaled(size) % "neighbor", mask)
        frames = FRAMES if size[0] <= 1920 else FEW
        times = FRAMES // frames
        for codec, encoding in CODECS.items():
            video = folder / f"{name}-{codec.replace(' ', '')}.mkv"
            if not video.exists():
                ffmpeg("-i", FIXTURE / "video.mkv", "-frames:v", frames, "-vf", scaled(size) % "lanczos", *encoding, video)
            figures = {}
            for samples in ["256", "native"]:
                with tempfile.TemporaryDirectory(dir=folder) as out:
                    options = ["--size", samples, "--threads", arguments.threads]
                    figures[samples] = extract(arguments.program, video, mask, out, frames, options)
            seconds, memory, most, shard = figures["256"]
            print(
                f"| {size[0]} x {size[1]} | {codec} | {times * video.stat().st_size / 1e6:.0f} MB | {times * seconds:.0f} s "
                f"| {memory / 1e6:.0f} MB | {times * most / 1e6:.0f} MB | {times * shard / 1e6:.0f} MB "
                f"| {times * figures['native'][3] / 1e6:.0f} MB |",
                flush=True,
            )


if __name__ == "__main__":
    main()
