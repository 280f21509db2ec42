"""How often 90 % intervals hold the truth, over regimes of synthetic laboratories; see `laboratories`.

    python tests/bench/bench_coverage.py [--experiments N] [--first SEED] [--only WORDS] [--draws N] [--by-temperature]

Shift factors: accepted ones whose interval holds the truth; the lowest share of one temperature (of those accepted in at least a
sixth of the experiments); stated over actual error (root mean squares of each temperature: geometric mean, least and most; and one
over the root mean square of the errors in standard errors); refused temperatures of an experiment; the share of sets with a
warning, and with one that is not about a temperature refused or a plateau that was not reached. With `--draws`, the scatter of the
draws over the standard error (geometric mean over temperatures), in every third experiment.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections import Counter
from dataclasses import dataclass

import numpy as np
from laboratories import CLEAN, REGIMES, Array, Laboratory, measure, true_shift

from dielast.errors import DielastError, DielastWarning
from dielast.superposition.bootstrap import bootstrap_master_curve
from dielast.superposition.mastercurve import build_master_curve

WIDTH = 1.645  # standard errors of a 90 % interval
LEGITIMATE = ("is not determined", "no plateau", "extrapolated")


@dataclass(frozen=True)
class Outcome:
    """Errors (m,) of the shift factors and their standard errors, NaN if refused or reference; warnings; scatter of draws (m,)."""

    error: Array
    stderr: Array
    warned: tuple[str, ...]
    drawn: Array | None
    seconds: float


def outcome(laboratory: Laboratory, seed: int, draws: int) -> Outcome:
    """One experiment, shifted."""
    curves, truth = measure(laboratory, seed), true_shift(laboratory, seed)
    none = np.full(truth.size, np.nan)
    begin = time.perf_counter()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DielastWarning)
        try:
            master = build_master_curve(curves, reference_temperature=laboratory.reference, **laboratory.stated)
        except DielastError as refused:
            return Outcome(none, none, (f"refused: {refused}",), None, time.perf_counter() - begin)
    seconds = time.perf_counter() - begin
    at = np.searchsorted(laboratory.temperature[::-1], master.temperature)
    error, stderr = none.copy(), none.copy()
    moved = (master.temperature != laboratory.reference) & np.isfinite(master.log10_shift_factor)
    error[at[moved]] = master.log10_shift_factor[moved] - truth[at[moved]]
    stderr[at[moved]] = master.log10_shift_factor_stderr[moved]
    drawn = None
    if draws and seed % 3 == 0:
        ensemble = bootstrap_master_curve(curves, master, draws=draws)
        drawn = none.copy()
        drawn[at] = np.std(ensemble.log10_shift_factor, axis=0, ddof=1)
    return Outcome(error, stderr, tuple(str(each.message) for each in caught), drawn, seconds)


def row(name: str, outcomes: list[Outcome], laboratory: Laboratory, by_temperature: bool) -> None:
    """Print the figures of one regime."""
    error, stderr = (np.array([getattr(each, key) for each in outcomes]) for key in ("error", "stderr"))
    known = np.isfinite(error) & np.isfinite(stderr)
    held = np.where(known, np.abs(error) <= WIDTH * stderr, False)
    count = known.sum(axis=0)
    often = count >= max(3, len(outcomes) // 6)
    share = held.sum(axis=0) / np.maximum(count, 1)
    rms = [np.sqrt(np.sum(np.where(known, x, 0) ** 2, axis=0) / np.maximum(count, 1))[often] for x in (stderr, error)]
    ratio = rms[0] / np.maximum(rms[1], 1e-12)
    score = np.where(known, error / np.where(known, stderr, 1), 0)
    unusual = [[w for w in each.warned if not any(word in w for word in LEGITIMATE)] for each in outcomes]
    line = (
        f"{name:<29}{held.sum() / known.sum():7.1%}{share[often].min():7.0%}{np.exp(np.mean(np.log(ratio))):7.2f}"
        f"{ratio.min():6.2f}{ratio.max():6.2f}{np.sqrt(known.sum() / np.sum(score**2)):7.2f}"
        f"{np.mean(np.sum(~known, axis=1) - 1):7.2f}{np.mean([bool(e.warned) for e in outcomes]):7.0%}"
        f"{np.mean([bool(u) for u in unusual]):7.0%}{np.median(rms[1]):9.4f}{np.median([e.seconds for e in outcomes]) * 1e3:7.0f}"
    )
    scatter = [each.drawn / each.stderr for each in outcomes if each.drawn is not None]
    if scatter:
        logs = np.log(np.array(scatter)[np.isfinite(scatter)])
        line += f"{np.exp(np.mean(logs)):7.2f}"
    print(line, flush=True)
    if by_temperature:
        for k in np.flatnonzero(often):
            one = [np.sqrt(np.sum(np.where(known[:, k], x[:, k], 0) ** 2) / count[k]) for x in (stderr, error)]
            place = f"{laboratory.temperature[::-1][k]:>12g} degC {share[k]:7.0%} of {count[k]:<4d}"
            print(f"{place} stated {one[0]:.4f}, actual {one[1]:.4f}")
        said = Counter(" ".join(w.split()[:14]) for u in unusual for w in u)
        for words, times in said.most_common(5):
            print(f"{times:>8d} x {words}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--experiments", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--draws", type=int, default=0)
    parser.add_argument("--by-temperature", action="store_true")
    options = parser.parse_args()
    print(f"{options.experiments} experiments of each regime; the first {len(CLEAN)} regimes have noise alone")
    print(
        f"{'regime':<29}{'held':>7}{'worst':>7}{'ratio':>7}{'least':>6}{'most':>6}{'1/rms':>7}{'refuse':>7}{'warn':>7}{'other':>7}"
        f"{'rms':>9}{'ms':>7}" + (f"{'draws':>7}" if options.draws else "")
    )
    for name, laboratory in REGIMES.items():
        if options.only and not any(word in name for word in options.only.split(",")):
            continue
        seeds = range(options.first, options.first + options.experiments)
        row(name, [outcome(laboratory, seed, options.draws) for seed in seeds], laboratory, options.by_temperature)


if __name__ == "__main__":
    main()
