"""How far default shift factors of synthetic entangled melts are off, all temperatures and one left out.

python tests/bench/bench_melts.py [--melts N] [--first SEED] [--on auto|moduli|tan-delta|storage]

Melts 0 to 219 on auto, 415 runs in parts of 55: largest errors 0.057, 0.109, 0.048, 0.049 decade; 90 % intervals hold 92, 90, 88,
91 %; errors in standard errors 0.97, 1.00, 1.04, 0.96 rms. The 0.109 is melt 91 without one temperature.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from melts import melt

from dielast.base.errors import DielastWarning
from dielast.relaxation.superposition.mastercurve import build_master_curve


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--melts", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--on", default="auto", choices=["auto", "moduli", "tan-delta", "storage"])
    options = parser.parse_args()
    warnings.simplefilter("ignore", DielastWarning)
    worst: list[tuple[float, int, bool, str]] = []
    off: list[np.ndarray] = []
    score: list[np.ndarray] = []
    undetermined, begin = 0, time.perf_counter()
    for seed in range(options.first, options.first + options.melts):
        whole = melt(seed)
        for made, left in [(whole, False)] + ([(melt(seed, seed), True)] if len(whole.sweeps) > 3 else []):
            master = build_master_curve(made.sweeps, reference_temperature=made.reference, on=options.on, temperature_stderr=0.0)
            error = np.abs(master.log10_shift_factor - made.shift)
            known = np.isfinite(error) & (made.temperature != made.reference)
            undetermined += int(np.count_nonzero(~np.isfinite(error)))
            off.append(error[known])
            score.append(error[known] / master.log10_shift_factor_stderr[known])
            worst.append((float(error[known].max(initial=0.0)), seed, left, master.shifted_on))
    runs = np.array([entry[0] for entry in worst])
    points, scores = np.concatenate(off), np.concatenate(score)
    spent = (time.perf_counter() - begin) / runs.size
    print(
        f"{runs.size} runs of {options.melts} melts, on {options.on}, {1e3 * spent:.0f} ms each; {undetermined} shifts undetermined"
    )
    print(f"runs off by more than 0.15 decade: {np.mean(runs > 0.15):.2%}, within 0.05: {np.mean(runs <= 0.05):.2%}")
    print(f"shift factors within 0.05 decade: {np.mean(points <= 0.05):.2%}; largest error {points.max():.3f}")
    print(f"errors in standard errors: rms {np.sqrt(np.mean(scores**2)):.2f}, 90 % intervals hold {np.mean(scores < 1.645):.1%}")
    for error, seed, left, on in sorted(worst, reverse=True)[:8]:
        print(f"  {error:.3f} decade: melt {seed}{' without one temperature' if left else ''}, shifted on {on}")


if __name__ == "__main__":
    main()
