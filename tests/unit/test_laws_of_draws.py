"""Intervals of draws of several laws that cannot be told apart."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dielast import DielastWarning, Gent, Material, MooneyRivlin, NeoHookean, NoShift, Spectrum, draw_sample
from dielast.calibration.laws import mixed_draws
from dielast.commands.calibrate.checks import warn_of_laws_alike
from dielast.commands.calibrate.freedom import free_of
from dielast.commands.calibrate.recipe import FreeValue
from dielast.io.files import Inputs
from dielast.material.scatter import assured, interval


def solid(law: Any, modulus: float) -> Material:
    return Material("m", modulus, Spectrum([], []), NoShift(20.0), law)


def test_an_interval_of_several_laws_holds_that_of_each() -> None:
    random = np.random.default_rng(3)
    values, laws = random.standard_normal((400, 2)), np.repeat([0, 1, 2, 3], [230, 150, 19, 1])
    values[laws == 1] += 7
    values[laws == 3] = [-50.0, 1.0]
    low, high = interval(values, 0.9, laws)
    parts = [interval(values[laws == law], 0.9) for law in range(3)]
    assert low == pytest.approx([-50.0, min(part[0][1] for part in parts)])
    assert high == pytest.approx(np.max([part[1] for part in parts], axis=0))
    assert interval(values, 0.9, np.zeros(400, dtype=int))[0] == pytest.approx(interval(values, 0.9)[0])
    assert assured(values[:, 1], 0.95, laws) == low[1]
    # too few draws in all have no interval, as with one law; an event that one law never has has no end
    assert np.isnan(interval(values[:18, 0], 0.9, laws[:18])[0])
    times = np.where(laws == 1, np.inf, np.exp(values[:, 1]))
    assert interval(times, 0.9, laws)[1] == np.inf


def test_draws_of_several_laws_take_turns() -> None:
    parts = [tuple(solid(law, 1e4 + k) for k in range(200)) for law in (Gent(50.0), NeoHookean(), Gent(70.0))]
    results: Any = [SimpleNamespace(materials=part) for part in parts]
    members = mixed_draws(results, [0.6, 0.3, 0.1])
    assert len(members) == 200
    for count in (20, 100, 200):
        shares = [np.mean([member in part for member in members[:count]]) for part in parts]
        assert shares == pytest.approx([0.6, 0.3, 0.1], abs=1 / count)
    laws = draw_sample(members, 30).laws
    assert laws is not None
    assert np.bincount(laws).tolist() == [21, 9]  # two laws: the constants do not count
    assert draw_sample(parts[0], 30).laws is None


def test_a_spring_of_which_nothing_is_free_is_named() -> None:
    free: Any = {"equilibrium.shear_modulus": FreeValue(), "nonequilibrium.shear_modulus": FreeValue()}
    branches = Spectrum(np.array([10.0]), np.array([1e4]))
    materials = {
        name: Material("m", 1e4, branches, NoShift(20.0), law, law)
        for name, law in (("gent.toml", Gent(50.0)), ("mooney.toml", MooneyRivlin(4e3, 1e3)))
    }
    with pytest.warns(DielastWarning, match=r"\[equilibrium\] of mooney.toml is free, .* equilibrium.C10, equilibrium.C01"):
        found = free_of(free, materials, Inputs(Path()))
    assert set(found["mooney.toml"]) == {"nonequilibrium.shear_modulus"}


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ({}, r"1.5 between them: \[uncertainty\] draws would be of each of them$"),
        ({"draws.csv": 0}, "draws are of each of them$"),
        ({"draws.csv": 0, "next_tests.csv": 0}, "draws are of each of them, next_tests.csv lists tests that would$"),
    ],
)
def test_laws_that_cannot_be_told_apart_name_only_files_that_are_there(written: dict[str, int], words: str) -> None:
    with pytest.warns(DielastWarning, match=words):
        warn_of_laws_alike({"gent": 0.6, "yeoh": 0.4}, [2e3, 3e3], written)
