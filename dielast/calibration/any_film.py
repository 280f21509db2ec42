"""What a film of any springs and branches can answer to a measured history of stretch: a test for what no film can follow.

A film whose springs and branches all have moduli that are not negative answers by a sum, with factors that are not negative, of the
answers of single springs and branches. The sum that comes nearest to a measured curve is a problem of least squares (Lawson and
Hanson 1995, DOI 10.1137/1.9781611971217, Ch. 23). It has relaxation times from below the spacing of the points to beyond the end of
the test, and springs with and without strain stiffening, so that it is meant to have less error than the laws that are fitted
later, and it needs no start. What is left is what no such film does; the factors are no material, as nothing else determines them.
"""

import numpy as np

from dielast.calibration.experiment import MeasuredTest
from dielast.calibration.laboratory import SYMMETRIES
from dielast.calibration.scatter import level_of
from dielast.material.springs import Gent, MooneyRivlin, NeoHookean, SpringLaw, gathered
from dielast.mechanics.flow import Flow
from dielast.mechanics.load import Mode
from dielast.mechanics.stretched import Histories, carried
from dielast.numerics.arrays import Flags, Floats

# These numbers are choices, not derived: how many parts the sum has.
FACTOR = 3.0  # between neighbouring relaxation times: of a closer spacing, sums hardly differ
FASTER, SLOWER = 0.1, 10.0  # times beyond the spacing of the points and beyond the end of the test
STIFFENING = (1.05, 1.2, 1.4, 1.7, 2.2, 4.0)  # J_lim of springs, over the largest I1 - 3 of the test: closer near the limit
SPRINGS = 2 + len(STIFFENING)  # parts that are springs: the first ones
LIMITED = 0.4  # J_lim of further branches, over the same: below 1, as branches flow before they lock
ROUNDS = 5  # of weights for the least sum of magnitudes
RTOL = 1e-4  # of the answers


def answers_of_parts(test: MeasuredTest) -> Floats:
    """The stress (n, parts) of springs and branches of modulus 1 Pa at the points of a test."""
    time = test.time
    reach = max(test.largest_invariant - 3, 1e-3)
    gaps = np.diff(time, prepend=0.0)
    fastest, slowest = FASTER * float(np.min(gaps[gaps > 0])), SLOWER * float(time[-1])
    times = np.geomspace(fastest, slowest, 2 + int(np.log(slowest / fastest) / np.log(FACTOR)))
    springs: list[SpringLaw] = [MooneyRivlin(0.0, 0.5), NeoHookean(), *(Gent(factor * reach) for factor in STIFFENING)]
    laws = [*springs, Gent(LIMITED * reach)]
    branches = np.arange(1, len(laws))
    rate = np.concatenate((np.zeros(len(springs)), np.tile(1 / (3 * times), branches.size)))
    law = np.concatenate((np.arange(len(springs)), np.repeat(branches, times.size)))
    joined = gathered([(each, each) for each in laws], np.ones((1, len(laws)), dtype=bool))
    count = rate.size
    corners = (np.broadcast_to(values, (count, values.size)).copy() for values in (test.corner_time, test.corner_stretch))
    place = np.broadcast_to(time, (count, time.size)).copy()
    stretch = np.interp(place, test.corner_time, test.corner_stretch)
    return carried(joined.take(law), Flow(rate[None]), SYMMETRIES[Mode(test.mode)], Histories(*corners), place, stretch, RTOL).T


def any_film(test: MeasuredTest, used: Flags) -> Floats:
    """The stress (n,) in Pa of the film with the least sum of magnitudes of differences from a test, over the points that are
    `used` (n,); differences count over the level of the curve.

    Least magnitudes follow most points and leave the others alone; they are found by weights (Schlossmacher 1973,
    DOI 10.1080/01621459.1973.10481386).
    """
    from scipy.optimize import nnls

    parts = answers_of_parts(test)
    parts = parts[:, np.all(np.isfinite(parts), axis=0)]
    level = level_of(test.stress, 0.5)
    size = np.linalg.norm(parts / level[:, None], axis=0)
    scaled, wanted = (parts / level[:, None] / size)[used], (test.stress / level)[used]
    weight, factors = np.ones(wanted.size), np.zeros(size.size)
    for _ in range(ROUNDS):
        # the same least squares with as many rows as columns
        triangle: Floats = np.asarray(np.linalg.qr(weight[:, None] * np.column_stack((scaled, wanted)), mode="r"), dtype=float)
        factors, _ = nnls(triangle[:, :-1], triangle[:, -1])
        miss = np.abs(scaled @ factors - wanted)
        weight = 1 / np.sqrt(np.maximum(miss, max(float(np.median(miss)), 1e-9) * 0.1))
    return np.asarray(parts @ (factors / size))
