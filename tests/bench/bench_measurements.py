"""Accuracy and cost of master curves of frequency sweeps and creep, beside peers on the storage modulus in the same run.

    python tests/bench/bench_measurements.py [--polystyrene FOLDER] [--dma FOLDER] [--peer PYTHON] [--timeout SECONDS] [--seeds N]

The sweeps are those of VHB 4905 reconstructed from published figures, with 1 % noise; from FOLDER, measured polystyrene
(`oscillation_ps{T}_data.csv`, `creep_ps{T}_data.csv`), and a polymer through its glass transition (`freq_user_raw.csv`, with the
shift factors of the instrument's software, `freq_Eplexor_raw__shift_factors.csv`). PYTHON is an interpreter that has the peers.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS / "physics"), str(TESTS / "bench")]
from bench_mastercurve import PEERS, peer
from parts import seconds
from test_sweeps_truth import BY_OSCILLATION, BY_RELAXATION, LAW, POLYSTYRENE, build, error, sweep

from dielast.material.measurement import CreepCurve, FrequencySweep, RelaxationCurve

ROUNDS = 7


def row(name: str, spent: float, ratio: float, wrong: np.ndarray, note: str = "") -> None:
    wrong = wrong[np.isfinite(wrong)]
    size = f"{np.sqrt(np.mean(wrong**2)):12.4f}{np.max(np.abs(wrong)):10.4f}"
    print(f"{name:24}{spent * 1e3:9.1f} ms{ratio:9.1f}{size}   {note}")


def compare(
    title: str, curves: list[Any], reference: float, truth: np.ndarray, options: argparse.Namespace, peers: bool = True
) -> None:
    """Print a table of errors of log10 a; the peers get the storage moduli over the inverse of the frequency."""
    print(f"\n{title}\n{'':24}{'time':>12}{'ratio':>9}{'rms error':>12}{'largest':>10}   of log10 a, decades")
    first = 0.0
    for on in ("auto", "moduli", "tan-delta", "storage") if peers else ("auto",):
        for vertical in ("none", "free"):
            stated = {"vertical": vertical, "on": on}
            own = build(curves, reference, **stated)
            (spent,) = seconds(lambda stated=stated: build(curves, reference, **stated), repeats=ROUNDS)
            first = first or spent
            wrong = own.log10_shift_factor - truth
            with np.errstate(invalid="ignore"):
                score = np.abs(wrong) / own.log10_shift_factor_stderr
            said = f"on {own.shifted_on}; " if peers else ""
            note = f"{said}at most {np.nanmax(score[truth != 0]):.1f} standard errors; {len(own.undetermined)} undetermined"
            row(f"dielast {on}, {vertical}" if peers else f"dielast {vertical}", spent, spent / first, wrong, note)
    given = (
        [RelaxationCurve(c.temperature, 1 / c.angular_frequency[::-1], c.storage_modulus[::-1]) for c in curves] if peers else []
    )
    for name in PEERS if peers else ():
        result = peer(name, options.peer, given, reference, options.timeout)
        if isinstance(result, str):
            print(f"{name:24}{result}")
        else:
            row(f"{name}, storage", result[0], result[0] / first, result[1] - truth)


def accuracy(seeds: int) -> None:
    """Distribution of the errors over repeats of the noise."""
    print(f"\nReconstructed VHB 4905, 21 x 20 frequencies, seeds 0 to {seeds - 1}: 95 % intervals of log10 a that hold the truth")
    kinds: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
        "1 % noise": ({}, {}),
        "1 % noise, tan delta": ({}, {"on": "tan-delta"}),
        "1 % noise, storage": ({}, {"on": "storage"}),
        "3 % common, 0.3 % own": ({"common": 0.03, "noise": 0.003}, {}),
        "5 % specimen scatter": ({"level": 0.05}, {}),
        "5 %, vertical free": ({"level": 0.05}, {"vertical": "free"}),
    }
    for name, (data, options) in kinds.items():
        inside, rms, constants = [], [], []
        for seed in range(seeds):
            master = build(sweep(seed=seed, **data), **options)
            moved = master.temperature != 20.0
            inside += (np.abs(error(master)) < 1.96 * master.log10_shift_factor_stderr)[moved].tolist()
            rms.append(np.sqrt(np.mean(error(master) ** 2)))
            truth = {"C1": 13.7, "C2": 187.1}
            constants += [abs(master.law_parameters[key] - truth[key]) < 1.96 * master.law_stderr[key] for key in truth]
        print(
            f"{name:24}{np.mean(inside):7.1%}, of C1 and C2 {np.mean(constants):6.1%}; "
            f"rms error median {np.median(rms):.4f}, largest {np.max(rms):.4f} decades"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--polystyrene", type=Path)
    parser.add_argument("--dma", type=Path)
    parser.add_argument("--peer", default=sys.executable)
    parser.add_argument("--timeout", type=float, default=60.0)
    parser.add_argument("--seeds", type=int, default=100)
    options = parser.parse_args()
    accuracy(options.seeds)
    made = sweep()[::-1]
    truth = np.array([float(LAW.log10_shift_factor(curve.temperature)) for curve in made])
    compare("Reconstructed VHB 4905, 21 sweeps of 20 frequencies", made, 20.0, truth, options)
    if options.polystyrene:
        for kind, published in (("oscillation", BY_OSCILLATION), ("creep", BY_OSCILLATION), ("creep", BY_RELAXATION)):
            curves: list[Any] = []
            for temperature in POLYSTYRENE:
                path = options.polystyrene / f"{kind}_ps{temperature}_data.csv"
                x, *y = np.loadtxt(path, delimiter="\t", skiprows=1, unpack=True)
                own = float(temperature)
                curves.append(CreepCurve(own, x, y[0] / 3) if kind == "creep" else FrequencySweep(own, x, 3 * y[0], 3 * y[1]))
            against = "relaxation" if published is BY_RELAXATION else "oscillation"
            title = f"Measured polystyrene, {kind}, against the published shift of its {against}"
            compare(title, curves, 160.0, published, options, peers=kind == "oscillation")
    if options.dma:
        rows = np.loadtxt(options.dma / "freq_user_raw.csv", delimiter=",", skiprows=2)
        sets = [rows[rows[:, 4] == k] for k in np.unique(rows[:, 4])]
        dma = [FrequencySweep(float(np.mean(s[:, 3])), 2 * np.pi * s[:, 0], 1e6 * s[:, 1], 1e6 * s[:, 2]) for s in sets]
        path = options.dma / "freq_Eplexor_raw__shift_factors.csv"
        software = np.loadtxt(path, delimiter=",", skiprows=2, encoding="utf-8-sig")[::-1, 1]
        compare("Measured polymer, -50 to 100 degC, against its instrument's software", dma, dma[6].temperature, software, options)
        master = build(dma, dma[6].temperature)
        print("\ntemperature  log10 a  stderr  software  difference  in standard errors")
        for k in range(len(dma)):
            wrong = master.log10_shift_factor[k] - software[k]
            wide = master.log10_shift_factor_stderr[k]
            print(
                f"{master.temperature[k]:11.2f}{master.log10_shift_factor[k]:9.3f}{wide:8.3f}{software[k]:10.2f}{wrong:12.3f}"
                f"{wrong / wide if wide > 0 else 0.0:20.2f}"
            )


if __name__ == "__main__":
    main()
