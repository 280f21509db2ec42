"""Damage to valid files, by chance: bytes flipped, lines moved, numbers and words made absurd, structure nested or repeated."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Sequence
from pathlib import Path

LARGEST = 200_000  # bytes of a damaged file
NUMBERS, WORDS = ((Path(__file__).parent / name).read_text("utf-8").splitlines() for name in ("numbers.txt", "words.txt"))
BYTES = (b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\r\n", b"\t", *(bytes([mark]) for mark in b";,\"'[]{}#=.\xb5\\"))


def damage(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """One of the seeds, damaged in one to four places."""
    data = rng.choice(seeds)
    for _ in range(rng.randint(1, 4)):
        data = rng.choice(DAMAGES)(data, seeds, rng)
        data = data[:LARGEST]
    return data


def _span(data: bytes, rng: random.Random) -> tuple[int, int]:
    first = rng.randrange(len(data) + 1)
    return first, min(len(data), first + rng.choice((1, 2, 5, 20, 100)))


def _flip(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    if not data:
        return b"\x80"
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]


def _insert(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(BYTES) * rng.choice((1, 1, 2, 3)) + data[at:]


def _cut(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    first, end = _span(data, rng)
    return data[:first] + data[end:]


def _double(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    first, end = _span(data, rng)
    return data[:end] + data[first:end] * rng.choice((1, 1, 2, 3000)) + data[end:]


def _truncate(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _lines(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    choice = rng.randrange(4)
    if choice == 0:
        lines[i], lines[j] = lines[j], lines[i]
    elif choice == 1:
        lines.insert(i, lines[j])
    elif choice == 2:
        del lines[i]
    else:
        other = rng.choice(seeds).split(b"\n")
        lines[i:i] = other[rng.randrange(len(other)) :][: rng.randint(1, 6)]
    return b"\n".join(lines)


def _token(pattern: bytes, substitutes: Sequence[str]) -> Callable[[bytes, Sequence[bytes], random.Random], bytes]:
    found_by = re.compile(pattern)

    def change(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
        found = list(found_by.finditer(data))
        if not found:
            return data
        match = rng.choice(found)
        return data[: match.start()] + rng.choice(substitutes).encode() + data[match.end() :]

    return change


def _nest(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    at, depth = rng.randrange(len(data) + 1), rng.choice((5, 200, 3000))
    opening, closing = rng.choice(((b"[", b"]"), (b"{a=", b"}"), (b"a.", b""), (b"(", b")"), (b'"', b'"')))
    return data[:at] + opening * depth + closing * rng.choice((0, depth)) + data[at:]


def _encode(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    return data.decode("utf-8", "replace").encode(rng.choice(("utf-16", "utf-16-le", "utf-8-sig", "cp1252", "utf-32")), "replace")


def _marks(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    return data.replace(
        *rng.choice(((b".", b","), (b",", b";"), (b",", b"\t"), (b"[", b"("), (b"=", b"=="), (b"\n", b"\r"), (b" ", b"")))
    )


DAMAGES = (
    _flip,
    _insert,
    _cut,
    _double,
    _truncate,
    _lines,
    _lines,
    _token(rb"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?", NUMBERS),
    _token(rb"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?", NUMBERS),
    _token(rb'"[^"\n]*"', WORDS),
    _token(rb'"[^"\n]*"', WORDS),
    _token(rb"[A-Za-z_]{3,}", ("", "kind", "step", "data", "file", "s", "MPa", "nan", "time", "temperature", "__class__")),
    _nest,
    _encode,
    _marks,
)
