"""Accuracy and cost of the master curve, beside the mastercurves and pyvisco packages on the same curves in the same run.

    python tests/bench/bench_mastercurve.py [--polystyrene FOLDER] [--peer PYTHON] [--timeout SECONDS] [--seeds N]

The curves are those of VHB 4905 reconstructed from published figures, with 1 % noise, and, from FOLDER, measured polystyrene
(`stressrelaxation_ps{T}_data.csv`, tab separated). PYTHON is an interpreter that has the peers; by default this one.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

from dielast.material.measurement import RelaxationCurve
from dielast.relaxation.superposition.mastercurve import Vertical, build_master_curve
from dielast.relaxation.superposition.result import MasterCurve

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS / "physics")]
from parts import seconds
from test_mastercurve_truth import error, measure

ROUNDS = 15
PUBLISHED = np.array([2.4607, 1.0465, 0.0, -0.7832, -1.4393])  # polystyrene, 130 to 190 degC, about 160 degC

PEERS = {
    "mastercurves": """
import json, sys, time
import numpy as np
from mastercurves import MasterCurve
from mastercurves.transforms import Multiply
curves, reference = json.load(open(sys.argv[1]))[::-1], float(sys.argv[2])  # hot to cold suits its default bounds
begin = time.perf_counter()
master = MasterCurve()
master.add_data([np.log(c[1]) for c in curves], [np.log(c[2]) for c in curves], [c[0] for c in curves])
master.add_htransform(Multiply())
master.superpose()
master.change_ref(reference)
a = -np.log10(np.array(master.hparams[0], dtype=float))
print(json.dumps([time.perf_counter() - begin, a.tolist()[::-1]]))
""",
    "pyvisco": """
import json, sys, time, warnings
warnings.simplefilter("ignore")
import numpy as np, pandas as pd
from pyvisco import master
curves, reference = json.load(open(sys.argv[1])), float(sys.argv[2])
parts = [pd.DataFrame({"t_set": c[1], "E_relax": np.array(c[2]) * 1e-6, "T": c[0], "T_round": c[0], "Set": k})
         for k, c in enumerate(curves)]
