"""How often 90 % intervals of the time to failure hold the truth, over synthetic experiments through the whole chain.

    python tests/bench/bench_calibration.py [--experiments N] [--draws N] [--method nnls|schwarzl-staverman] [--first SEED]
        [--thermometer K] [--walk SHARE] [--tilt SHARE]

Each experiment measures relaxation at 11 temperatures with 1 % noise, shifts, fits a spectrum and maps the time to failure. Each
temperature may be off by some K, the modulus may walk from one temperature to the next, and curves may be tilted from end to end;
thermometer and walk are stated, the tilt is not. Intervals of the shift factors, of C1 and of C2 are counted, too.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from flat import failure_map
from synthetic import MAP, TRUTH, Flaws, experiment


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--experiments", type=int, default=100)
    parser.add_argument("--draws", type=int, default=60)
    parser.add_argument("--method", default="nnls", choices=["nnls", "schwarzl-staverman"])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--thermometer", type=float, default=0.0)
    parser.add_argument("--walk", type=float, default=0.0)
    parser.add_argument("--tilt", type=float, default=0.0)
    options = parser.parse_args()
    flaws = Flaws(options.thermometer, options.walk, options.tilt)
    seeds = range(options.first, options.first + options.experiments)
    results = [experiment(seed, options.method, options.draws, flaws=flaws) for seed in seeds]
    held = np.array([each.held for each in results])
    truth = failure_map(TRUTH, **MAP).time_to_failure
    off = np.log([each.found / truth for each in results])
    width = np.log([each.upper / each.lower for each in results])
    print(
        f"{options.method}: {len(results)} experiments of {options.draws} draws: 90 % intervals hold the truth in {held.mean():.1%}"
    )
    shifts, by_fit, by_draws = (
        np.array([getattr(each, name) for each in results]).mean(axis=0)
        for name in ("shifts_held", "law_held_by_fit", "law_held_by_draws")
    )
    print(f"shift factors: {shifts.mean():.1%}, by temperature {shifts.min():.0%} to {shifts.max():.0%}")
    print(f"C1, C2: {by_fit[0]:.0%}, {by_fit[1]:.0%} by standard errors, {by_draws[0]:.0%}, {by_draws[1]:.0%} by the draws")
    print(f"{'T [degC]':>9}{'prestretch':>11}{'V [kV]':>8}{'held':>8}{'error rms':>11}{'bias':>8}{'half width':>12}")
    for index in np.ndindex(truth.shape):
        here = (slice(None), *index)
        place = f"{MAP['temperature'][index[0]]:9g}{MAP['prestretch'][index[1]]:11g}{MAP['voltage'][index[2]] / 1e3:8g}"
        spread = f"{np.sqrt(np.mean(off[here] ** 2)):11.2%}{off[here].mean():8.2%}{width[here].mean() / 2:12.2%}"
        print(f"{place}{held[here].mean():8.1%}{spread}")


if __name__ == "__main__":
    main()
