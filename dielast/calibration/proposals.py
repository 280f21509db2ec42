"""Which test would settle a prediction: the share of its variance that each possible test is expected to take away.

The prediction is the voltage of a film: a stated one, or one that is stretched as far, in I1, as the tests were, where laws that
fit alike differ most.
The draws of the material, of all laws, give the joint distribution of this voltage q and of what each possible test would measure,
y, all in logarithms. With the covariances c = cov(y, q) and C = cov(y) of the draws, and the variance N of a measurement, that of
the specimen and of the model's error, the test is expected to leave var q - c' (C + N)^-1 c (Lindley 1956, DOI
10.1214/aoms/1177728069, for normal distributions).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dielast.base.errors import warn
from dielast.calibration.experiment import Experiment, MeasuredTest, first_invariant
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.voltage import VoltageTest
from dielast.material.material import Material
from dielast.mechanics.load import Mode
from dielast.numerics.arrays import Floats
from dielast.simulate.film_setup import Film

# Choices: a few tests that a laboratory can do.
RATES = (0.01, 1.0)  # 1/s
HOLD = 3600.0  # s
REACHED = 1.2  # relative stretch of the predicted film
RELAX, RAMP, THICKNESS = 1800.0, 100.0, 1e-3  # s, V/s and m of films
PRESTRETCHES = (2.0, 3.0, 4.0)
LEAST = 3.1  # I1 of the smallest stretch that is looked at
MOST_DRAWS, FEWEST_DRAWS = 120, 10


def stretch_of(invariant: float, mode: Mode) -> float:
    """The stretch above 1 at which the I1 of a mode has a value."""
    from scipy.optimize import brentq

    return float(brentq(lambda stretch: float(first_invariant(np.array(stretch), mode)) - invariant, 1.0, np.sqrt(invariant)))


def approach(relative_stretch: float) -> Floats:
    """Three relative stretches up to the last one, as a voltage test has at least."""
    return 1 + (relative_stretch - 1) * np.array([0.25, 0.5, 1.0])


def predicted_film(invariant: float, temperature: float) -> VoltageTest:
    """A film under dead load at the equibiaxial prestretch with this I1, at the relative stretch of the prediction."""
    prestretch = stretch_of(max(invariant, LEAST), Mode.EQUIBIAXIAL)
    film = Film(THICKNESS, prestretch, relax=RELAX)
    return VoltageTest("prediction", np.full(3, 2e4), approach(REACHED), film, RAMP, temperature, measure="relative_stretch")


def film_voltages(materials: Sequence[Material | None], asked: VoltageTest) -> Floats:
    """The voltage (materials,) in V of the film that is `asked` for, at its last stretch; NaN for a material that cannot follow."""
    return Laboratory([asked]).answers(materials)[0][:, -1]


def possible_tests(invariant: float, temperature: float) -> list[Experiment]:
    """Loading at two rates with a hold, in each mode up to this I1, and films at several prestretches."""
    tests: list[Experiment] = []
    for mode in Mode:
        top = stretch_of(max(invariant, LEAST), mode)
        for rate in RATES:
            lasts = (top - 1) / rate
            time = lasts * np.array([0.25, 0.5, 1.0])
            stretch = 1 + (top - 1) * np.array([0.25, 0.5, 1.0])
            time, stretch = np.append(time, lasts + HOLD), np.append(stretch, top)
            name = f"{mode.value} loading to stretch {top:.3g} at {100 * rate:g} %/s, held for {HOLD / 3600:g} h"
            tests.append(MeasuredTest(name, time, stretch, np.ones(4), temperature, mode))
    usual = predicted_film(invariant, temperature)
    for prestretch in PRESTRETCHES:
        film = replace(usual.film, prestretch=prestretch)
        tests.append(replace(usual, name=f"film at prestretch {prestretch:g}, its stretch at voltages", film=film))
    return tests


def proposals(
    materials: Sequence[Material], asked: VoltageTest, invariant: float, specimen: float, error: float
) -> dict[str, float]:
    """The possible tests up to an `invariant` I1, and the share of the variance of what is `asked` that each is expected to take
    away, the largest first, by draws of the material; `specimen` is the scatter of specimens, `error` that of the model. Empty
    without a permittivity, and where fewer than `FEWEST_DRAWS` draws can follow the film that is asked for; a test that fewer can
    follow is left out. Warns of draws that cannot follow this film.
    """
    if not materials or not materials[0].permittivity:
        return {}
    members = materials[:MOST_DRAWS]  # laws and strata take turns
    with np.errstate(invalid="ignore", divide="ignore"):
        wanted = np.log(film_voltages(members, asked))
        lost = len(members) - np.count_nonzero(np.isfinite(wanted))
        if 0 < lost <= len(members) - FEWEST_DRAWS:
            warn(f"prediction: {lost} of {len(members)} draws cannot follow this film, next_tests.csv leaves them out")
        found = dict[str, float]()
        tests = possible_tests(invariant, asked.temperature)
        for test, answers in zip(tests, Laboratory(tests).answers(members), strict=True):
            seen = np.log(answers)
            known = np.isfinite(wanted) & np.all(np.isfinite(seen), axis=1)
            if np.count_nonzero(known) < FEWEST_DRAWS:
                continue
            both = np.cov(np.column_stack((seen[known], wanted[known])).T)
            size = seen.shape[1]
            noise = test.power**2 * specimen**2 * np.ones((size, size)) + error**2 * np.eye(size)
            cross = both[:-1, -1]
            found[test.name] = float(cross @ np.linalg.solve(both[:-1, :-1] + noise, cross) / both[-1, -1])
    return dict(sorted(found.items(), key=lambda each: -each[1]))
