"""What the solver costs, beside what scipy's solve_ivp costs on the same problem in the same run.

    python tests/bench/bench_solver.py [--full]

The job is the paper's Fig. 7b: uniaxial dead load to 56.7 kPa at 0.01 N/s, held for 6 h, with a reconstructed spectrum of N = 30
branches. The slowest peer (difference Jacobian) is given up after 15 s, with `--full` after 10 minutes; its ratio is then a lower
bound.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from dielast.material.material import Material
from dielast.material.shift import WLF
from dielast.material.springs import Gent
from dielast.mechanics.load import Step
from dielast.numerics import integrate
from dielast.numerics.rosenbrock import Rosenbrock
from dielast.numerics.stride import System

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from flat import creep
from parts import seconds

from reconstruction import spectrum

STRESS, RAMP, HOLD = 0.17 / 3e-6, 17.0, 21600.0
STEPS = [Step(stress=STRESS, duration=RAMP), Step.hold(HOLD)]
TIMES = np.concatenate((np.linspace(0.01, RAMP, 200), RAMP + np.geomspace(1e-2, HOLD, 400)))
TOLERANCES = (5e-6, 3e-6, 2e-6, 1.5e-6, 1e-6, 7e-7, 5e-7, 3e-7)
TIMES[199], TIMES[-1] = RAMP, RAMP + HOLD


def vhb(branches: int) -> Material:
    """VHB 4905, a reconstruction from published figures."""
    return Material("VHB 4905, reconstruction", 26e3, spectrum(branches), WLF(20.0, 13.7, 187.1), Gent(110.0), Gent(55.0))


def spring(log_stretch: np.ndarray | float, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Uniaxial unit Gent spring and its derivative in the logarithmic stretch."""
    front, back = np.exp(2 * np.asarray(log_stretch)), np.exp(-np.asarray(log_stretch))
    margin = 1 - (front + 2 * back - 3) / limit
    stress = (front - back) / margin
    return stress, (2 * front + back) / margin + stress * (2 * front - 2 * back) / limit / margin


class Peer:
    """The same film for solve_ivp: ln xi_1 of N branches unknown, lambda eliminated by Newton's method, exact Jacobian, NumPy."""

    def __init__(self, material: Material) -> None:
        self.mu, self.tau, self.soft = (
            material.spectrum.shear_modulus,
            material.spectrum.relaxation_time,
            material.equilibrium_modulus,
        )
        self.stretch = 0.0

    def membrane(self, viscous: np.ndarray, stress: float) -> tuple[float, np.ndarray, np.ndarray, float]:
        """ln lambda, the branches' stresses and tangents, and the film's tangent."""
        log = self.stretch
        for _ in range(50):
            soft, soft_slope = spring(log, 110.0)
            hard, hard_slope = spring(log - viscous, 55.0)
            pull = stress * np.exp(log)
            slope = self.soft * soft_slope + self.mu @ hard_slope - pull
            change = (pull - self.soft * soft - self.mu @ hard) / slope
            log += change
            if abs(change) < 1e-13:
                break
        self.stretch = float(log)
        return self.stretch, hard, hard_slope, float(slope)

    def run(self, rtol: float, times: np.ndarray | None = None) -> np.ndarray:
        """Stretches at `times` by BDF."""
        from scipy.integrate import solve_ivp

        state, self.stretch, out = np.zeros(self.mu.size), 0.0, []
        for load, start, duration in ((lambda t: STRESS * t / RAMP, 0.0, RAMP), (lambda t: STRESS, RAMP, HOLD)):

            def rate(t: float, x: np.ndarray, load: Callable[[float], float] = load) -> np.ndarray:
                return self.membrane(x, load(t))[1] / (3 * self.tau)

            def jacobian(t: float, x: np.ndarray, load: Callable[[float], float] = load) -> np.ndarray:
                _, _, slopes, slope = self.membrane(x, load(t))
                matrix = np.outer(slopes / (3 * self.tau), self.mu * slopes / slope)
                matrix[np.diag_indices_from(matrix)] -= slopes / (3 * self.tau)
                return matrix

            wanted = None if times is None else times[(times > start) & (times <= start + duration)] - start
            solved = solve_ivp(rate, (0, duration), state, method="BDF", rtol=rtol, atol=rtol, jac=jacobian, t_eval=wanted)
            state = solved.y[:, -1]
            if wanted is not None:
                out += [np.exp(self.membrane(x, load(t))[0]) for t, x in zip(wanted, solved.y.T, strict=True)]
        return np.array(out)