frame = pd.concat(parts, ignore_index=True)
frame["f_set"] = 1 / frame["t_set"]
object.__setattr__(frame, "domain", "time")
object.__setattr__(frame, "modul", "E")
begin = time.perf_counter()
table, _ = master.get_aT(frame, reference)
print(json.dumps([time.perf_counter() - begin, table["log_aT"].tolist()]))
""",
}


def build(curves: list[RelaxationCurve], reference: float, vertical: Vertical = "none") -> MasterCurve:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return build_master_curve(curves, reference_temperature=reference, vertical=vertical)


def peer(name: str, python: str, curves: list[RelaxationCurve], reference: float, timeout: float) -> tuple[float, np.ndarray] | str:
    """Time in s and log10 a, coldest first; or why there are none."""
    rows = [[c.temperature, c.time.tolist(), c.modulus.tolist()] for c in sorted(curves, key=lambda c: c.temperature)]
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(rows, file)
        file.flush()
        try:
            run = subprocess.run(
                [python, "-c", PEERS[name], file.name, str(reference)], capture_output=True, text=True, timeout=timeout, check=False
            )
        except subprocess.TimeoutExpired:
            return f"stopped after {timeout:g} s"
    if run.returncode:
        last = run.stderr.strip().splitlines()[-1]
        return "not installed" if "ModuleNotFoundError" in last else last
    spent, shift = json.loads(run.stdout.strip().splitlines()[-1])
    return spent, np.array(shift)


def thinned(curve: RelaxationCurve, points: int = 100) -> RelaxationCurve:
    """Points about even in log time: a Gaussian process on thousands would take a day."""
    kept = np.unique(np.searchsorted(curve.time, np.geomspace(curve.time[0], curve.time[-1], points)))
    return RelaxationCurve(curve.temperature, curve.time[kept], curve.modulus[kept])


def compare(
    title: str,
    curves: list[RelaxationCurve],
    reference: float,
    truth: np.ndarray,
    options: argparse.Namespace,
    given: list[RelaxationCurve] | None = None,
) -> None:
    """Print a table; the peers are given the curves `given`, or the same."""
    own = build(curves, reference)
    (spent,) = seconds(lambda: build(curves, reference), repeats=ROUNDS)
    print(f"\n{title}\n{'':14}{'time':>12}{'ratio':>9}{'rms error':>12}{'largest':>10}   of log10 a, decades")
    wrong = own.log10_shift_factor - truth
    print(f"{'dielast':14}{spent * 1e3:9.1f} ms{1:9.0f}{np.sqrt(np.mean(wrong**2)):12.4f}{np.max(np.abs(wrong)):10.4f}")
    for name in PEERS:
        result = peer(name, options.peer, given or curves, reference, options.timeout)
        if isinstance(result, str):
            print(f"{name:14}{result}" + (f" (ratio above {options.timeout / spent:.0f})" if result.startswith("stopped") else ""))
            continue
        wrong, cost = result[1] - truth, result[0]
        print(f"{name:14}{cost * 1e3:9.1f} ms{cost / spent:9.1f}{np.sqrt(np.mean(wrong**2)):12.4f}{np.max(np.abs(wrong)):10.4f}")


def accuracy(seeds: int) -> None:
    """Distribution of the errors over repeats of the noise."""
    rms, constants, inside = [], [], []
    for seed in range(seeds):
        master = build(measure(seed=seed), 20.0)
        wrong = error(master)
        rms.append(np.sqrt(np.mean(wrong**2)))
        inside.append(np.abs(wrong)[wrong != 0] < 1.96 * master.log10_shift_factor_stderr[wrong != 0])
        constants.append([master.law_parameters["C1"] / 13.7 - 1, master.law_parameters["C2"] / 187.1 - 1])
    off = 100 * np.abs(constants)
    print(f"\nReconstructed VHB 4905, 21 x 60 points, 1 % noise, seeds 0 to {seeds - 1}")
    print("rms error of log10 a: median {:.4f}, 90 % {:.4f}, largest {:.4f} decades".format(*np.percentile(rms, [50, 90, 100])))
    for k, name in enumerate(("C1", "C2")):
        print(
            "{} error: median {:.2f}, 95 % {:.2f}, largest {:.2f} %; ".format(name, *np.percentile(off[:, k], [50, 95, 100]))
            + f"within 0.5 %: {np.mean(off[:, k] < 0.5):.1%}"
        )
    print(f"95 % intervals of log10 a that hold the truth: {np.mean(inside):.1%}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--polystyrene", type=Path)
    parser.add_argument("--peer", default=sys.executable)
    parser.add_argument("--timeout", type=float, default=120.0)
    parser.add_argument("--seeds", type=int, default=200)
    options = parser.parse_args()
    accuracy(options.seeds)
    for points in (60, 1000):
        curves = measure(points=points)
        own = build(curves, 20.0)
        compare(f"Reconstructed VHB 4905, 21 x {points} points", curves, 20.0, own.log10_shift_factor - error(own), options)
    if options.polystyrene:
        curves = []
        for temperature in (130, 145, 160, 175, 190):
            path = options.polystyrene / f"stressrelaxation_ps{temperature}_data.csv"
            curves.append(RelaxationCurve(float(temperature), *np.loadtxt(path, delimiter="\t", skiprows=1, unpack=True)))
        title = "Measured polystyrene, 5 curves (peers: thinned to 100 points each), against the published shift"
        compare(title, curves, 160.0, PUBLISHED, options, [thinned(curve) for curve in curves])
        for vertical in ("density-temperature", "free"):
            wrong = build(curves, 160.0, vertical).log10_shift_factor - PUBLISHED
            print(f"dielast, vertical = {vertical}: largest {np.max(np.abs(wrong)):.4f} decades")


if __name__ == "__main__":
    main()
