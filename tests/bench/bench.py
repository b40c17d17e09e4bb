"""Speed and memory of relit-extract against other ways to do the same work.

The video and its mask are scaled up to 1080p, and encoded as cameras do: as Motion JPEG, and as H.264 with a key
frame a second and no frame out of order. All programs read the same files and may use the same processors. The
runs are interleaved, so that a change of the machine's load meets all of them; the table gives medians.
"""

import argparse
import dataclasses
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import time

SIZE = 256
MARGIN = 0.05
HERE = pathlib.Path(__file__).parent

# A whole turn of the rig, for which costs are told.
FRAMES = TURN = 1500

DECODE = "ffmpeg, decoding only"
FFMPEG = "ffmpeg, PNG default"
PYTHON = "OpenCV + webdataset, PNG default"
PROGRAM = "relit-extract"
UNALIGNED = "relit-extract --align off"

ENCODINGS = {
    "mjpeg": ["-c:v", "mjpeg", "-q:v", "3", "-pix_fmt", "yuvj422p"],
    "h264": [
        "-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-g", "30", "-bf", "0",
        "-pix_fmt", "yuv420p",
    ],
}
# The bars, with and without alignment, by wall time and by processor time: at most so many times the decoder's, at least
# so many times as fast as another.
BARS = {
    "mjpeg": {PROGRAM: {FFMPEG: 2.5}, UNALIGNED: {FFMPEG: 3.5}},
    "h264": {PROGRAM: {DECODE: 1.4, FFMPEG: 1.8}},
}
# The most memory, MB.
MOST_MEMORY = {"mjpeg": 130, "h264": 160}


@dataclasses.dataclass
class Run:
    """What one run cost."""

    wall: float
    cpu: float
    peak_mb: float


def fail(text):
    sys.exit(f"bench: {text}")


def output(*command):
    try:
        return subprocess.run(command, check=True, capture_output=True).stdout
    except FileNotFoundError:
        fail(f"there is no {command[0]}: run `make setup`")
    except subprocess.CalledProcessError as error:
        fail(f"{command[0]} failed: {error.stderr.decode(errors='replace').strip()}")


def probe(path, entries, *options):
    text = output(
        "ffprobe", "-v", "error", "-select_streams", "v:0", *options,
        "-show_entries", f"stream={entries}", "-of", "csv=p=0", str(path),
    )
    return [int(number) for number in text.decode().split(",") if number.strip()]


