"""How often 90 % intervals of the equilibrium modulus and of lives at constant voltage hold the truth, plateau reached or not.

    python tests/bench/bench_plateau.py [--experiments N] [--first SEED] [--draws N] [--chain] [--noise SHARE]

By default the master curve is made with the true shift factors, so that its noise is its only error; with `--chain`, shift factors
are fitted and drawn, and the shapes of the laboratories take turns. The ratio is that of stated half widths over 1.645 to actual
errors, both of the logarithm, as root mean squares; an error is counted as three half widths at most.

Seeds used for nothing before, 48 experiments each (62000 on): plateau reached, mu_eq held 90 %, lives 90 %; short by 20 K, 96 and
92 %; short by 40 K, 94 and 81 %, and 93 and 88 % in 72 more (63000 to 63071). Of 24 each (55000, 53000, 54000 on): 83 and 94, 100
and 94, 100 and 94 %. Of 140 curves whose plateau was reached (42000, 55000, 58000 on), the 90 % interval of `likely_levels` alone
holds mu_eq in 93 %. Of its 10 misses, it is below mu_eq in 9.
With draws that are refits of noisy curves alone, mu_eq held 62 % (20000 to 20031), as no modulus is negative: noise lowers
mu_eq in the fit, and once more in such draws. A signed root taken for standard normal held 100 % (31000 to 31024), 2.3 % wide.
Short by 40 K, reflected draws held 75 % of the lives.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from laboratories import LONGEST, SHORTEST, Laboratory, Truth, measure, truth_of

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from flat import failure_map, plan_failure_map
from synthetic import TRUTH

from dielast.base.errors import DielastError, DielastWarning
from dielast.material.intervals import interval
from dielast.material.material import Breakdown, Material
from dielast.material.scatter import draw_sample
from dielast.material.shift import WLF
from dielast.material.spectrum import Spectrum
from dielast.relaxation.beyond import end_of
from dielast.relaxation.fit import fit_spectrum
from dielast.relaxation.result import SpectrumFit
from dielast.relaxation.spectrum_draws import CurveDraws, draw_spectra
from dielast.relaxation.superposition.bootstrap import bootstrap_master_curve
from dielast.relaxation.superposition.mastercurve import build_master_curve
from dielast.simulate.failure_map import solve_map

HOTTEST = {"plateau reached": 60.0, "not reached by 20 K": 40.0, "not reached by 40 K": 20.0}


def map_of(truth: Truth) -> dict[str, Any]:
    """Three voltages at which a film of the true material fails after about 30 s to 1 day at 20 degC."""
    scale = np.sqrt(float(truth.spectrum.relaxation_modulus(np.array([1e3]), truth.equilibrium_modulus)[0]) / 45e3)
    return {
        "voltage": [3.6e3 * scale, 4.0e3 * scale],
        "prestretch": [1.9],
        "temperature": [20.0],
        "thickness": 5e-4,
        "horizon": 1e7,
        "relax": 5400.0,
    }


def experiment(seed: int, hottest: float, noise: float, draws: int, chain: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """Bounds, truth and central values of the equilibrium modulus and the lives, and whether the end was found open."""
    laboratory, truth = Laboratory(hottest=hottest, noise=noise), truth_of(seed)
    curves = measure(laboratory, seed)
    field = 48e6 * np.sqrt(float(truth.spectrum.relaxation_modulus(np.array([1e3]), truth.equilibrium_modulus)[0]) / 45e3)
    material = replace(
        TRUTH,
        equilibrium_modulus=truth.equilibrium_modulus,
        spectrum=truth.spectrum,
        breakdown=Breakdown((1.0, 3.0), (field, field)),
    )
    laws: list[WLF]
    if chain:
        master = build_master_curve(curves, reference_temperature=20.0)
        drawn = bootstrap_master_curve(curves, master, draws=draws)
        abscissa, ordinates = master.reduced_abscissa, master.ordinates
        smooth = CurveDraws(drawn.smooth_abscissa, drawn.smooth_ordinates)
        law, laws = master.law, [WLF(20.0, *row) for row in drawn.law_parameters]
    else:
        law, laws = truth.law, [truth.law] * draws
        shift = [10 ** float(law.log10_shift_factor(curve.temperature)) for curve in curves]
        time = np.concatenate([curve.time / factor for curve, factor in zip(curves, shift, strict=True)])
        modulus = np.concatenate([curve.modulus for curve in curves])
        order = np.argsort(time)
        abscissa, ordinates = time[order], modulus[None, order]
        # each point moves as its noise allows, and so does the fit
        scatter = np.random.default_rng([43, seed]).standard_normal((draws, 1, abscissa.size))
        smooth = CurveDraws(abscissa, ordinates * (1 + noise * scatter))
    fit = fit_spectrum(abscissa, ordinates[0])
    tau = fit.spectrum.relaxation_time

    def refit(time: np.ndarray, values: np.ndarray) -> SpectrumFit:
        return fit_spectrum(time, values[0], relaxation_time=(float(tau[-1]), float(tau[0])))

    end = end_of(fit)
    shown = end.carried_on()
    spectra = draw_spectra(abscissa, ordinates, smooth, fit, refit, open_end=not end.reached)

    def film(level: float, moduli: np.ndarray, times: np.ndarray, shift: Any) -> Material:
        return replace(material, equilibrium_modulus=float(level), spectrum=Spectrum(times, moduli), shift=shift)

    members = [
        film(level, moduli, spectra.relaxation_time, laws[k])
        for k, level, moduli in zip(spectra.used, spectra.equilibrium_modulus, spectra.shear_modulus, strict=True)
    ]
    found = film(shown.equilibrium_shear_modulus, shown.spectrum.shear_modulus, shown.spectrum.relaxation_time, law)
    where = map_of(truth)
    main, *each = solve_map(plan_failure_map(found, sample=draw_sample(members, len(members)), **where))

    def lives(result: Any) -> np.ndarray:
        return np.nan_to_num(result.time_to_failure.ravel(), nan=np.inf)

    rows = np.array([[own.equilibrium_modulus, *lives(one)] for own, one in zip(members, each, strict=True)])
    bounds = np.array(interval(rows, 0.9))
    right = np.array([truth.equilibrium_modulus, *lives(failure_map(material, **where))])
    return bounds, right, np.array([found.equilibrium_modulus, *lives(main)]), not end.reached


def main() -> None:
    """Print coverage, ratios and widths for each regime."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--experiments", type=int, default=12)
    parser.add_argument("--first", type=int, default=0, help="seed of the first experiment")
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--noise", type=float, default=0.005)
    parser.add_argument("--chain", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore", DielastWarning)
    print(f"tests of {SHORTEST:g} to {LONGEST:g} s, noise {options.noise:.1%}, {options.draws} draws, medians of all experiments")
    print(f"{'regime':22}{'of':>10}{'held':>7}{'ratio':>7}{'found/truth':>13}{'lower/truth':>13}{'upper/truth':>13}{'open':>6}")
    for regime, hottest in HOTTEST.items():
        results = []
        for seed in range(options.first, options.first + options.experiments):
            try:
                results.append(experiment(seed, hottest, options.noise, options.draws, options.chain))
            except DielastError as reason:
                print(f"{regime}, seed {seed}: {reason}")
        bounds, right, found = (np.array([row[k] for row in results]) for k in range(3))
        is_open = np.mean([row[3] for row in results])
        with np.errstate(divide="ignore", invalid="ignore"):
            for name, k in (("mu_eq", slice(0, 1)), ("lives", slice(1, None))):
                low, high, true, mid = bounds[:, 0, k], bounds[:, 1, k], right[:, k], found[:, k]
                held = (low <= true) & (true <= high)
                half = np.log(high / np.maximum(low, 1e-3 * true)) / 2
                off = np.abs(np.log(np.sqrt(high * np.maximum(low, 1e-3 * true)) / true))
                fine = np.isfinite(half) & np.isfinite(off) & (half > 0)
                capped = np.minimum(off[fine], 3 * half[fine])
                ratio = np.sqrt(np.mean((half[fine] / 1.645) ** 2) / np.mean(capped**2))
                medians = [np.median(each / true) for each in (mid, low, high)]
                numbers = "".join(f"{value:13.3f}" for value in medians)
                print(f"{regime:22}{name:>10}{held.mean():7.0%}{ratio:7.2f}{numbers}{is_open:6.0%}", flush=True)


if __name__ == "__main__":
    main()
