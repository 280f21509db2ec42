"""What films under voltage cost, beside what scipy's solve_ivp costs on the same problems in the same run.

    python tests/bench/bench_voltage.py [--cells N] [--linear]

The film is VHB 4905 with a reconstructed spectrum of N = 30 branches, 0.5 mm, equibiaxially prestretched at once, relaxed for 1.5
h. One run is the paper's Fig. 9: 2.5 kV within 10 s, 5 min, 3 kV within 10 s, held to 2 h. The map is N x N (100 x 100) voltages
and prestretches under constant voltage with a horizon of 24 h, breakdown and pull-in times to 1e-4. `--linear` solves maps of 1e3
to 1e5 cells as well, a minute or two.
"""

from __future__ import annotations

import argparse
import resource
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from bench_solver import branch_stages, floor, vhb
from flat import actuate, failure_map
from parts import clock, seconds

from dielast.material.material import Breakdown, Material
from dielast.simulate.actuate import VoltageStep
from dielast.simulate.failure_map import FailureMap

PERMITTIVITY, THICKNESS, RELAX, HORIZON = 3.98e-11, 0.5e-3, 5400.0, 86400.0
FIELD = Breakdown((1.7, 1.9), (40e6, 48e6))
FIG_9 = ((0.0, 2500.0, 10.0), (2500.0, 2500.0, 300.0), (2500.0, 3000.0, 10.0), (3000.0, 3000.0, 6880.0))
VOLTAGES, PRESTRETCHES = (3400.0, 4600.0), (1.7, 1.9)
SHARE = 0.01
RTOL = 4.5e-4  # gives times within 1e-4


