"""Accuracy and cost of the spectrum fits, beside pyvisco on the same curve in the same run.

    python tests/bench/bench_spectrum.py CURVE.csv [--peer PYTHON]

CURVE.csv holds time (s) and Young's relaxation modulus (MPa) below two header rows; the one meant is the curve over 31 decades
of pyvisco's examples. PYTHON is an interpreter that has pyvisco; by default this one.
"""

from __future__ import annotations

import argparse
import functools
import json
import statistics
import subprocess
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from dielast import Plateaus
from dielast.material.shift import WLF
from dielast.material.spectrum import Spectrum
from dielast.relaxation.continuous import continuous_spectrum
from dielast.relaxation.creep import fit_creep
from dielast.relaxation.fit import fit_oscillation, fit_spectrum
from dielast.relaxation.interconversion import retardation_from_relaxation
from dielast.relaxation.reduce import reduce_spectrum

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from parts import timed

from reconstruction import EQUILIBRIUM_MODULUS, LOG_MODULUS, spectrum

TABLE_1 = {10: 39.7e6, 5: 0.110e6, 3: 0.0247e6}
ROUNDS = 5

PEER = """
import contextlib, io, json, sys, time
import numpy as np
try:
    from pyvisco import load, master, opt, prony
except ImportError:
    print(json.dumps(None)); sys.exit()
frame, units = load.user_master(load.file(sys.argv[1]), "time", 20, "E")
frame = master.smooth(frame, 1)
t, E = frame["t"].values, frame["E_relax"].values
def judge(series):
    terms = series["df_terms"]
    model = series["E_0"] * prony.E_relax_norm(t, terms["alpha_i"].values, terms["tau_i"].values)
    return len(terms), float(np.sqrt(np.mean((model / E - 1) ** 2)))
result = []
with contextlib.redirect_stdout(io.StringIO()):
    start = time.perf_counter()
    full = prony.fit_time(prony.discretize(frame), frame)
    result.append(("pyvisco, full", *judge(full), time.perf_counter() - start))
    if sys.argv[2] == "1":
        start = time.perf_counter()
        series, best, _ = opt.nprony(frame, full)
        result.append(("pyvisco, reduced", *judge(series[best]), time.perf_counter() - start))
print(json.dumps(result))
"""


def peer(python: str, curve: Path, reduced: bool) -> list[tuple[str, int, float, float]] | None:
    """Rows (label, terms, rms, seconds) from pyvisco, or None where it is not installed."""
    run = subprocess.run(
        [python, "-W", "ignore", "-c", PEER, str(curve), str(int(reduced))], capture_output=True, text=True, check=False
    )
    if run.returncode:
        sys.exit(f"pyvisco failed: {run.stderr.strip().splitlines()[-1]}")
    found = json.loads(run.stdout)
    return None if found is None else [(row[0], row[1], row[2], row[3]) for row in found]


def compare(curve: Path, python: str) -> None:
    """The measured curve: relative rms error and median time, interleaved with the peer's runs."""
    t, young = np.loadtxt(curve, delimiter=",", skiprows=2).T
    cases: dict[str, dict[str, Any]] = {"dielast, schwarzl-staverman": {}}
    cases |= {f"dielast, nnls {n}": {"method": "nnls", "branches": n} for n in (15, 19, 20, 31, 60, 100)}
    cases["dielast, nnls 31, ends given"] = {"method": "nnls", "branches": 31, "relaxation_time": (t.min(), t.max())}
    seconds: dict[str, list[float]] = {}
    figures: dict[str, tuple[int, float]] = {}
    installed = True
    for turn in range(ROUNDS + 1):
        for label, options in cases.items():
            fit, spent = timed(functools.partial(fit_spectrum, t, 1e6 * young, **options))
            figures[label] = fit.branches, fit.rms_relative_error
            if turn:  # the first turn pays for imports
                seconds.setdefault(label, []).append(spent)
        rows = peer(python, curve, reduced=turn == ROUNDS) if installed and turn else []
        installed = rows is not None
        for label, terms, rms, spent in rows or []:
            figures[label] = terms, rms
            seconds.setdefault(label, []).append(spent)
    medians = {label: statistics.median(spent) for label, spent in seconds.items()}
    slow = medians.get("pyvisco, full")
    print(f"{curve.name}: {t.size} points, {np.log10(t.max() / t.min()):.1f} decades, median of {ROUNDS}")
    print(f"{'':30}{'terms':>6}{'rms error':>12}{'time':>13}{'pyvisco full / this':>22}")
    for label, (terms, rms) in sorted(figures.items(), key=lambda item: medians[item[0]]):
        ratio = f"{slow / medians[label]:.1f}" if slow else "-"
        print(f"{label:30}{terms:6d}{rms:12.3%}{1e3 * medians[label]:10.1f} ms{ratio:>22}")
    if not installed:
        print("pyvisco: not installed")


