"""Pictures as files: PGM for frames, PNG for looking at."""

import struct
import zlib

import numpy


def write_pgm(path, samples, max_value):
    with open(path, "wb") as file:
        file.write(b"P5\n%d %d\n%d\n" % (samples.shape[1], samples.shape[0], max_value))
        file.write(samples.astype(">u2" if max_value > 255 else "u1").tobytes())


def read_pgm(path):
    """Of 16 bits, as write_pgm writes it."""
    with open(path, "rb") as file:
        _, size, _, samples = file.read().split(b"\n", 3)
    width, height = (int(number) for number in size.split())
    return numpy.frombuffer(samples, ">u2").reshape(height, width)


def write_png(path, pixels):
    """Grey (h, w) or RGB (h, w, 3), 8 bits."""
    pixels = numpy.ascontiguousarray(pixels, numpy.uint8)
    height, width = pixels.shape[:2]
    colour = 2 if pixels.ndim == 3 else 0
    rows = numpy.concatenate([numpy.zeros((height, 1), numpy.uint8), pixels.reshape(height, -1)], axis=1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + chunk(b"IEND", b""))