def spring(log_stretch: np.ndarray | float, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Equibiaxial unit Gent spring and its derivative in the logarithmic stretch, both axes together."""
    front = np.exp(2 * np.asarray(log_stretch))
    back = 1 / (front * front)
    margin = 1 - (2 * front + back - 3) / limit
    stress = (front - back) / margin
    return stress, (2 * front + 4 * back) / margin + 4 * stress * stress / limit


class Peer:
    """The film for solve_ivp: ln xi of N branches as unknowns, lambda eliminated by Newton's method, exact Jacobian, NumPy,
    Radau.
    """

    def __init__(self, material: Material, prestretch: float) -> None:
        self.mu, self.tau, self.soft = (
            material.spectrum.shear_modulus,
            material.spectrum.relaxation_time,
            material.equilibrium_modulus,
        )
        self.stretch = np.log(prestretch)
        self.prestretch = prestretch
        self.stress = 0.0

    def membrane(self, viscous: np.ndarray, field: float) -> tuple[float, np.ndarray, np.ndarray, float]:
        """ln lambda, the branches' stresses and tangents, and the film's tangent at a nominal field."""
        log = self.stretch
        for _ in range(50):
            soft, soft_slope = spring(log, 110.0)
            hard, hard_slope = spring(log - viscous, 55.0)
            pull, squeeze = self.stress * np.exp(log), PERMITTIVITY * field**2 * np.exp(4 * log)
            slope = self.soft * soft_slope + self.mu @ hard_slope - pull - 4 * squeeze
            change = (pull + squeeze - self.soft * soft - self.mu @ hard) / slope
            log += change
            if abs(change) < 1e-13:
                break
        self.stretch = float(log)
        return self.stretch, hard, hard_slope, float(slope)

    def relax(self, duration: float, rtol: float) -> np.ndarray:
        """Viscous strains at the end of the relaxation; keeps the dead load."""
        from scipy.integrate import solve_ivp

        log = np.log(self.prestretch)

        def rate(t: float, x: np.ndarray) -> np.ndarray:
            return spring(log - x, 55.0)[0] / (6 * self.tau)

        def jacobian(t: float, x: np.ndarray) -> np.ndarray:
            return np.diag(-spring(log - x, 55.0)[1] / (6 * self.tau))

        x = solve_ivp(rate, (0, duration), np.zeros(self.mu.size), method="Radau", rtol=rtol, atol=rtol, jac=jacobian).y[:, -1]
        self.stress = float((self.soft * spring(log, 110.0)[0] + self.mu @ spring(log - x, 55.0)[0]) / self.prestretch)
        return np.asarray(x)

    def hold(
        self, x: np.ndarray, start: float, end: float, duration: float, rtol: float, field: float | None = None
    ) -> tuple[np.ndarray, list[float]]:
        """Drive through a piece of nominal field; with a breakdown `field`, the times of breakdown and of pull-in, at which it
        stops.
        """
        from scipy.integrate import solve_ivp

        def nominal(t: float) -> float:
            return start + (end - start) * t / duration

        def rate(t: float, x: np.ndarray) -> np.ndarray:
            return np.asarray(self.membrane(x, nominal(t))[1] / (6 * self.tau))

        def jacobian(t: float, x: np.ndarray) -> np.ndarray:
            _, _, slopes, slope = self.membrane(x, nominal(t))
            matrix = np.outer(slopes / (6 * self.tau), self.mu * slopes / slope)
            matrix[np.diag_indices_from(matrix)] -= slopes / (6 * self.tau)
            return matrix

        def broken(t: float, x: np.ndarray) -> float:
            return float(1 - nominal(t) * np.exp(2 * self.membrane(x, nominal(t))[0]) / (field or 1.0))

        def unstable(t: float, x: np.ndarray) -> float:
            log, _, slopes, _ = self.membrane(x, nominal(t))
            held = np.exp(-SHARE * t / self.tau) * self.mu
            squeeze = PERMITTIVITY * nominal(t) ** 2 * np.exp(4 * log)
            return float(self.soft * spring(log, 110.0)[1] + held @ slopes - self.stress * np.exp(log) - 4 * squeeze)

        unstable.terminal = True  # type: ignore[attr-defined]
        events = None if field is None else (broken, unstable)
        solved = solve_ivp(rate, (0, duration), x, method="Radau", rtol=rtol, atol=rtol, jac=jacobian, events=events)
        return solved.y[:, -1], [] if field is None else [float(times[0]) if times.size else np.nan for times in solved.t_events]

    def fig9(self, rtol: float) -> np.ndarray:
        """The stretches at the ends of the steps of Fig. 9."""
        x, stretches = self.relax(RELAX, rtol), []
        for start, end, duration in FIG_9:
            x = self.hold(x, start / THICKNESS, end / THICKNESS, duration, rtol)[0]
            stretches.append(np.exp(self.membrane(x, end / THICKNESS)[0]))
        return np.array(stretches)

    def cell(self, voltage: float, field: float, rtol: float) -> list[float]:
        """Times of breakdown and pull-in at constant voltage."""
        nominal = voltage / THICKNESS
        return self.hold(self.relax(RELAX, rtol), nominal, nominal, HORIZON, rtol, field)[1]


def fig9(material: Material, rtol: float) -> np.ndarray:
    """The stretches at the ends of the steps of Fig. 9, events included."""
    steps = [VoltageStep(end, duration=duration) for _, end, duration in FIG_9]
    times = np.cumsum([duration for _, _, duration in FIG_9])
    history = actuate(material, steps, thickness=THICKNESS, prestretch=1.9, relax=RELAX, stop_at="end", times=times, rtol=rtol)
    return history.stretch_1[0]


def lifetimes(material: Material, voltages: int, prestretches: int, rtol: float = RTOL) -> FailureMap:
    """A map of so many cells."""
    return failure_map(
        material,
        voltage=np.linspace(*VOLTAGES, voltages),
        prestretch=np.linspace(*PRESTRETCHES, prestretches),
        thickness=THICKNESS,
        relax=RELAX,
        horizon=HORIZON,
        rtol=rtol,
    )


def coarsest(run: Callable[[float], np.ndarray], reference: np.ndarray, tolerance: float) -> float:
    """The loosest tolerance at which a peer's answer is within `tolerance`."""
    for rtol in (1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7):
        if np.nanmax(np.abs(run(rtol) / reference - 1)) <= tolerance:
            return rtol
    raise RuntimeError("the peer does not reach the tolerance")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=100, help="voltages and prestretches of the map")
    parser.add_argument("--linear", action="store_true", help="maps of 1e3 to 1e5 cells as well")
    arguments = parser.parse_args()
    solid = replace(vhb(30), permittivity=PERMITTIVITY, breakdown=FIELD)
    side = arguments.cells
    fine = lifetimes(solid, side, side, 1e-9)
    cost = [clock(lambda: lifetimes(solid, side, side)) for _ in range(3)]
    result = lifetimes(solid, side, side)
    errors = [
        np.nanmax(np.abs(a / b - 1))
        for a, b in ((result.time_to_breakdown, fine.time_to_breakdown), (result.time_to_pull_in, fine.time_to_pull_in))
    ]
    per_cell = float(np.median(cost)) / side**2
    print(f"{side} x {side} map, horizon 24 h, N = 30: {per_cell * 1e3:.3f} ms a cell at rtol {RTOL:g}")
    print(f"  largest errors of times: breakdown {errors[0]:.1e}, pull-in {errors[1]:.1e}   (reach <= 1e-4)")
    print(f"  peak memory of this process {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB   (reach <= 1024)")
    try:
        reference = fig9(solid, 1e-10)
        peer_rtol = coarsest(lambda rtol: Peer(solid, 1.9).fig9(rtol), reference, 1e-6)
        rtol = coarsest(lambda rtol: fig9(solid, rtol), reference, 1e-6)
        own, other = seconds(lambda: fig9(solid, rtol), lambda: Peer(solid, 1.9).fig9(peer_rtol), repeats=9)
        print("one Fig. 9 run, stretches at the ends of its steps within 1e-6:")
        print(f"  dielast at {rtol:g} {own * 1e3:.0f} ms   Radau at {peer_rtol:g} {other * 1e3:.0f} ms", end="   ")
        print(f"ratio {other / own:.2f}   (reach > 1)")
        picks = [(i % side, (i * 7) % side) for i in np.linspace(0, side - 1, 20).astype(int)]

        def cells(rtol: float) -> np.ndarray:
            return np.array(
                [
                    Peer(solid, float(fine.prestretch[row, 0])).cell(
                        float(fine.voltage[column]), float(fine.breakdown_field[row]), rtol
                    )
                    for column, row in picks
                ]
            )

        times = np.array([(fine.time_to_breakdown[0, row, column], fine.time_to_pull_in[0, row, column]) for column, row in picks])
        peer_rtol = coarsest(cells, times, 1e-4)
        other = clock(lambda: cells(peer_rtol)) / len(picks)
        own = clock(lambda: lifetimes(solid, side, side)) / side**2
        print(f"  Radau at {peer_rtol:g}, mean of {len(picks)} cells: {other * 1e3:.0f} ms a cell", end="   ")
        print(f"ratio {other / own:.0f}   (reach >= 300)")
        stages = branch_stages(lambda: lifetimes(solid, side, side)) / side**2
        arithmetic, bare = floor(32, 1000)
        print(
            f"  bound: {stages:.0f} branch-stages a cell; their arithmetic alone, {arithmetic * 1e9:.1f} ns each, would give"
            f" {other / stages / arithmetic:.0f}; an exponential and two multiplications each, {other / stages / bare:.0f}"
        )
    except ImportError:
        print("  scipy: not installed")
    if arguments.linear:
        for voltages, prestretches in ((100, 10), (100, 100), (1000, 100)):
            taken = clock(lambda v=voltages, p=prestretches: lifetimes(solid, v, p))
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            count = voltages * prestretches
            print(f"  {count:6d} cells: {taken:7.2f} s, {taken / count * 1e3:.3f} ms a cell, peak memory {peak:.0f} MiB")


if __name__ == "__main__":
    main()
