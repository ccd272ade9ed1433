"""Calibrated model files, made as their page describes them, and what the reference says of samples."""

from __future__ import annotations

import struct
import zlib
from typing import Any

from wstac_reference.calibration import answer
from wstac_reference.rng import SplitMix64, seed_of

from . import SEED

SAMPLES = 8
SHAPES = [(2, 1, 0), (3, 2, 1), (5, 1, 2), (10, 3, 5), (7, 2, 9), (1, 1, 3), (12, 4, 32), (6, 2, 4), (3, 1, 7)]
"""Classes, frames, and dimensions of the projection."""
WITH_LIMITS = {7, 8}
"""The numbers of the shapes whose classes have limits of their own."""


def below(rng: SplitMix64, bound: int, count: int) -> list[int]:
    """Random numbers."""
    return [int(number) for number in rng.below(bound, count)]


def rows(rng: SplitMix64, count: int, inputs: int, most_bias: int) -> list[int]:
    """The halves of rows of int16 weights."""
    biases = [number - most_bias // 2 for number in below(rng, most_bias, count)]
    halves = [(bias >> (16 * k)) & 0xFFFF for bias in biases for k in range(4)]
    return halves + [(weight - 600) & 0xFFFF for weight in below(rng, 1201, count * inputs)]


def file_of(rng: SplitMix64, classes: int, frames: int, dimensions: int, has_limits: bool) -> bytes:
    """A linear model file of random numbers."""
    inputs = 10 * frames
    body = [classes, 0, *rows(rng, classes, inputs, 4_000_000)]
    end = 16 + len(body)
    part = [*struct.unpack("<2H", struct.pack("<I", 3_000_000_000)), 1 | 30 << 8, dimensions]
    if dimensions > 0:
        threshold = 9_000_000 * dimensions
        part += [10, int(has_limits), threshold & 0xFFFF, threshold >> 16, *rows(rng, dimensions, inputs, 1_000_000)]
        for _ in range(classes):
            part += [(number - 3000) & 0xFFFF for number in below(rng, 6001, dimensions)] + [0] * (dimensions % 2)
        if has_limits:
            part += [half for limit in below(rng, 2 * threshold, classes) for half in (limit & 0xFFFF, limit >> 16)]
    part += [end & 0xFFFF, end >> 16]
    labels = end + len(part)
    text = b"".join(bytes([1, ord("a") + k]) for k in range(classes)) + b"\0\0"
    text += bytes(-len(text) % 4)
    length = labels // 2 + len(text) // 4
    header = [0, 0, length & 0xFFFF, length >> 16, 1, 2, classes, 0, frames, 0, labels & 0xFFFF, labels >> 16, 0, 1 << 8]
    halves = header + body + part
    content = struct.pack(f"<{len(halves) - 2}H", *halves[2:]) + text
    return b"WSM1" + struct.pack("<I", zlib.crc32(content)) + content


def known_cases() -> list[dict[str, Any]]:
    """A model file and its answers for each shape."""
    cases: list[dict[str, Any]] = []
    for number, (classes, frames, dimensions) in enumerate(SHAPES):
        rng = SplitMix64(seed_of(SEED, f"known {number}"))
        data = file_of(rng, classes, frames, dimensions, number in WITH_LIMITS)
        samples = [[x - 4000 for x in below(rng, 8001, 10 * frames)] for _ in range(SAMPLES)]
        answers: list[dict[str, Any]] = []
        for sample in samples:
            found = answer(data, sample)
            probabilities = [round(probability, 9) for probability in found.probabilities]
            answers.append({"class": found.place, "probabilities": probabilities, "known": found.known})
        words = list(struct.unpack(f"<{len(data) // 4}I", data))
        cases.append({"dimensions": dimensions, "words": words, "samples": samples, "answers": answers})
    return cases
