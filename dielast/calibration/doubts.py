"""What a measured curve shows about its test that no film explains.

At the rest that it begins at: slack grips, a force that was not zeroed or has the other sign.

From cycle to cycle: softening (Mullins), by which a film is weaker than at its first loading up to the largest stretch it has had.
Viscoelastic films are softer in the second cycle, too, as slow branches have flowed. Softening is what remains beyond that: the
nearest film of any springs and branches is compared with the nearest one that also has parts which break at the first loading:
springs, and a share of the whole film. They bear stress at the largest stretch so far, and below it only a share 1 - g of it, with

    g = erf((1 - W/W_max) / q),

where W is I1 - 3: the form of Ogden and Roxburgh (1999, DOI 10.1098/rspa.1999.0431), with their m proportional to the largest
energy, for several q at once. All moduli are found together, none of them negative.
"""

import numpy as np
from scipy.special import erf, fdtri

from dielast.calibration.any_film import SPRINGS, answers_of_parts
from dielast.calibration.estimate import USUAL_ERROR
from dielast.calibration.experiment import TOLERANCE, MeasuredTest, first_invariant
from dielast.calibration.scatter import level_of
from dielast.mechanics.load import Mode
from dielast.numerics.arrays import Floats

CONCAVE = 1.5  # stretch up to which the nominal stress of rubber is concave in the stretch, unless its rate rises
LOADED = 0.1  # of the largest stress up to there: less may be noise
SHARPNESS = (0.1, 0.5, 2.0)  # q: from springs that lose stress at once to those that lose it in proportion to the energy
ALARM = 0.01  # probability that noise alone shows softening
TAUT = USUAL_ERROR  # of the largest stress: a film that bears less may be slack, which no sum of springs and branches shows


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
    """The stress of the first point over the largest one, if the specimen is undeformed there and should bear none; else 0."""
    if test.nominal_field or test.stretch[0] != 1:
        return 0.0
    return float(test.stress[0] / np.max(np.abs(test.stress)))


def gives_work(test: MeasuredTest) -> bool:
    """Whether the specimen gives more work than it takes, which a passive one at rest cannot: its force has the other sign.

    Up to the first point, the stress is taken as that of the first point: unloading from there gives back no more work.
    """
    work = test.stress[0] * (test.stretch[0] - 1) + np.trapezoid(test.stress, test.stretch)
    return bool(work < 0) and not test.nominal_field


def softening(test: MeasuredTest) -> float:
    """The share of its stress that the specimen of a test has lost on later loadings up to stretches of the first one.

    0 for a test that is loaded once, and where the film that does not soften explains the test within noise, or misses it by less
    than films usually miss a curve.
    """
    energy = first_invariant(test.followed, Mode(test.mode)) - 3
    largest = np.maximum.accumulate(energy)
    taut = test.stress > TAUT * np.max(test.stress)
    again = taut & (np.gradient(energy) > 0) & (energy < (1 - TOLERANCE) * largest)
    if test.nominal_field or not again.any():
        return 0.0
    from scipy.optimize import nnls  # slow to load, and needed by few tests

    parts, level = answers_of_parts(test), level_of(test.stress, 0.5)
    parts = np.where(np.isfinite(parts).all(axis=0), parts, 0.0)
    lost = np.stack([erf((1 - energy / np.maximum(largest, 1e-12)) / sharpness) for sharpness in SHARPNESS], axis=-1)

    def nearest(parts: Floats) -> tuple[Floats, Floats]:
        """The moduli (parts,) of the nearest film, and its differences (taut,) over the level."""
        scaled = (parts / level[:, None])[taut]
        size = np.maximum(np.linalg.norm(scaled, axis=0), 1e-300)
        wanted = (test.stress / level)[taut]
        factors, _ = nnls(scaled / size, wanted, maxiter=30 * size.size)
        return factors / size, scaled @ (factors / size) - wanted

    unbroken, without = nearest(parts)
    # springs alone, and all of the film alike
    virgin = np.column_stack((parts[:, :SPRINGS], parts @ unbroken))[:, :, None]
    breaking = (virgin * (1 - lost[:, None])).reshape(test.time.size, -1)
    whole = np.concatenate((parts, breaking), axis=1)
    moduli, with_it = nearest(whole)
    # correlated differences count as fewer points (Bartlett 1946, DOI 10.2307/2983611)
    like = float(np.clip(np.corrcoef(with_it[1:], with_it[:-1])[0, 1], 0.0, 1.0))
    free = max((1 - like) / (1 + like) * with_it.size - 1, 1.0)
    gain = float(without @ without) / max(float(with_it @ with_it), 1e-300) - 1
    broken = (virgin * lost[:, None]).reshape(test.time.size, -1) @ moduli[parts.shape[1] :]
    share = float(np.sum(broken[again]) / np.sum((whole @ moduli + broken)[again]))
    return share if share > USUAL_ERROR and gain * free > fdtri(1.0, free, 1 - ALARM / breaking.shape[1]) else 0.0
