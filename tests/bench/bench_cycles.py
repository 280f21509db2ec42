"""What long histories cost: cycles of a voltage or a stretch, and tables of a stretch, beside the 6 h creep test and scipy's Radau.

    python tests/bench/bench_cycles.py [--cycles N] [--stretch-cycles N] [--points N] [--accuracy]

VHB 4905 with a reconstructed spectrum of N = 30 branches, rtol 1e-6. The film is 0.5 mm thick, prestretched to 1.9 and relaxed for
1.5 h, and driven by 0 to 2.5 kV at 1 Hz. The specimen in uniaxial tension is driven between the stretches 1.2 and 1.6 at 1 Hz; the
table goes through a point every 10 ms. Each history runs in a process of its own, whose largest memory is printed; `--accuracy`
compares with rtol 1e-10. Radau follows the cycles of the stretch at the loosest tolerance that gives stresses as accurate.
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
from bench_solver import STEPS, spring, vhb
from bench_voltage import PERMITTIVITY, Peer
from flat import actuate, creep, relax
from parts import clock, seconds

from dielast import MembraneHistory, Step, Track, VoltageStep, Waveform
from dielast.simulate.actuation_history import ActuationHistory

FILM = {"thickness": 5e-4, "prestretch": 1.9, "relax": 5400.0, "stop_at": "end"}
HIGH = 2500.0
STRETCHES = (1.2, 1.6)


def history(kind: str, count: int, rtol: float, times: np.ndarray | None = None) -> ActuationHistory | MembraneHistory:
    """So many cycles, or points of a table."""
    solid = replace(vhb(30), permittivity=PERMITTIVITY)
    if kind == "table":
        at = 0.01 * np.arange(1, count + 1)
        noise = 1e-3 * np.random.default_rng(1).standard_normal(count)
        return relax(solid, [Step(stretch=Track(at, 1.3 + 0.2 * np.sin(at / 5) + noise))], rtol=rtol, times=times)
    if kind.startswith("stretch-"):
        wave = Waveform(*STRETCHES, 1.0, count, kind.removeprefix("stretch-"))
        return relax(solid, [Step(stretch=wave)], rtol=rtol, times=times)
    return actuate(solid, [VoltageStep(Waveform(0.0, HIGH, 1.0, count, kind))], rtol=rtol, times=times, **FILM)


def alone(kind: str, count: int) -> None:
    """One history, measured in this process and printed as JSON."""
    solid = vhb(30)
    creep(solid, STEPS)
    unit = min(clock(lambda: creep(solid, STEPS)) for _ in range(5))
    took = clock(lambda: history(kind, count, 1e-6))
    print(json.dumps([unit, took, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024]))


def peer_cycle(cycles: int) -> float:
    """Seconds of one triangle for scipy's Radau with an exact Jacobian, restarted at each kink."""
    peer = Peer(replace(vhb(30), permittivity=PERMITTIVITY), FILM["prestretch"])
    x = peer.relax(FILM["relax"], 1e-6)
    begin, top = time.perf_counter(), HIGH / FILM["thickness"]
    for _ in range(cycles):
        for start, end in ((0.0, top), (top, 0.0)):
            x, _ = peer.hold(x, start, end, 0.5, 1e-6)
    return (time.perf_counter() - begin) / cycles


def peer_of_stretch(shape: str, cycles: int, rtol: float, times: np.ndarray) -> np.ndarray:
    """The nominal stress in Pa at `times` for scipy's Radau: ln xi of each branch, exact Jacobian, restarted at each kink."""
    from scipy.integrate import solve_ivp

    material = vhb(30)
    mu, tau, soft = material.spectrum.shear_modulus, material.spectrum.relaxation_time, material.equilibrium_modulus
    low, high = STRETCHES

    def stretch(time: np.ndarray | float) -> np.ndarray:
        share = 0.5 * (1 - np.cos(2 * np.pi * time)) if shape == "sine" else 1 - np.abs(1 - 2 * np.remainder(time, 1.0))
        return np.asarray(low + (high - low) * share)

    def rate(time: float, x: np.ndarray) -> np.ndarray:
        return np.asarray(spring(np.log(stretch(time)) - x, 55.0)[0] / (3 * tau))

    def jacobian(time: float, x: np.ndarray) -> np.ndarray:
        return np.diag(-spring(np.log(stretch(time)) - x, 55.0)[1] / (3 * tau))

    lasts, x, stresses = 1.0 if shape == "sine" else 0.5, np.zeros(mu.size), []
    for begin in np.arange(0.0, cycles, lasts):
        here = times[(times > begin) & (times <= begin + lasts)]
        at = np.append(here, begin + lasts) if not here.size or here[-1] < begin + lasts else here
        solved = solve_ivp(rate, (begin, begin + lasts), x, method="Radau", rtol=rtol, atol=rtol, jac=jacobian, t_eval=at)
        x, viscous, now = solved.y[:, -1], solved.y[:, : here.size], stretch(here)
        branches = spring(np.log(now) - viscous, 55.0)[0]
        stresses.append((soft * spring(np.log(now), 110.0)[0] + mu @ branches) / now)
    return np.concatenate(stresses)


