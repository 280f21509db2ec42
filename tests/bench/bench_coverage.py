"""How often 90 % intervals of shift factors, C1 and C2 hold the truth, over regimes of synthetic laboratories; see `laboratories`.

    python tests/bench/bench_coverage.py [--experiments N] [--first SEED] [--only WORDS] [--draws N] [--details]

Shift factors: accepted ones whose interval holds the truth; the lowest share of one temperature (of those accepted in at least a
sixth of the experiments); stated over actual error (root mean squares of each temperature: geometric mean, least and most; and one
over the root mean square of the errors in standard errors); refused temperatures of an experiment; the share of sets with a
warning, with one that is not about a temperature refused or a plateau that was not reached, and with the key of the ramp.

C1 and C2: intervals that hold the truth, that of the process that relaxes in the middle of the test at most of the temperatures;
`either`: both hold the constants of either process, or a value between; stated over actual error (medians: a few sets tell next to
nothing of C2, and a root mean square is theirs); the actual error of C1 (root mean square); and the share of experiments with a law
whose C2 is determined. With `--draws`, the scatter of the draws of shift
factors (geometric mean over temperatures), C1 and C2 over the standard error, in every third experiment.

`--experiments 60 --first 7000` (two processes: 40): held, worst temperature, ratio; C1, C2 held, their ratios; sets warned
noise 0.1, 0.5, 2 %            90, 92, 94 %; 78, 85, 88 %; 1.02, 1.19, 1.15; 95 to 98 %; 1.0 to 1.3; 0, 2, 18 %
12, 120 points                 92, 88 %; 85, 83 %; 1.15, 1.25; 93 and 95, 90 %; 0.8 to 1.0; 2, 3 %
5, 28 temperatures             97, 89 %; 95, 83 %; 1.20, 1.11; 95 and 97, 92 %; 1.1 to 1.4; 3, 2 %
creep, sweeps                  91, 91 %; 83, 85 %; 1.01, 0.99; 92 to 97 %; 1.0 to 1.5; 25, 27 %
thermometer, drift, tilt       88, 93, 93 %; 80, 90, 88 %; 0.95, 1.24, 1.11; 90 to 98 %; 0.7 to 1.4; 2, 18, 12 %
drift not stated               89 %; 73 %; 1.05; 83 %; 0.6, 0.7; 53 %
plateau short by 20, 40 K      89, 89 %; 85, 85 %; 0.97, 1.01; 93 to 95 %; 1.1, 1.2; 100, 100 % (true)
two processes, +3, +10, -10 %  77, 82, 81 %; 36, 26, 25 %; C1 92, 90, 95 %, C2 90, 90, 78 %; 55, 62, 85 %
With a drift that may be there unstated, and a ramp taken out to second order, `--first 16000`; ramps of 24 experiments:
noise 0.5 %                    89 %; 85 %; 1.23; 92, 92 %; 1.0, 1.0; 2 %
drift not stated               91 %; 83 %; 1.28; C1 95, C2 92 %; 0.8, 0.9; 50 %
ramp 1 s over the strain, from its end on, creep; 0.4 s: 92, 86, 93, 91 %; 87, 75, 88, 83 %; C1 96, 92, 96, 83, C2 96, 96, 92, 88 %
Seeds 12100 to 12139, two processes, +3, +10, -10, +20 %: C1 92, 98, 100, 98 %, C2 88, 98, 92, 98 %.
Seeds 15000 to 15023, ramp 0.4 s, recorded from 1 s on, which is named and left in: 100 %, 100 %; 4.4 temperatures refused.
80 experiments each, `--first 51000`: ramp 1 s and 0.4 s over the strain: 92, 90 %; 84, 84 %; C1 95, 96, C2 96, 99 %, so that
C1 in 83 % of 24 was chance. `--first 52000`, two processes, +3, +10, -10, +20 %: C1 89, 98, 100, 96 %, C2 81, 96, 96, 95 %.
Curves of one experiment share their errors, so that 24 experiments tell a share only to about 5 %: of seeds 9000 to 9007, C1 is
held in 62 % without any ramp.
All regimes again, of 60 experiments each, `--first 70000`: shift factors held 89 to 97 %, the worst temperature 78 to 92 %, stated
over actual error 1.00 to 1.40; C1 and C2 held 90 to 98 %. Sets warned: noise 0.1 and 0.5 %, 120 points, 28 temperatures and
thermometer 0; 12 points 5, 5 temperatures 7 %; noise 2 % 22, a stated drift 13, tilt 15 %, all for a temperature refused; creep 25,
sweeps 28 %, for a plateau that was not reached; a drift not stated 62 %.
Of the sets with noise of 2 % and with a stated drift, all but a few that are warned of are stretched exponentials, whose coldest
curve changes by less than 2 % a decade: its shift factor is not determined.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections import Counter
from dataclasses import dataclass

import numpy as np
from laboratories import CLEAN, REGIMES, Array, Laboratory, measure, true_laws, true_shift

from dielast.base.errors import DielastError, DielastWarning
from dielast.numerics.robust import robust_deviation
from dielast.relaxation.superposition.bootstrap import bootstrap_master_curve
from dielast.relaxation.superposition.mastercurve import build_master_curve

WIDTH = 1.645  # standard errors of a 90 % interval
LEGITIMATE = ("is not determined", "no plateau", "extrapolated")
HEADS = ("held", "worst", "ratio", "least", "most", "1/rms", "refuse", "warn", "other", "ramp", "rms", "ms")
HEADS += ("C1", "C2", "either", "C1", "C2", "error", "known")


@dataclass(frozen=True)
class Outcome:
    """Errors (m,) of the shift factors and their standard errors, NaN if refused or reference; relative errors of C1 and C2, those
    that the other process would give, and their standard errors, NaN without a law; scatter of draws over standard error (m + 2,).
    """

    error: Array
    stderr: Array
    constants: Array
    other: Array
    constants_stderr: Array
    warned: tuple[str, ...]
    drawn: Array | None
    seconds: float


def outcome(laboratory: Laboratory, seed: int, draws: int) -> Outcome:
    """One experiment, shifted."""
    curves, truth, laws = measure(laboratory, seed), true_shift(laboratory, seed), true_laws(laboratory, seed)
    none, nothing = np.full(truth.size, np.nan), np.full(2, np.nan)
    begin = time.perf_counter()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DielastWarning)
        try:
            master = build_master_curve(curves, reference_temperature=laboratory.reference, **laboratory.stated)
        except DielastError as refused:
            said = (f"refused: {refused}", *(str(each.message) for each in caught))
            return Outcome(none, none, nothing, nothing, nothing, said, None, time.perf_counter() - begin)
    seconds = time.perf_counter() - begin
    at = np.searchsorted(laboratory.temperature[::-1], master.temperature)
    error, stderr = none.copy(), none.copy()
    moved = (master.temperature != laboratory.reference) & np.isfinite(master.log10_shift_factor)
    error[at[moved]] = master.log10_shift_factor[moved] - truth[at[moved]]
    stderr[at[moved]] = master.log10_shift_factor_stderr[moved]
    fitted, width = (np.array([each[key] for key in ("C1", "C2")]) for each in (master.law_parameters, master.law_stderr))
    constants, other = ((fitted - [law.C1, law.C2]) / [laws[0].C1, laws[0].C2] for law in laws)
    drawn = None
    if draws and seed % 3 == 0:
        ensemble = bootstrap_master_curve(curves, master, draws=draws)
        drawn = np.append(none, np.std(ensemble.law_parameters, axis=0, ddof=1) / width)
        drawn[at[moved]] = np.std(ensemble.log10_shift_factor, axis=0, ddof=1)[moved] / stderr[at[moved]]
    said = tuple(str(each.message) for each in caught)
    return Outcome(error, stderr, constants, other, width / [laws[0].C1, laws[0].C2], said, drawn, seconds)


def row(name: str, outcomes: list[Outcome], laboratory: Laboratory, details: bool) -> None:
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
    of_ramp = [any("ramp =" in words for words in each.warned) for each in outcomes]
    line = (
        f"{name:<28}{held.sum() / known.sum():6.0%}{share[often].min():6.0%}{np.exp(np.mean(np.log(ratio))):6.2f}"
        f"{ratio.min():6.2f}{ratio.max():6.2f}{np.sqrt(known.sum() / np.sum(score**2)):6.2f}"
        f"{np.mean(np.sum(~known, axis=1) - 1):6.2f}{np.mean([bool(e.warned) for e in outcomes]):6.0%}"
        f"{np.mean([bool(u) for u in unusual]):6.0%}{np.mean(of_ramp):6.0%}{np.median(rms[1]):6.3f}"
        f"{np.median([e.seconds for e in outcomes]) * 1e3:6.0f}  "
    )
    off, other, width = (np.array([getattr(each, key) for each in outcomes]) for key in ("constants", "other", "constants_stderr"))
    certain = np.all(np.isfinite(off) & np.isfinite(width), axis=1)
    off, other, width = off[certain], other[certain], width[certain]
    inside = np.abs(off) <= WIDTH * width
    either = np.all(inside | (np.abs(other) <= WIDTH * width) | (off * other < 0), axis=1)
    actual = np.sqrt(np.mean(off**2, axis=0))
    line += "".join(f"{value:6.0%}" for value in (*np.mean(inside, axis=0), np.mean(either)))
    line += "".join(f"{np.median(width[:, k]) / robust_deviation(off[:, k]):6.2f}" for k in range(2))
    line += f"{actual[0]:6.1%}{np.mean(certain):6.0%}"
    scatter = np.array([each.drawn for each in outcomes if each.drawn is not None])
    if scatter.size:
        scatter = np.where(np.isfinite(scatter) & (scatter > 0), scatter, np.nan)  # 0 over an infinite error
        line += "  " + "".join(f"{np.exp(np.nanmean(np.log(part))):6.2f}" for part in (scatter[:, :-2], *scatter.T[-2:]))
    print(line, flush=True)
    if details:
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
    parser.add_argument("--details", action="store_true")
    options = parser.parse_args()
    print(f"{options.experiments} experiments of each regime; the first {len(CLEAN)} regimes have noise alone")
    print(f"{'':<28}{'shift factors':<74}{'held:':<18}{'ratio:':<24}" + ("draws: log a, C1, C2" if options.draws else ""))
    print(f"{'regime':<28}" + "".join(f"{head:>6}" for head in HEADS[:12]) + "  " + "".join(f"{head:>6}" for head in HEADS[12:]))
    for name, laboratory in REGIMES.items():
        if options.only and not any(word in name for word in options.only.split(",")):
            continue
        seeds = range(options.first, options.first + options.experiments)
        row(name, [outcome(laboratory, seed, options.draws) for seed in seeds], laboratory, options.details)


if __name__ == "__main__":
    main()
