"""Raw tests of a synthetic laboratory: specimens that scatter and go slack, a machine that rings. Prints the error of fitted and of
predicted tests, with slack specimens that bear nothing and that push, over the scatter put in.

    python tests/bench/bench_raw_tests.py [--laboratories 2]
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from machines import AREA, Machine, Record, cycles, hold

from dielast import Gent, Material, MeasuredTest, NoShift, Spectrum
from dielast.calibration.comparison import relative_error
from dielast.calibration.fit import fit_material
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.parameters import Free
from dielast.calibration.ringing import loaded_at_rest, ringing

SCATTER = 0.05  # of the stress, from specimen to specimen
FITTED = 5  # tests; the others are predicted
TRUTH = Material("truth", 20e3, Spectrum([160.0, 3.0], [18e3, 40e3]), NoShift(20.0), Gent(110.0), Gent(55.0))
START = Material("start", 30e3, Spectrum([200.0, 4.0], [25e3, 30e3]), NoShift(20.0), Gent(110.0), Gent(55.0))
FREE = {path: Free() for path in ("equilibrium.shear_modulus", "nonequilibrium.shear_modulus", "nonequilibrium.relaxation_time")}


def measured(seed: int) -> list[Record]:
    """Two holds and three cyclic tests, and a hold and a cyclic test at other rates and stretches."""
    random, machine = np.random.default_rng(seed), Machine(noise=0.003, force=0.5)
    factor = np.exp(SCATTER * random.standard_normal(7)).tolist()
    held = [(2.0, 4.0, factor[0]), (3.0, 6.0, factor[1]), (1.5, 2.0, factor[5])]
    cycled = [(2.5, 10.0, factor[2]), (3.0, 40.0, factor[3]), (2.0, 20.0, factor[4]), (2.8, 25.0, factor[6])]
    holds = [hold(TRUTH, machine, random, top=top, ramp=ramp, factor=own, rate=10.0) for top, ramp, own in held]
    loops = [cycles(TRUTH, machine, random, top=top, ramp=ramp, factor=own) for top, ramp, own in cycled]
    return [*holds[:2], *loops[:3], holds[2], loops[3]]


def read(made: Record, name: str, slack: str | None) -> MeasuredTest:
    """A test as `calibrate` reads it."""
    test = replace(made.test(name), slack=slack)
    return replace(test, left_out=ringing(test) | loaded_at_rest(test))


def main() -> None:
    """Print a line for each laboratory and each rule."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--laboratories", type=int, default=2)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--pushes", action="store_true", help="fit slack specimens that push as well")
    options = parser.parse_args()
    print("laboratory  slack          fitted  predicted  put in  ratio  slack points: found, made  ringing: left out, made")
    for seed in range(options.first, options.first + options.laboratories):
        made = measured(seed)
        for slack in ("bears nothing", "pushes") if options.pushes else ("bears nothing",):
            tests = [read(each, f"{k}", slack) for k, each in enumerate(made)]
            material = fit_material(START, tests[:FITTED], FREE, starts=2).material
            true, found = zip(*Laboratory(tests).answers([TRUTH, material]), strict=True)
            parts = (slice(0, FITTED), slice(FITTED, None))
            misses = [answer - test.stress for answer, test in zip(found, tests, strict=True)]
            fitted, predicted = (relative_error(tests[part], misses[part]) for part in parts)
            # what the true material misses of specimens that differ from those of the fit
            factors = [each.clean.max() / AREA / answer.max() for each, answer in zip(made, true, strict=True)]
            level = np.exp(np.mean(np.log(factors[:FITTED])))
            misses = [level * answer - test.stress for answer, test in zip(true, tests, strict=True)]
            put_in = relative_error(tests[FITTED:], misses[FITTED:])
            loose = [(int(np.sum(one[1:] == 0)), int(np.sum(other[1:] == 0))) for one, other in zip(found, true, strict=True)]
            left = [(test.unused.shape[1], int(np.sum(each.disturbed))) for test, each in zip(tests, made, strict=True)]
            errors = f"{100 * fitted:6.1f} %  {100 * predicted:7.1f} %  {100 * put_in:4.1f} %  {predicted / put_in:5.2f}"
            print(f"{seed:10d}  {slack:13s}  {errors}  {loose}  {left}", flush=True)


if __name__ == "__main__":
    main()
