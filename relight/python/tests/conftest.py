"""Small photographs, panoramas and files that the tests need, and the programs that they are held against."""

import os
import shutil
import struct
import subprocess
import zlib

import numpy
import pytest

#: The programs: `make test-python` names those that it has built.
RELIGHT = os.environ.get("RELIGHT") or shutil.which("relight")
RELIT_MASK = os.environ.get("RELIT_MASK") or shutil.which("relit-mask")

needs_relight = pytest.mark.skipif(not RELIGHT, reason="RELIGHT names no program")
needs_mask = pytest.mark.skipif(not RELIT_MASK, reason="RELIT_MASK names no program")


def run(program, *arguments):
    """Runs a program, which may find something to be doubtful (exit code 3)."""
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode in (0, 3), done.stderr
    return done.stdout


def write_png(path, array):
    """An array of uint8 or uint16, rows x columns [x 3 or 4], as PNG."""
    array = numpy.atleast_3d(array)
    rows, columns, channels = array.shape
    depth = array.dtype.itemsize
    lines = array.astype(array.dtype.newbyteorder(">")).tobytes()
    length = columns * channels * depth
    raw = b"".join(b"\0" + lines[row * length :][:length] for row in range(rows))
    header = struct.pack(">IIBBBBB", columns, rows, 8 * depth, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    parts = chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(raw)), chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    return path


def write_hdr(path, array):
    """Linear light as Radiance HDR."""
    mantissa, exponent = numpy.frexp(array.max(2))
    scale = numpy.where(array.max(2) > 0, mantissa / numpy.maximum(array.max(2), 1e-30) * 256, 0)
    pixels = numpy.concatenate([array * scale[..., None], (exponent + 128)[..., None]], 2)
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {array.shape[0]} +X {array.shape[1]}\n"
    path.write_bytes(header.encode() + pixels.astype(numpy.uint8).tobytes())
    return path


def ball(rows=120, columns=160, radius=45):
    """A glossy, painted ball in the light of a lamp, uint8 sRGB before a grey wall, and its mask."""
    y, x = numpy.mgrid[:rows, :columns]
    across, down = (x - columns / 2) / radius, (rows / 2 - y) / radius
    mask = across**2 + down**2 < 1
    towards = numpy.sqrt(numpy.maximum(1 - across**2 - down**2, 0))
    lit = numpy.maximum(0.5 * across + 0.6 * down + 0.62 * towards, 0) + 0.15
    paint = numpy.where((x // 12 + y // 12) % 2 == 0, 0.7, 0.3)
    colour = (lit * paint)[..., None] * [0.9, 0.6, 0.4] + (numpy.maximum(lit, 0) ** 40)[..., None]
    light = numpy.where(mask[..., None], colour, 0.2)
    return numpy.round(255 * numpy.clip(light, 0, 1) ** (1 / 2.2)).astype(numpy.uint8), mask


def room(rows=32):
    """A panorama: a blue sky, a brown ground, a lamp on the right."""
    y, x = numpy.mgrid[:rows, : 2 * rows]
    light = numpy.where((y < rows / 2)[..., None], [0.3, 0.5, 0.9], [0.25, 0.2, 0.15])
    lamp = (abs(x - 1.5 * rows) < rows / 10) & (abs(y - rows / 3) < rows / 10)
    return numpy.float32(numpy.where(lamp[..., None], [20.0, 18.0, 15.0], light))


@pytest.fixture
def photo():
    return ball()