def compare_cycles_of_stretch(cycles: int = 3) -> None:
    """Print what a cycle of the stretch costs, for dielast and for Radau with stresses as accurate."""
    for shape in ("sine", "triangle"):
        times = np.linspace(0.0, cycles, 200 * cycles + 1)[1:]

        def own(rtol: float, shape: str = shape, times: np.ndarray = times) -> np.ndarray:
            return history(f"stretch-{shape}", cycles, rtol, times).nominal_stress_1[0]

        exact = own(1e-10)
        scale = np.max(np.abs(exact))
        error = np.max(np.abs(own(1e-6) - exact)) / scale
        for rtol in (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11):
            off = np.max(np.abs(peer_of_stretch(shape, cycles, rtol, times) - exact)) / scale
            if off <= error:
                break
        mine, other = seconds(
            lambda own=own: own(1e-6),
            lambda shape=shape, rtol=rtol, times=times: peer_of_stretch(shape, cycles, rtol, times),
            repeats=5,
        )
        print(
            f"a {shape} of the stretch: dielast {1e3 * mine / cycles:.0f} ms, stress error {error:.1e}; Radau at {rtol:g}"
            f" {1e3 * other / cycles:.0f} ms, {off:.1e}   ratio {other / mine:.2f}   (reach > 1)"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, nargs="+", default=[100, 1000, 10_000])
    parser.add_argument("--stretch-cycles", type=int, nargs="+", default=[100, 1000])
    parser.add_argument("--points", type=int, nargs="+", default=[1000, 10_000, 100_000])
    parser.add_argument("--accuracy", action="store_true")
    parser.add_argument("--alone", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.alone:
        alone(options.alone[0], int(options.alone[1]))
        return
    print(f"{'history':24}{'each, ms':>10}{'6 h creep, ms':>15}{'ratio':>8}{'memory, MiB':>13}")
    waves_of_voltage = [(shape, options.cycles) for shape in ("sine", "triangle")]
    waves_of_stretch = [(f"stretch-{shape}", options.stretch_cycles) for shape in ("sine", "triangle")]
    for kind, counts in (*waves_of_voltage, *waves_of_stretch, ("table", options.points)):
        for count in counts:
            command = [sys.executable, __file__, "--alone", kind, str(count)]
            unit, took, memory = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
            print(f"{f'{count} {kind}':24}{1e3 * took / count:10.2f}{1e3 * unit:15.1f}{took / count / unit:8.3f}{memory:13.0f}")
    print(f"Radau takes {1e3 * peer_cycle(5):.0f} ms for a triangle of the voltage")
    compare_cycles_of_stretch()
    if options.accuracy:
        of_stretch = [(f"stretch-{shape}", 5, "nominal_stress_1") for shape in ("sine", "triangle")]
        of_voltage = [(shape, 20, "stretch_1") for shape in ("sine", "triangle")]
        for kind, count, measured in (*of_voltage, *of_stretch, ("table", 300, "nominal_stress_1")):
            times = np.linspace(0.0, count if kind != "table" else 0.01 * count, 501)[1:]
            loose, tight = (getattr(history(kind, count, rtol, times), measured)[0] for rtol in (1e-6, 1e-10))
            off = np.max(np.abs(loose - tight)) / np.max(np.abs(tight))
            print(f"{count} {kind}: {measured} differs from that at rtol 1e-10 by at most {off:.1e} of the largest")


if __name__ == "__main__":
    main()
