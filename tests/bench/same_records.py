"""Whether two builds of relit-extract write the same data sets, byte for byte.

    python same_records.py OLD NEW SESSION|VIDEO...

The mask of each is the `mask_gt.png` beside it or in it. Each is extracted by both with each of the options below, and
every file of both data sets is compared.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

OPTIONS = [
    ["--threads", "2"],
    ["--threads", "1", "--align", "off", "--size", "native", "--frames", "100"],
    ["--threads", "2", "--align-tolerance", "0", "--size", "128", "--frames", "150"],
]


def extracted(program, source, options, folder):
    mask = (source if source.is_dir() else source.parent) / "mask_gt.png"
    command = [program, source, "--mask", mask, "--partial", *options, "-o", folder]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    # 3 says that something was lost, which both have to say.
    if done.returncode not in (0, 3):
        sys.exit(f"{program} ended with {done.returncode}: {done.stderr.strip()}")
    files = (path for path in pathlib.Path(folder).rglob("*") if path.is_file())
    return done.returncode, {path.relative_to(folder): path.read_bytes() for path in files}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("old", type=pathlib.Path)
    parser.add_argument("new", type=pathlib.Path)
    parser.add_argument("sources", type=pathlib.Path, nargs="+")
    args = parser.parse_args()
    differ = False
    for source in args.sources:
        for options in OPTIONS:
            with tempfile.TemporaryDirectory() as old, tempfile.TemporaryDirectory() as new:
                before = extracted(args.old, source, options, old)
                after = extracted(args.new, source, options, new)
            names = before[1].keys() | after[1].keys()
            unlike = sorted(str(name) for name in names if before[1].get(name) != after[1].get(name))
            same = before[0] == after[0] and not unlike
            differ |= not same
            verdict = "the same" if same else f"DIFFERENT: {', '.join(unlike) or 'the exit code'}"
            print(f"{source.parent.name}/{source.name} {' '.join(options)}: {len(names)} files, {verdict}", flush=True)
    sys.exit(differ)


if __name__ == "__main__":
    main()
