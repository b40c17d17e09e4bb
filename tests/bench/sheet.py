"""Twelve compositions as one picture, to look at what relight relight and relight insert make.

    python sheet.py PROGRAMS FIXTURES FOLDER SHEET.jpg

PROGRAMS is the folder of the programs relight and relit-extract. Objects are those of FIXTURES, as photographs (a frame
of a turn with its true mask) and captured (relight turn); panoramas are those that relight synth writes. FOLDER keeps
each composition as a PNG. It needs ffmpeg.
"""

import argparse
import pathlib
import shutil
import subprocess

TILE = (400, 300)
COLUMNS = 4
COW = "20261120T101500Z-cow-short"
BUST = "20261120T102000Z-bust-short"


def run(*command):
    """Runs a program, which says itself what is wrong."""
    if subprocess.run([str(part) for part in command], stdout=subprocess.DEVNULL, check=False).returncode not in (0, 3):
        raise SystemExit(f"{' '.join(map(str, command))} failed")


def objects(programs, fixtures, folder):
    """Writes NAME.png and NAME.mask.png of each object, and its captured object into the folder NAME."""
    for name, session in [("cow", COW), ("bust", BUST)]:
        source = fixtures / session
        run("ffmpeg", "-v", "error", "-y", "-i", source / "video.mkv", "-frames:v", 1, folder / f"{name}.png")
        shutil.copy(source / "mask_gt.png", folder / f"{name}.mask.png")
        if (folder / name / "object.relit").exists():
            continue
        run(programs / "relit-extract", source, "--mask", source / "mask_gt.png", "-o", folder / f"{name}-shards")
        shard = next((folder / f"{name}-shards").glob("*.tar"))
        run(programs / "relight", "turn", shard, "-o", folder / name)


def compositions(folder):
    """Names and arguments of relight, without its output."""
    def photo(name):
        return [folder / f"{name}.png", "--mask", folder / f"{name}.mask.png"]

    def panorama(name):
        return ["--into", folder / "panoramas" / f"{name}.exr"]

    def at(x, y, height):
        return ["--at", f"{x},{y}", "--height", height]

    here = ["--background", "photo"]
    return [
        ("lamp-right", ["relight", *photo("cow"), "--lamp", "60,30", *here]),
        ("lamp-left", ["relight", *photo("bust"), "--lamp=-70,20", *here]),
        ("lamp-warm", ["relight", *photo("cow"), "--lamp", "-40,35,2500K", *here]),
        ("lamp-grey", ["relight", *photo("bust"), "--lamp", "110,30"]),
        ("room", ["insert", *photo("cow"), *panorama("room-0"), *at(0.5, 0.85, 0.5)]),
        ("room-bust", ["insert", *photo("bust"), *panorama("room-1"), *at(0.45, 0.9, 0.6)]),
        ("studio", ["insert", *photo("cow"), *panorama("studio-1"), *at(0.5, 0.85, 0.5)]),
        ("sky", ["insert", folder / "cow" / "object.relit", *panorama("sky-0"), *at(0.5, 0.85, 0.45)]),
        ("captured-room", ["insert", folder / "bust" / "object.relit", *panorama("room-2"), *at(0.55, 0.9, 0.65)]),
        ("captured-large", ["insert", folder / "cow" / "object.relit", *panorama("room-3"), *at(0.5, 0.95, 0.85)]),
        ("captured-lamp", ["insert", folder / "cow" / "object.relit", *panorama("sky-2"), *at(0.5, 0.85, 0.5), "--lamp", "-60,30,3000K"]),
        ("photograph", ["insert", folder / "bust" / "object.relit", "--into", folder / "cow.png", *at(0.2, 0.88, 0.35)]),
    ]


def sheet(pictures, path):
    """Puts the pictures together, row by row."""
    width, height = TILE
    fitted = "".join(
        f"[{at}]format=rgb24,scale={width}:{height}:force_original_aspect_ratio=increase:flags=area,crop={width}:{height}[t{at}];"
        for at in range(len(pictures))
    )
    tiles = "".join(f"[t{at}]" for at in range(len(pictures)))
    places = "|".join(f"{at % COLUMNS * width}_{at // COLUMNS * height}" for at in range(len(pictures)))
    inputs = [part for picture in pictures for part in ("-i", picture)]
    stacked = f"{fitted}{tiles}xstack=inputs={len(pictures)}:layout={places}"
    run("ffmpeg", "-v", "error", "-y", *inputs, "-filter_complex", stacked, "-frames:v", 1, "-q:v", 4, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("programs", "fixtures", "folder", "sheet"):
        parser.add_argument(name, type=pathlib.Path)
    arguments = parser.parse_args()
    programs, folder = arguments.programs.resolve(), arguments.folder
    folder.mkdir(parents=True, exist_ok=True)
    objects(programs, arguments.fixtures, folder)
    run(programs / "relight", "synth", "panoramas", "-o", folder / "panoramas")
    pictures = []
    for name, command in compositions(folder):
        picture = folder / f"{name}.png"
        run(programs / "relight", *command, "-o", picture)
        pictures.append(picture)
    sheet(pictures, arguments.sheet)


if __name__ == "__main__":
    main()
