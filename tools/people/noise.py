"""Smooth noise over space and hashes of positions: the same on every machine."""

import numpy

GOLDEN = numpy.uint64(0x9E3779B97F4A7C15)


def mix(value):
    with numpy.errstate(over="ignore"):
        value = (value ^ (value >> numpy.uint64(30))) * numpy.uint64(0xBF58476D1CE4E5B9)
        value = (value ^ (value >> numpy.uint64(27))) * numpy.uint64(0x94D049BB133111EB)
    return value ^ (value >> numpy.uint64(31))


def hash_unit(seed, *parts):
    """0 <= x < 1, by the integers alone; arrays broadcast."""
    state = numpy.uint64(seed % 2 ** 64)
    with numpy.errstate(over="ignore"):
        for part in parts:
            state = mix((state + GOLDEN) ^ (numpy.asarray(part).astype(numpy.int64).astype(numpy.uint64) * GOLDEN))
    return (state >> numpy.uint64(11)).astype(float) * 2.0 ** -53


def smooth(points, size_mm, seed):
    """-1 .. 1, features of about size_mm; points (..., 3)."""
    places = numpy.asarray(points) / size_mm
    low = numpy.floor(places)
    part = places - low
    part = part * part * (3.0 - 2.0 * part)
    total = numpy.zeros(places.shape[:-1])
    for corner in range(8):
        bits = numpy.array([corner & 1, corner >> 1 & 1, corner >> 2])
        weight = numpy.where(bits, part, 1.0 - part).prod(axis=-1)
        cell = low + bits
        total += weight * hash_unit(seed, cell[..., 0], cell[..., 1], cell[..., 2])
    return 2.0 * total - 1.0
