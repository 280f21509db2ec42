"""Random numbers: independent, named streams from one seed, one for each quantity that is drawn."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.random import Generator


def stream(seed: int, name: str, *indices: int) -> Generator:
    """The generator of the stream `name` of a nonnegative `seed`; `indices` distinguish several streams of one name.

    All streams of a seed are children of one `numpy.random.SeedSequence`. They are independent of each other, and their numbers do
    not depend on which other streams are used, or in which order.
    """
    digest = hashlib.sha256(name.encode()).digest()
    words = [int.from_bytes(digest[start : start + 4], "little") for start in (0, 4)]
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(*words, *indices)))