class OutOfTime(Exception):
    """The time allowed is over; holds the time that the simulation had reached."""


def first_attempt(material: Material, rtol: float, allowed: float) -> tuple[float, int, float]:
    """The equations as printed, ln xi_1 and ln xi_2 of every branch, both stretches by Newton's method, BDF left to difference.

    Seconds taken, calls, and how far into the test it came within the seconds `allowed`.
    """
    from scipy.integrate import solve_ivp

    mu, tau, soft = material.spectrum.shear_modulus, material.spectrum.relaxation_time, material.equilibrium_modulus
    guess, calls, start, reached = np.zeros(2), 0, 0.0, 0.0

    def unit(log: np.ndarray, limit: float) -> tuple[np.ndarray, np.ndarray]:
        a, b = np.exp(2 * log)
        margin = 1 - (a + b + 1 / (a * b) - 3) / limit
        stress = np.array(((a - 1 / (a * b)) / margin, (b - 1 / (a * b)) / margin))
        p, q = stress
        off = 2 / (a * b) / margin + 2 * p * q / limit
        return stress, np.array(
            (2 * (a + 1 / (a * b)) / margin + 2 * p * p / limit, off, 2 * (b + 1 / (a * b)) / margin + 2 * q * q / limit)
        )

    def rate(t: float, x: np.ndarray, load: Callable[[float], float]) -> np.ndarray:
        nonlocal guess, calls, reached
        calls += 1
        reached = max(reached, start + t)
        if time.perf_counter() - begin > allowed:
            raise OutOfTime
        viscous, log = x.reshape(2, -1), guess
        for _ in range(50):
            (first, k0), (stress, k) = unit(log, 110.0), unit(log[:, None] - viscous, 55.0)
            pull = np.array((load(t) * np.exp(log[0]), 0.0))
            k11, k12, k22 = soft * k0 + k @ mu
            change = np.linalg.solve(np.array(((k11 - pull[0], k12), (k12, k22))), pull - soft * first - stress @ mu)
            log = log + change
            if np.max(np.abs(change)) < 1e-12:
                break
        guess = log
        return np.concatenate(((2 * stress[0] - stress[1]) / (6 * tau), (2 * stress[1] - stress[0]) / (6 * tau)))

    begin = time.perf_counter()
    state = np.zeros(2 * mu.size)
    try:
        for load, duration in ((lambda t: STRESS * t / RAMP, RAMP), (lambda t: STRESS, HOLD)):
            state = solve_ivp(rate, (0, duration), state, method="BDF", rtol=rtol, atol=rtol, args=(load,)).y[:, -1]
            start += duration
    except OutOfTime:
        pass
    return time.perf_counter() - begin, calls, start if start == RAMP + HOLD else reached


def floor(branches: int, cases: int) -> tuple[float, float]:
    """Time per branch-stage of its arithmetic alone, and of an exponential with two multiplications, operands in cache.

    A stage of a symmetric load takes an exponential, 2 divisions, 20 multiplications or additions, and 11 more to combine stages.
    """
    one, two, out = np.full((branches, cases), 1.1), np.full((branches, cases), 0.9), np.empty((branches, cases))

    def arithmetic() -> None:
        np.exp(one, out=out)
        np.divide(one, two, out=out)
        np.divide(two, one, out=out)
        for _ in range(31):
            np.multiply(one, two, out=out)

    def bare() -> None:
        np.exp(one, out=out)
        np.multiply(one, two, out=out)
        np.multiply(one, two, out=out)

    full, least = seconds(lambda: [arithmetic() for _ in range(20)], lambda: [bare() for _ in range(20)], repeats=9)
    return full / 20 / out.size, least / 20 / out.size


