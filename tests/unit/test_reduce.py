"""The reduced spectrum: within its tolerance, as small as an exhaustive search finds, refused in one line where there is none."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from numpy.typing import NDArray
from ramps import area, ramp_error
from scipy.optimize import linprog

from dielast.base.errors import InputError
from dielast.material.shift import WLF, NoShift
from dielast.material.spectrum import Spectrum
from dielast.relaxation.reduce import reduce_spectrum

Array = NDArray[np.float64]
SHIFT = WLF(20.0, 13.7, 187.1)
FULL = Spectrum(np.logspace(5, -6, 34), 3e4 * np.logspace(-1, 3, 34))
LEVEL = 3e4


def answers(spectrum: Spectrum, time: Array) -> Array:
    """G at each time, and its mean from 0 and from times before the first one to that one."""
    first = time.min()
    before = np.append(0.0, first * np.geomspace(1e-4, 0.95, 60))
    mean = (area(spectrum, LEVEL, np.array([first])) - area(spectrum, LEVEL, before)) / (first - before)
    return np.concatenate([spectrum.relaxation_modulus(time, LEVEL), mean])


@pytest.mark.parametrize(
    ("tolerance", "temperatures"),
    [
        pytest.param(0.1, (-10.0, 20.0, 60.0), marks=pytest.mark.trust),
        (0.02, (60.0,)),
        pytest.param(0.005, None, marks=pytest.mark.trust),
    ],
)
def test_the_error_stays_within_the_tolerance(tolerance: float, temperatures: tuple[float, ...] | None) -> None:
    found = reduce_spectrum(FULL, LEVEL, SHIFT, window=(1.0, 2e4), temperatures=temperatures, tolerance=tolerance)
    assert len(found.spectrum) < 20
    assert found.max_relative_error <= tolerance
    assert found.max_relative_error_ramp <= tolerance
    worst = 0.0
    for temperature in temperatures or (20.0,):
        time = np.geomspace(1.0, 2e4, 3001) / 10 ** SHIFT.log10_shift_factor(temperature)
        error = np.abs(answers(found.spectrum, time) / answers(FULL, time) - 1)
        assert error.max() < 1.01 * tolerance
        assert ramp_error(found.spectrum, FULL, LEVEL, time[::300]) < 1.01 * tolerance
        worst = max(worst, float(error[:3001].max()))
    assert found.max_relative_error == pytest.approx(worst, rel=0.01)
    there = np.array([found.time]) / 10 ** SHIFT.log10_shift_factor(found.temperature)
    ratio = answers(found.spectrum, there)[0] / answers(FULL, there)[0]
    assert abs(ratio - 1) == pytest.approx(found.max_relative_error, rel=1e-6)
    np.testing.assert_allclose(np.abs(found.reduced / found.full - 1).max(), found.max_relative_error)


@pytest.mark.trust
def test_the_same_twice() -> None:
    one, other = (reduce_spectrum(FULL, LEVEL, SHIFT, window=(1.0, 10.0), tolerance=0.05) for _ in range(2))
    np.testing.assert_array_equal(one.spectrum.relaxation_time, other.spectrum.relaxation_time)
    np.testing.assert_array_equal(one.spectrum.shear_modulus, other.spectrum.shear_modulus)


@pytest.mark.trust
def test_a_measured_curve_is_reduced_for_ramps_that_end_at_the_edge_of_the_window(shared_data: Callable[[str], Path]) -> None:
    terms = np.loadtxt(shared_data("ansys_prony/prony_terms_KPf_MD.csv"), delimiter=",", skiprows=2)
    glassy = 1739.03e6 / 3
    spectrum = Spectrum(terms[:, -1], terms[:, -2] * glassy)
    level = glassy - spectrum.shear_modulus.sum()
    window = (1e18, 1e26)  # about the glass transition
    found = reduce_spectrum(spectrum, level, NoShift(20.0), window=window, tolerance=0.01)
    assert len(found.spectrum) <= 8
    assert ramp_error(found.spectrum, spectrum, level, np.geomspace(*window, 40)) < 0.01
    # at the very edge, ramps that end there, or a little before or after
    edge = window[0] * np.linspace(1.0, 1.2, 5)
    assert ramp_error(found.spectrum, spectrum, level, edge) <= found.max_relative_error_ramp * 1.01


def least_error(number: int, window: tuple[float, float]) -> float:
    """The least greatest error of `number` branches with any of 30 relaxation times, by trying all of them."""
    time = np.geomspace(*window, 40)
    full = answers(FULL, time)
    candidates = np.geomspace(window[0] / 100, window[1] * 10, 30)
    one = np.array([answers(Spectrum(np.array([own]), np.ones(1)), time) for own in candidates])
    columns = one.T - LEVEL
    columns *= 1 / full[:, None]
    scaled, target, least = columns / columns.max(axis=0), 1 - LEVEL / full, np.inf
    ones = np.ones((full.size, 1))
    for chosen in combinations(range(candidates.size), number):
        some = scaled[:, list(chosen)]
        found = linprog(
            np.append(np.zeros(number), 1.0),
            A_ub=np.block([[some, -ones], [-some, -ones]]),
            b_ub=np.concatenate([target, -target]),
        )
        least = min(least, float(found.x[-1]))
    return least


@pytest.mark.trust
def test_no_exhaustive_search_finds_a_smaller_one() -> None:
    window = (1.0, 1000.0)
    by_search = [least_error(number, window) for number in (1, 2)]
    for number, error in enumerate(by_search, start=1):
        # what the search reaches on its grid of times with so many branches, so does the reduction
        found = reduce_spectrum(FULL, LEVEL, SHIFT, window=window, tolerance=1.02 * error)
        assert len(found.spectrum) <= number
        # and a little below the best of all it takes one more, not several
        tighter = reduce_spectrum(FULL, LEVEL, SHIFT, window=window, tolerance=0.5 * error)
        assert len(tighter.spectrum) == number + 1


def test_slow_and_fast_processes_are_lumped() -> None:
    found = reduce_spectrum(FULL, LEVEL, SHIFT, window=(0.9, 1.1), tolerance=0.01)
    assert len(found.spectrum) <= 3  # two of them for ramps that ended some time before
    assert found.spectrum.shear_modulus.sum() < 0.1 * FULL.shear_modulus.sum()


@given(st.integers(min_value=0, max_value=2**31), st.integers(min_value=2, max_value=25), st.floats(min_value=0.003, max_value=0.3))
@example(712, 20, 0.03125)  # the linear programme gave a modulus a hair below zero
@settings(max_examples=2)
def test_any_spectrum_is_reduced_within_its_tolerance_or_refused(seed: int, branches: int, tolerance: float) -> None:
    rng = np.random.default_rng(seed)
    spectrum = Spectrum(10 ** rng.uniform(-4, 6, branches), 10 ** rng.uniform(3, 7, branches))
    refused = ""
    try:
        found = reduce_spectrum(spectrum, LEVEL, SHIFT, window=(0.1, 1e4), tolerance=tolerance)
    except InputError as refusal:
        refused = str(refusal)
    if refused:
        assert f"no spectrum of fewer than {branches} branches" in refused
        return
    time = np.geomspace(0.1, 1e4, 1501)
    assert np.abs(answers(found.spectrum, time) / answers(spectrum, time) - 1).max() < 1.01 * tolerance
    assert ramp_error(found.spectrum, spectrum, LEVEL, time[::300]) < 1.01 * tolerance
    assert len(found.spectrum) < branches


@pytest.mark.parametrize(
    ("options", "found"),
    [
        ({"window": (10.0, 1.0)}, "window: from 10 to 1 s: two positive times, the shorter one first"),
        ({"window": (0.0, 1.0)}, "window: from 0 to 1 s"),
        ({"tolerance": 0.0}, "tolerance: 0: a relative error from 1e-05 to 1 is needed"),
        ({"tolerance": np.nan}, "tolerance: nan"),
        ({"temperatures": (-170.0,)}, "temperature: -170 degC is at or below -167.1 degC, where the WLF law has its pole"),
        ({"temperatures": ()}, "at least one temperature"),
        ({"shift": NoShift(20.0), "temperatures": (60.0,)}, "temperatures: 60 degC: the curve comes without a shift law"),
        ({"spectrum": FULL.slowest(3), "window": (1e2, 1e5), "tolerance": 1e-5}, "no spectrum of fewer than 3 branches stays"),
        ({"equilibrium_modulus": 0.0, "window": (1.0, 1e8)}, "has relaxed to nothing at a reduced time of"),
    ],
)
def test_impossible_wishes_are_refused_in_one_line(options: dict[str, Any], found: str) -> None:
    arguments: dict[str, Any] = {"spectrum": FULL, "equilibrium_modulus": LEVEL, "shift": SHIFT, "window": (1.0, 1e3), **options}
    with pytest.raises(InputError, match=found) as caught:
        reduce_spectrum(arguments.pop("spectrum"), arguments.pop("equilibrium_modulus"), arguments.pop("shift"), **arguments)
    assert "\n" not in str(caught.value)
