"""What long histories cost: cycles of a voltage and tables of a stretch, beside the 6 h creep test and scipy's Radau.

    python tests/bench/bench_cycles.py [--cycles N] [--points N] [--accuracy]

VHB 4905 with a reconstructed spectrum of N = 30 branches, rtol 1e-6. The film is 0.5 mm thick, prestretched to 1.9 and relaxed for
1.5 h, and driven by 0 to 2.5 kV at 1 Hz; the table goes through a point every 10 ms. Each history runs in a process of its own,
whose largest memory is printed; `--accuracy` compares with rtol 1e-10.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
from bench_solver import STEPS, vhb
from bench_voltage import PERMITTIVITY, Peer

from dielast import MembraneHistory, Step, Track, VoltageStep, Waveform, actuate, creep, relax
from dielast.simulate.actuation_history import ActuationHistory

FILM = {"thickness": 5e-4, "prestretch": 1.9, "relax": 5400.0, "stop_at": "end"}
HIGH = 2500.0


def history(kind: str, count: int, rtol: float, times: np.ndarray | None = None) -> ActuationHistory | MembraneHistory:
    """So many cycles, or points of a table."""
    solid = replace(vhb(30), permittivity=PERMITTIVITY)
    if kind == "table":
        at = 0.01 * np.arange(1, count + 1)
        noise = 1e-3 * np.random.default_rng(1).standard_normal(count)
        return relax(solid, [Step(stretch=Track(at, 1.3 + 0.2 * np.sin(at / 5) + noise))], rtol=rtol, times=times)
    return actuate(solid, [VoltageStep(Waveform(0.0, HIGH, 1.0, count, kind))], rtol=rtol, times=times, **FILM)


def alone(kind: str, count: int) -> None:
    """One history, measured in this process and printed as JSON."""
    solid = vhb(30)
    creep(solid, STEPS)
    unit = min(_seconds(lambda: creep(solid, STEPS)) for _ in range(5))
    took = _seconds(lambda: history(kind, count, 1e-6))
    print(json.dumps([unit, took, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024]))


def _seconds(action: object) -> float:
    begin = time.perf_counter()
    action()  # type: ignore[operator]
    return time.perf_counter() - begin


def peer_cycle(cycles: int) -> float:
    """Seconds of one triangle for scipy's Radau with an exact Jacobian, restarted at each kink."""
    peer = Peer(replace(vhb(30), permittivity=PERMITTIVITY), FILM["prestretch"])
    x = peer.relax(FILM["relax"], 1e-6)
    begin, top = time.perf_counter(), HIGH / FILM["thickness"]
    for _ in range(cycles):
        for start, end in ((0.0, top), (top, 0.0)):
            x, _ = peer.hold(x, start, end, 0.5, 1e-6)
    return (time.perf_counter() - begin) / cycles


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, nargs="+", default=[100, 1000, 10_000])
    parser.add_argument("--points", type=int, nargs="+", default=[1000, 10_000, 100_000])
    parser.add_argument("--accuracy", action="store_true")
    parser.add_argument("--alone", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.alone:
        alone(options.alone[0], int(options.alone[1]))
        return
    print(f"{'history':20}{'each, ms':>10}{'6 h creep, ms':>15}{'ratio':>8}{'memory, MiB':>13}")
    for kind, counts in (("sine", options.cycles), ("triangle", options.cycles), ("table", options.points)):
        for count in counts:
            command = [sys.executable, __file__, "--alone", kind, str(count)]
            unit, took, memory = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
            print(f"{f'{count} {kind}':20}{1e3 * took / count:10.2f}{1e3 * unit:15.1f}{took / count / unit:8.3f}{memory:13.0f}")
    print(f"Radau takes {1e3 * peer_cycle(5):.0f} ms for a triangle")
    if options.accuracy:
        for kind, count, measured in (("sine", 20, "stretch_1"), ("triangle", 20, "stretch_1"), ("table", 300, "nominal_stress_1")):
            times = np.linspace(0.0, count if kind != "table" else 0.01 * count, 501)[1:]
            loose, tight = (getattr(history(kind, count, rtol, times), measured)[0] for rtol in (1e-6, 1e-10))
            off = np.max(np.abs(loose - tight)) / np.max(np.abs(tight))
            print(f"{count} {kind}: {measured} differs from that at rtol 1e-10 by at most {off:.1e} of the largest")


if __name__ == "__main__":
    main()
