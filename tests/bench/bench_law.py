"""How often 90 % intervals of C1 and C2 hold the truth: regimes of synthetic laboratories, ramps left in, and two processes.

    python tests/bench/bench_law.py [--experiments N] [--first SEED] [--only WORDS] [--warnings]

Where there are two processes with two laws, C1 and C2 are those of the process that relaxes in the middle of the test at most of
the temperatures; `either` counts the intervals that hold the constants of either, or a value between. A set counts as `named` if a
warning states the key of the ramp.
"""

from __future__ import annotations

import argparse
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from laboratories import REGIMES, Array, Laboratory, measure, truth_of

from dielast.errors import DielastError, DielastWarning
from dielast.material.measurement import Measurement, RelaxationCurve
from dielast.material.shift import WLF
from dielast.superposition.mastercurve import build_master_curve

WIDTH = 1.645  # standard errors of a 90 % interval


@dataclass(frozen=True)
class Flaw:
    """A ramp of a duration in s that is left in, recorded from `first` s on, as stress over the final strain or over that of the
    moment; and slow processes whose log10 a is larger by the factor 1 + `slow`."""

    ramp: float = 0.0
    first: float = 0.1
    over_final: bool = False
    slow: float = 0.0
    noise: float = 0.005
    thermometer: float = 0.0


FLAWS = {
    "ramp 1 s, from its end on": Flaw(ramp=1.0, first=1.0),
    "ramp 1 s, over the strain": Flaw(ramp=1.0),
    "ramp 1 s, over the last strain": Flaw(ramp=1.0, over_final=True),
    "ramp 0.2 s, over the strain": Flaw(ramp=0.2),
    "two processes, +3 %": Flaw(slow=0.03),
    "two processes, +10 %": Flaw(slow=0.10),
    "two processes, -10 %": Flaw(slow=-0.10),
    "two processes, +20 %": Flaw(slow=0.20),
}


def flawed(flaw: Flaw, seed: int) -> list[Measurement]:
    """Relaxation tests at 14 temperatures with the flaw, the hottest first."""
    truth, noise, random = truth_of(seed), np.random.default_rng([43, seed]), np.random.default_rng([44, seed])
    tau, moduli = truth.spectrum.relaxation_time, truth.spectrum.shear_modulus
    slow = np.log10(tau) > border(seed)
    time = np.geomspace(flaw.first, 1200.0, 62)
    curves: list[Measurement] = []
    for at in Laboratory().temperature.tolist():
        log_factor = float(truth.law.log10_shift_factor(at + flaw.thermometer * random.standard_normal()))
        here = tau * 10 ** (log_factor * np.where(slow, 1 + flaw.slow, 1.0))
        if flaw.ramp:  # the stress of a ramp is the integral of the modulus over the ages of its parts
            ramped = np.minimum(time, flaw.ramp)
            modulus = (
                _area(here, moduli, truth.equilibrium_modulus, time) - _area(here, moduli, truth.equilibrium_modulus, time - ramped)
            ) / (flaw.ramp if flaw.over_final else ramped)
        else:
            modulus = truth.equilibrium_modulus + np.exp(-time[:, None] / here) @ moduli
        curves.append(RelaxationCurve(at, time, 3 * modulus * (1 + flaw.noise * noise.standard_normal(time.size))))
    return curves


def border(seed: int) -> float:
    """log10 of the time in s at 20 degC that separates fast from slow processes."""
    return float(np.random.default_rng([45, seed]).uniform(-5.0, 0.0))


def slow_ones_matter(seed: int) -> bool:
    """Whether the slow processes relax in the middle of the test at most of the temperatures."""
    middle = np.log10(0.1 * 1200.0) / 2
    return bool(np.median(truth_of(seed).law.log10_shift_factor(Laboratory().temperature)) + border(seed) < middle)


def _area(tau: Array, moduli: Array, level: float, time: Array) -> Array:
    return np.asarray(level * time - np.expm1(-time[:, None] / tau) @ (tau * moduli))


def experiments(
    options: argparse.Namespace,
) -> Iterator[tuple[str, Callable[[int], list[Measurement]], dict[str, float], float, float]]:
    """The name of each regime, its measurements, the errors stated, the reference temperature, the change of slow log a."""
    for name, laboratory in REGIMES.items():
        yield name, lambda seed, lab=laboratory: measure(lab, seed), laboratory.stated, laboratory.reference, 0.0  # type: ignore[misc]
    for name, flaw in FLAWS.items():
        yield (
            name,
            lambda seed, flaw=flaw: flawed(flaw, seed),
            {"temperature_stderr": flaw.thermometer},
            Laboratory().reference,
            flaw.slow,
        )  # type: ignore[misc]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--experiments", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--warnings", action="store_true")
    options = parser.parse_args()
    print(
        f"{'regime':<31}{'C1':>6}{'C2':>6}{'stated/actual':>14}{'actual':>8}{'misfit':>8}{'spread':>8}{'sure':>6}{'named':>7}{'none':>6}{'either':>8}"
    )
    for name, made, stated, reference, slow in experiments(options):
        if options.only and not any(word in name for word in options.only.split(",")):
            continue
        error, stderr, misfit, spread, named, none, said, either = [], [], [], [], 0, 0, Counter[str](), []
        for seed in range(options.first, options.first + options.experiments):
            law = truth_of(seed).law
            moved = law.C2 + reference - law.reference_temperature
            truth = WLF(reference, law.C1 * law.C2 / moved, moved)
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", DielastWarning)
                try:
                    master = build_master_curve(made(seed), reference_temperature=reference, **stated)
                except DielastError:
                    none += 1
                    named += any("ramp =" in str(each.message) for each in caught)
                    continue
            texts = [str(each.message) for each in caught]
            said.update(" ".join(text.split()[:10]) for text in texts)
            named += any("ramp =" in text for text in texts)
            found, width = (
                np.array([values[key] for key in ("C1", "C2")]) for values in (master.law_parameters, master.law_stderr)
            )
            constants = np.array([truth.C1, truth.C2])
            other = constants * [1 + slow, 1.0]
            if slow_ones_matter(seed):
                constants, other = other, constants
            error.append(found / constants - 1)
            stderr.append(width / constants)
            either.append(
                np.all(
                    (found - WIDTH * width < np.maximum(constants, other)) & (found + WIDTH * width > np.minimum(constants, other))
                )
            )
            misfit.append(master.shift_fit.misfit)
            spread.append(master.shift_fit.spread)
        e, s = np.array(error), np.array(stderr)
        held, known = np.mean(np.abs(e) < WIDTH * s, axis=0), np.isfinite(s).all(axis=1)
        ratio = np.sqrt(np.mean(s[known] ** 2, axis=0) / np.mean(e[known] ** 2, axis=0))
        print(
            f"{name:<31}{held[0]:6.0%}{held[1]:6.0%}{ratio[0]:8.2f}{ratio[1]:6.2f}{np.sqrt(np.mean(e[known, 0] ** 2)):8.2%}"
            f"{np.median(misfit):8.2f}{np.median(spread):8.3f}{np.mean(known):6.0%}{named / options.experiments:7.0%}"
            f"{none / options.experiments:6.0%}{np.mean(either):8.0%}",
            flush=True,
        )
        if options.warnings:
            for words, times in said.most_common(6):
                print(f"{times:>8d} x {words}")


if __name__ == "__main__":
    main()