def branch_stages(job: Callable[[], object]) -> float:
    """Springs times stages that the steps of a job take, those of rejected steps and of parked columns included."""
    count, advance = 0, integrate.advance

    def counting(system: System, method: Rosenbrock, time: np.ndarray, state: np.ndarray, *rest: np.ndarray) -> np.ndarray:
        nonlocal count
        count += method.stages * state[: system.border].size  # type: ignore[attr-defined]
        return advance(system, method, time, state, *rest)

    integrate.advance = counting  # type: ignore[assignment]
    try:
        job()
    finally:
        integrate.advance = advance
    return float(count)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true", help="run the slowest peer to the end")
    full = parser.parse_args().full
    solid = vhb(30)
    reference = creep(solid, STEPS, times=TIMES, rtol=1e-11).stretch_1[0]

    def coarsest(run: Callable[[float], np.ndarray]) -> float:
        """The loosest tolerance at which stretches are within 1e-6."""
        return next(rtol for rtol in TOLERANCES if np.max(np.abs(run(rtol) / reference - 1)) <= 1e-6)

    own_rtol = coarsest(lambda rtol: creep(solid, STEPS, times=TIMES, rtol=rtol).stretch_1[0])
    mine = creep(solid, STEPS, times=TIMES, rtol=own_rtol)
    error = np.max(np.abs(mine.stretch_1[0] / reference - 1))
    print(f"6 h creep, N = 30, errors against dielast at 1e-11 over {TIMES.size} output times")
    print(f"  dielast, rtol {own_rtol:g}: stretch error {error:.1e}, {int(mine.steps[0])} steps tried")
    try:
        peer = Peer(solid)
        rtol = coarsest(lambda rtol: peer.run(rtol, TIMES))
    except ImportError:
        print("  scipy: not installed")
        return
    own, other = seconds(lambda: creep(solid, STEPS, rtol=own_rtol), lambda: peer.run(rtol))
    ratio = f"ratio {other / own:.2f}   (reach > 1)"
    print(f"  one case:    dielast {own * 1e3:.1f} ms; BDF, exact Jacobian, at {rtol:g} {other * 1e3:.1f} ms   {ratio}")
    slow, calls, reached = first_attempt(solid, 1e-6, 600.0 if full else 15.0)
    short = "" if reached == RAMP + HOLD else f", given up at {reached:g} s of {RAMP + HOLD:g} s"
    ratio = f"ratio {slow / own:.0f}{' or more' if short else ''}   (reach >= 300)"
    print(f"  one case:    BDF, difference Jacobian {slow:.1f} s ({calls} calls{short})   {ratio}")
    temperatures = np.linspace(-20.0, 60.0, 1000)
    batch = seconds(lambda: creep(solid, STEPS, temperature=temperatures, points_per_decade=3), repeats=3)[0] / 1000
    print(
        f"  1000 cases:  dielast {batch * 1e3:8.3f} ms a case   ratio to BDF, exact Jacobian {other / batch:.0f}   (reach >= 150)"
    )
    stages = branch_stages(lambda: creep(solid, STEPS, temperature=temperatures, points_per_decade=3)) / 1000
    arithmetic, bare = floor(31, 500)
    print(f"  bound:       the arithmetic of its branches alone would give {other / stages / arithmetic:.0f}")
    print(
        f"  floor:       {batch / stages * 1e9:.1f} ns a branch-stage; its arithmetic alone {arithmetic * 1e9:.1f} ns"
        f" (ratio {batch / stages / arithmetic:.1f});"
        f" an exponential and two multiplications {bare * 1e9:.1f} ns (ratio {batch / stages / bare:.1f})"
    )
    counts = (30, 300, 3000, 30000)
    solids = [vhb(count) for count in counts]
    costs = seconds(*[lambda solid=solid: creep(solid, STEPS, rtol=1e-6) for solid in solids], repeats=3)
    for count, cost in zip(counts, costs, strict=True):
        print(
            f"  N = {count:6d}: {cost * 1e3:9.1f} ms, {cost / costs[0]:.1f} times N = 30"
            + ("   (reach <= 4)" if count == 300 else "")
        )


if __name__ == "__main__":
    main()
