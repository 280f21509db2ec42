"""What a measured curve shows about the rest that it begins at: slack grips, a force that was not zeroed or has the other sign."""

import numpy as np

from dielast.calibration.experiment import MeasuredTest

CONCAVE = 1.5  # stretch up to which the nominal stress of rubber is concave in the stretch, unless its rate rises
LOADED = 0.1  # of the largest stress up to there: less may be noise


def slack_of(test: MeasuredTest) -> float:
    """The least stretch beyond 1 over which the specimen cannot have been taut, 0 if the curve shows none.

    At a rate that does not rise, the stress of springs and branches is concave from rest: no chord from rest is steeper than those
    before it. Where one is, the points before it are late by the distance to it along the stretch, at least.
    """
    falls = np.flatnonzero(np.diff(test.stretch) <= 0)
    first = slice(0, int(falls[0]) + 1 if falls.size else None)
    stretch, stress = test.stretch[first], test.stress[first]
    near = (stretch > 1) & (stretch <= CONCAVE)
    strain, stress = stretch[near] - 1, stress[near]
    if test.nominal_field or strain.size < 2 or np.max(stress) <= 0:
        return 0.0
    chord = np.where(stress >= LOADED * np.max(stress), stress / strain, 0.0)
    steepest = int(np.argmax(chord))
    return float(np.max(strain[:steepest] - np.maximum(stress[:steepest], 0.0) / chord[steepest], initial=0.0))


def stress_at_rest(test: MeasuredTest) -> float:
    """The stress of the first point over the largest one, if the specimen is undeformed there, else 0; there, a model has none."""
    if test.nominal_field or test.stretch[0] != 1:
        return 0.0
    return float(test.stress[0] / np.max(np.abs(test.stress)))


def gives_work(test: MeasuredTest) -> bool:
    """Whether the specimen gives more work than it takes, which a passive one at rest cannot: its force has the other sign.

    Up to the first point, the stress counts as that of the first point: unloading from there gives no more work back than that.
    """
    work = test.stress[0] * (test.stretch[0] - 1) + np.trapezoid(test.stress, test.stretch)
    return bool(work < 0) and not test.nominal_field
