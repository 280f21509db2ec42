"""Random numbers of one seed: what is drawn of one thing says nothing of another."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import numpy as np

from dielast.numerics.random_streams import stream

PACKAGE = Path(__file__).parents[2] / "dielast"
NAMES = (
    "noise",
    "measurements",
    "model error",
    "material",
    "edge",
    "equilibrium modulus",
    "failures",
    "law",
    "laws",
    "beyond the curve",
    "spectra beyond the curve",
    "thickness",
    "posterior",
    "sensitivity",
)


def test_no_two_streams_coincide() -> None:
    keys = [(seed, name, *more) for seed in (0, 1, 3) for name in NAMES for more in ((), (0,), (1,), (3,), (0, 0), (3, 1))]
    first = {key: tuple(stream(key[0], key[1], *key[2:]).random(4)) for key in keys}
    assert len(set(first.values())) == len(keys)
    drawn = np.array([stream(1, name, *more).standard_normal(20_000) for name in NAMES for more in ((), (0,), (3,))])
    # independent of each other: correlations of 20,000 numbers within 5 of their standard errors
    assert max(abs(float(a @ b)) / a.size for a, b in combinations(drawn, 2)) < 5 / np.sqrt(20_000)


def test_a_stream_is_its_seed_its_name_and_its_indices() -> None:
    np.testing.assert_array_equal(stream(7, "noise", 2).random(5), stream(7, "noise", 2).random(5))


def test_every_random_number_comes_from_a_stream_of_its_own_name() -> None:
    used: list[str] = []
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_text()
        if path.name != "random_streams.py":
            assert "default_rng" not in text, path
            assert "np.random." not in text.replace("np.random.Generator", ""), path
            used += re.findall(r"(?<!\w)stream\([^\"()]*, \"([^\"]+)\"", text)
    assert sorted(used) == sorted(NAMES)
