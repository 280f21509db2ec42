"""A prior for moduli of branches that are smooth over log time, with a smoothness that the data determine.

The prior is on second differences of the log moduli over log time (Honerkamp and Weese 1993, DOI 10.1007/BF00396042); its weight
has the greatest evidence of the linearised problem (MacKay 1992, DOI 10.1162/neco.1992.4.3.415).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dielast.calibration.scatter import Curves, Scatter, Whitening
from dielast.numerics.arrays import Floats

if TYPE_CHECKING:
    from dielast.calibration.problem import Problem

FEWEST = 4  # branches of a spectrum with a smoothness
WEIGHTS = np.geomspace(1e-3, 1e4, 22)


def smooth_branches(problem: Problem, curves: Curves, scatter: Scatter, slopes: Floats, at: Floats) -> Floats:
    """The precision (p, p) for smooth free moduli of branches; empty if there are too few of them.

    `slopes` (n, p) are the derivatives of all modelled values at coordinates `at` (p,).
    """
    places = [
        k for k, parameter in enumerate(problem.space.parameters) if parameter.name.startswith("nonequilibrium.shear_modulus[")
    ]
    if len(places) < FEWEST:
        return np.zeros((0, 0))
    time = np.log([problem.space.material.spectrum.relaxation_time[problem.space.parameters[k].index or 0] for k in places])
    bends = np.zeros((len(places) - 2, at.size))
    for row in range(len(places) - 2):
        first, middle, last = (time[row + offset] for offset in range(3))
        share = (middle - first) / (last - first)
        # over the typical spacing, so that the weight does not depend on the number of branches in a decade
        size = abs(last - first) / 2
        bends[row, places[row : row + 3]] = np.array((1 - share, -1.0, share)) / size
    rough = bends.T @ bends
    whiten = Whitening(curves, scatter)
    miss, jacobian = whiten(-curves.differences), whiten(slopes.T).T
    known = problem.precision
    normal = jacobian.T @ jacobian + known
    # the linearised problem about the point where all coordinates are zero
    target = jacobian.T @ (jacobian @ at - miss) + known @ problem.space.centre
    best, chosen = -np.inf, 0.0
    for weight in WEIGHTS:
        matrix = normal + weight * rough
        values = np.linalg.eigvalsh(matrix)
        if values[0] <= 1e-12 * values[-1]:
            continue
        gain = float(target @ np.linalg.solve(matrix, target))
        evidence = gain - float(np.sum(np.log(values))) + len(bends) * np.log(weight)
        if evidence > best:
            best, chosen = evidence, float(weight)
    return chosen * rough