def table_1() -> None:
    """Sums of the kept moduli on the reconstructed master curve of DOI 10.1115/1.4030850, exact and with 1 % of noise."""
    x = np.linspace(-7.4, 5.51, 400)
    young = 3 * 10 ** LOG_MODULUS(x)
    print("\nTable 1 of DOI 10.1115/1.4030850 from the reconstruction: sum of the moduli kept, MPa")
    print(f"{'keep':>6}{'paper':>12}{'exact':>12}{'1 % noise, 20 seeds: mean +- std':>38}")
    for keep, printed in TABLE_1.items():
        sums = []
        for seed in range(21):
            scatter = 1 + (0.01 if seed else 0.0) * np.random.default_rng(seed).standard_normal(x.size)
            fit = fit_spectrum(
                10**x,
                young * scatter,
                branches=13,
                relaxation_time=(3.98e-8, 1.59e4),
                plateaus=Plateaus(equilibrium_modulus=0.078e6, glassy_modulus=690e6),
                keep=keep,
            )
            sums.append(fit.spectrum.shear_modulus.sum() / 1e6)
        print(f"{keep:6d}{printed / 1e6:12.4g}{sums[0]:12.4g}{np.mean(sums[1:]):26.4g} +- {np.std(sums[1:]):.2g}")


def other_tests() -> None:
    """The relaxation that is predicted from an oscillation and from a creep curve of the reconstruction, both with 1 % of noise."""
    full, x = spectrum(), np.linspace(-7.4, 5.4, 200)
    noise = 1 + 0.01 * np.random.default_rng(1).standard_normal((3, x.size))
    frequency, truth = 10**-x, full.relaxation_modulus(10**x, EQUILIBRIUM_MODULUS)
    storage, loss = full.storage_modulus(frequency, EQUILIBRIUM_MODULUS), full.loss_modulus(frequency)
    compliance = retardation_from_relaxation(full, EQUILIBRIUM_MODULUS).creep_compliance(10**x)
    fits = {
        "relaxation": lambda: fit_spectrum(10**x, 3 * truth * noise[0], method="nnls"),
        "oscillation": lambda: fit_oscillation(frequency, 3 * storage * noise[0], 3 * loss * noise[1]),
        "creep": lambda: fit_creep(10**x, compliance * noise[2] / 3),
    }
    print("\nthe reconstruction's G(t) from 200 points with 1 % of noise, 30 branches")
    print(f"{'':14}{'rms error of the fit':>22}{'of G(t)':>10}{'continuous':>13}{'time':>12}")
    for label, fit in fits.items():
        result, spent = timed(fit)
        error = result.spectrum.relaxation_modulus(10**x, result.equilibrium_shear_modulus) / truth - 1
        smooth = "-" if label == "creep" else f"{continuous_spectrum(result).rms_relative_error:.2%}"
        rms = np.sqrt(np.mean(error**2))
        print(f"{label:14}{result.rms_relative_error:22.2%}{rms:10.2%}{smooth:>13}{1e3 * spent:9.1f} ms")


def reductions() -> None:
    """Branches that a window of one day needs, beside the truncated spectra of Table 1."""
    full, law, window = spectrum(), WLF(20.0, 13.7, 187.1), (1.0, 86400.0)
    share = np.geomspace(*window, 600)[:, None]

    def worst(some: Spectrum, temperature: float) -> float:
        moduli = (
            own.relaxation_modulus(share[:, 0] / 10 ** law.log10_shift_factor(temperature), EQUILIBRIUM_MODULUS)
            for own in (some, full)
        )
        return float(np.abs(next(moduli) / next(moduli) - 1).max())

    print("\nbranches over 1 s to 24 h, greatest relative error of G(t)")
    print(f"{'':34}{'branches':>9}{'20 degC':>10}{'60 degC':>10}{'time':>12}")
    for case, keep in ((3, 10), (4, 5), (5, 3)):
        cut = spectrum(13, 1.59e4).slowest(keep)
        print(f"{f'Table 1, case {case}':34}{keep:9d}{worst(cut, 20.0):10.2%}{worst(cut, 60.0):10.2%}{'-':>12}")
    for temperatures in ((20.0,), (20.0, 60.0)):
        for tolerance in (0.1, 0.04, 0.01, 0.001):
            start = time.perf_counter()
            found = reduce_spectrum(
                full, EQUILIBRIUM_MODULUS, law, window=window, temperatures=temperatures, tolerance=tolerance
            ).spectrum
            spent = time.perf_counter() - start
            label = f"within {tolerance:g} at {' and '.join(f'{own:g}' for own in temperatures)} degC"
            print(f"{label:34}{len(found):9d}{worst(found, 20.0):10.2%}{worst(found, 60.0):10.2%}{spent:10.2f} s")


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("curve", type=Path)
    parser.add_argument("--peer", default=sys.executable, metavar="PYTHON")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    compare(arguments.curve, arguments.peer)
    table_1()
    other_tests()
    reductions()


if __name__ == "__main__":
    main()