def square_crop(mask):
    """The mask's bounding box with its margin, made square, inside the frame."""
    width, height = probe(mask, "width,height")
    grey = output(
        "ffmpeg", "-v", "error", "-i", str(mask),
        "-f", "rawvideo", "-pix_fmt", "gray", "-",
    )
    rows = [grey[y * width : (y + 1) * width] for y in range(height)]
    ys = [y for y, row in enumerate(rows) if any(row)]
    xs = [x for x in range(width) if any(row[x] for row in rows)]
    if not ys:
        fail(f"the mask {mask} is empty")
    w, h = xs[-1] + 1 - xs[0], ys[-1] + 1 - ys[0]
    side = min(round(max(w, h) * (1 + 2 * MARGIN)), width, height)

    def corner(low, extent, limit):
        return min(max(low + (extent - side) // 2, 0), limit - side)

    return corner(xs[0], w, width), corner(ys[0], h, height), side, side


def run(command, threads, log, codes=(0,)):
    """Runs a command on the first `threads` processors and waits for it; it ends with one of these codes."""
    cpus = sorted(os.sched_getaffinity(0))[:threads]
    with open(log, "wb") as sink:
        start = time.monotonic()
        child = subprocess.Popen(
            [str(part) for part in command], stdin=subprocess.DEVNULL, stdout=sink, stderr=sink,
            preexec_fn=lambda: os.sched_setaffinity(0, cpus),
        )
        _, status, usage = os.wait4(child.pid, 0)
        wall = time.monotonic() - start
    code = child.returncode = os.waitstatus_to_exitcode(status)
    if code not in codes:
        tail = log.read_text(errors="replace")[-2000:]
        fail(f"{command[0]} ended with {code}:\n{tail}")
    return Run(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def ffmpeg_png(args, crop, out, *png):
    x, y, w, h = crop
    window = f"crop={w}:{h}:{x}:{y}:exact=1,format=gbrp"
    graph = (
        f"[1:v]{window}[mask];[0:v]{window}[frame];[frame][mask]blend=all_mode=multiply,"
        f"scale={SIZE}:{SIZE}:flags=area,format=rgb24"
    )
    return [
        "ffmpeg", "-v", "error", "-y", "-filter_complex_threads", args.threads,
        "-threads", args.threads, "-i", args.video, "-i", args.mask,
        "-filter_complex", graph, "-vsync", "passthrough",
        "-threads", args.threads, *png, out / "%04d.png",
    ]


def opencv(args, crop, out, *png):
    return [
        sys.executable, HERE / "opencv_job.py", "--video", args.video, "--mask", args.mask,
        "--crop", ",".join(map(str, crop)), "--size", SIZE, "--threads", args.threads,
        "--out", out, *png,
    ]


def scaled_up(args, codec):
    """The video's first frames at 1080p."""
    path = args.work / f"{codec}.mkv"
    scale = ["-vf", "scale=1920:1080:flags=bicubic"]
    output(
        "ffmpeg", "-v", "error", "-y", "-i", str(args.video), "-frames:v", str(FRAMES), "-an",
        *scale, *ENCODINGS[codec], str(path),
    )
    return path


def scaled_mask(args):
    path = args.work / "mask.png"
    scale = "scale=1920:1080:flags=neighbor,format=gray"
    output("ffmpeg", "-v", "error", "-y", "-i", str(args.mask), "-vf", scale, str(path))
    return path


def relit(args, frames, video, out, *options):
    return [
        args.program, video, "--mask", args.mask, "--frames", frames, "--size", SIZE,
        "--threads", args.threads, *options, "-o", out,
    ]


def contestants(args, crop, frames):
    """Name -> the command that fills a folder."""
    decode = ["ffmpeg", "-v", "error", "-threads", args.threads, "-i", args.video]
    table = {
        DECODE: lambda out: [*decode, "-f", "null", "-"],
        FFMPEG: lambda out: ffmpeg_png(args, crop, out),
        "ffmpeg, PNG level 1, up": lambda out: ffmpeg_png(
            args, crop, out, "-compression_level", 1, "-pred", "up"
        ),
        PYTHON: lambda out: opencv(args, crop, out),
        "OpenCV + webdataset, PNG level 1": lambda out: opencv(args, crop, out, "--png-level", 1),
    }
    if args.program is not None:
        ours = {
            PROGRAM: lambda out: relit(args, frames, args.video, out),
            UNALIGNED: lambda out: relit(args, frames, args.video, out, "--align", "off"),
        }
        table = {**ours, **table}
    return table


def fresh(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def check_output(name, out, frames):
    """A program that did less than its work must not look fast."""
    if name.startswith("ffmpeg, PNG"):
        found = len(list(out.glob("*.png")))
    elif name.startswith(("OpenCV", PROGRAM)):
        names = output("tar", "tf", str(next(out.glob("*.tar")))).decode().splitlines()
        found = sum(member.endswith(".json") for member in names)
    else:
        return
    if found != frames:
        fail(f"{name} wrote {found} of {frames} frames")


def compare(args, crop, frames):
    runs = {}
    for repetition in range(args.runs):
        for name, command in contestants(args, crop, frames).items():
            out = fresh(args.work / "out")
            runs.setdefault(name, []).append(run(command(out), args.threads, args.work / "log"))
            check_output(name, out, frames)
            print(f"  {repetition + 1}/{args.runs} {name}: {runs[name][-1].wall:.2f} s", flush=True)
    shutil.rmtree(args.work / "out")
    return {
        name: Run(*(statistics.median(column) for column in zip(*map(dataclasses.astuple, each))))
        for name, each in runs.items()
    }


def print_comparison(codec, medians, frames):
    base = medians.get(PROGRAM)
    print(f"\n{codec:34}{'CPU s / 1500':>13}{'relit is':>10}{'wall':>8}{'relit is':>10}{'peak MB':>9}")
    for name, median in medians.items():
        other = base is not None and name != PROGRAM
        by_cpu = f"{median.cpu / base.cpu:8.2f} x" if other else ""
        by_wall = f"{median.wall / base.wall:8.2f} x" if other else ""
        print(
            f"{name:34}{TURN * median.cpu / frames:13.1f}{by_cpu:>10}"
            f"{median.wall:8.2f}{by_wall:>10}{median.peak_mb:9.0f}"
        )
    if base is None:
        return
    for ours, bars in BARS[codec].items():
        for name, bar in bars.items():
            for time in ("wall", "cpu"):
                own, other = (getattr(medians[which], time) for which in (ours, name))
                print_verdict(ours, name, time, own / other, bar)


def print_verdict(ours, name, time, ratio, bar):
    if name == DECODE:
        verdict = "reached" if ratio <= bar else "MISSED"
        print(f"{ours}, {time}: bar {bar} x that of {name}: {ratio:.2f} x, {verdict}")
    else:
        verdict = "reached" if 1 / ratio >= bar else "MISSED"
        print(f"{ours}, {time}: bar {bar} x as fast as {name}: {1 / ratio:.2f} x, {verdict}")


def memory(args, frames, most):
    """Peak memory of relit-extract on the video and on the video twice over."""
    long = (args.work / "long").with_suffix(args.video.suffix)
    parts = args.work / "parts.txt"
    quoted = str(args.video.resolve()).replace("'", "'\\''")
    parts.write_text(f"file '{quoted}'\n" * 2)
    output(
        "ffmpeg", "-v", "error", "-y", "-f", "concat", "-safe", "0", "-i", str(parts),
        "-c", "copy", str(long),
    )
    peaks = []
    # Twice over, each picture comes again: that is told.
    for video, count, codes in ((args.video, frames, (0,)), (long, 2 * frames, (0, 3))):
        out = fresh(args.work / "out")
        command = relit(args, count, video, out)
        peaks.append(run(command, args.threads, args.work / "log", codes).peak_mb)
        check_output(PROGRAM, out, count)
        print(f"peak memory, {count} frames: {peaks[-1]:.0f} MB")
    verdict = "reached" if peaks[0] <= most else "MISSED"
    print(f"bar: at most {most} MB: {verdict}; the same within 10 %: {peaks[1] / peaks[0]:.2f} x")
    shutil.rmtree(args.work / "out")
    long.unlink()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=pathlib.Path, help="relit-extract; without it, the peers")
    parser.add_argument("--stages", type=pathlib.Path, help="the example that measures the stages")
    parser.add_argument("--video", type=pathlib.Path, required=True)
    parser.add_argument("--mask", type=pathlib.Path, required=True)
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--work", type=pathlib.Path, required=True, help="folder for what is written")
    args = parser.parse_args()
    for path in (args.video, args.mask):
        if not path.is_file():
            parser.error(f"there is no file {path}")
    args.work.mkdir(parents=True, exist_ok=True)
    source = args
    args = argparse.Namespace(**vars(source))
    args.mask = scaled_mask(source)
    for codec in ENCODINGS:
        args.video = scaled_up(source, codec)
        frames = probe(args.video, "nb_read_packets", "-count_packets")[0]
        crop = square_crop(args.mask)
        print(f"{codec}: {frames} frames, {args.threads} threads, crop {crop}, to {SIZE} pixels")
        print_comparison(codec, compare(args, crop, frames), frames)
        if args.program is not None:
            memory(args, frames, MOST_MEMORY[codec])
        if args.stages is not None:
            print(output(str(args.stages), str(args.video), str(args.mask)).decode())
        args.video.unlink()


if __name__ == "__main__":
    main()
