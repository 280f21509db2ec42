"""Random numbers: of one seed, a stream for each thing that is drawn, which no other thing's share."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.random import Generator


def stream(seed: int, name: str, *indices: int) -> Generator:
    """The random numbers of `seed` (not negative) for what is called `name`, and of many such, for the one with these `indices`.

    All streams of a seed are children of one `numpy.random.SeedSequence`, so that they are independent of each other, and of how
    many of them are drawn from, and in which order.
    """
    digest = hashlib.sha256(name.encode()).digest()
    words = [int.from_bytes(digest[start : start + 4], "little") for start in (0, 4)]
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(*words, *indices)))
