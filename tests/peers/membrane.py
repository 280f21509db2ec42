"""A homogeneous viscoelastic dielectric film in plane stress, solved by scipy's Radau: what a simulation is held against.

Branch k has viscous stretches xi_i and elastic stretches l_i / xi_i. W_eq is the
energy of the equilibrium spring, W that of a branch of modulus 1 Pa, and U the potential of the dielectric at fixed nominal
field e = V/L_3 or at fixed nominal charge d (per undeformed area),

    U(e) = -eps e^2 (l1 l2)^2 / 2    or    U(d) = d^2 / (2 eps (l1 l2)^2),    eps = eps(l1, l2),

the mechanical stress is s_i l_i = p_i(l) = l_i d(W_eq + U)/dl_i + sum_k mu_k l_i dW/dl_i (l/xi^k). The flow rule (Eqs. 7, 8 of
DOI 10.1115/1.4030850) is d ln xi_1/dt = (2 p_1 - p_2)/(6 mu tau), d ln xi_2/dt = (2 p_2 - p_1)/(6 mu tau), p those of the branch,
both times a(s^2) with s^2 = p_1^2 - p_1 p_2 + p_2^2 if there is an activation a.
Behind a source e_s and a resistance, and through a film that leaks the current density j(E), E = e l1 l2 the true field,

    d d/dt = (e_s - e)/r - j l1 l2,    r = R A/L_3 in ohm m (R the resistance, A the undeformed area).

Damage is int (E/E_0)^n dt/t_0. Unknowns of the ordinary differential equation are ln xi, d and the damage; the stretches that are
not prescribed follow from s_i = p_i/l_i by Newton's method at every evaluation, to rounding. Stresses come from complex steps,
tangents from Taylor numbers (peers.energies). SI units throughout.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from peers.energies import Energy, stress
from peers.taylor import stretches
from scipy.integrate import OdeSolution, solve_ivp
from scipy.optimize import brentq

Floats = NDArray[np.float64]
Course = Callable[[Any], Any]  # a load over the time since its piece began, numbers or arrays

NEWTON_STEPS, ENOUGH, ACCEPTABLE = 60, 1e-13, 1e-10  # steps; the change of ln l that is the last; at which they may stagnate
LARGEST_STEP, SLOW = 0.2, 0.1  # in ln l; contraction a step above which the tangent is computed anew
JUMP_PARTS, SAMPLES = 40, 4  # parts in which a load at once is applied; looks per step of the solver for roots of events
TRIALS = 50  # stages of a piece that may lie beyond the end of the equilibrium
FLOW = np.array([[2.0, -1.0], [-1.0, 2.0]]) / 6


def constant(value: float) -> Course:
    """The same value throughout."""
    return lambda t: value + 0 * t


def ramp(begin: float, end: float, duration: float) -> Course:
    """From `begin` to `end` in `duration` s."""
    return lambda t: begin + (end - begin) * (t / duration)


NOTHING = constant(0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """`equilibrium` is the energy of the equilibrium spring in J/m^3, `branch` that of a branch of 1 Pa, `modulus` (N,) in Pa and
    `time` (N,) in s the branches at the film's temperature.

    `permittivity` in F/m and `breakdown` in V/m are numbers or functions of (l1, l2); `leakage` is a current density in A/m^2 of
    the true field; `damage` is (E_0 in V/m, t_0 in s, n); `activation` gives a and da/ds^2 at s^2 in Pa^2.
    """

    equilibrium: Energy
    branch: Energy
    modulus: Floats
    time: Floats
    permittivity: float | Energy = 1.0
    breakdown: float | Energy = np.inf
    leakage: Callable[[Any], Any] | None = None
    damage: tuple[float, float, float] | None = None
    activation: Callable[[Any], tuple[Any, Any]] | None = None

    def eps(self, l1: Any, l2: Any) -> Any:
        """Permittivity in F/m."""
        return self.permittivity(l1, l2) if callable(self.permittivity) else self.permittivity

    @property
    def charge_unit(self) -> float:
        """sqrt(mu eps) at rest in C/m^2, with mu = K12/2 the modulus of the equilibrium spring."""
        return float(np.sqrt(self.equilibrium(*stretches(np.zeros(2))).parts[4] / 2 * self.eps(1.0, 1.0)))


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A smooth piece of load of `duration` s. Each axis has ("stretch", course) or ("stress", course), nominal, in Pa; `electric`
    is ("field", nominal field in V/m), ("charge", nominal charge in C/m^2) or ("source", nominal field of the source in V/m).
    """

    duration: float
    axes: tuple[tuple[str, Course], tuple[str, Course]]
    electric: tuple[str, Course] = ("field", NOTHING)
    resistance: float = np.inf  # r in ohm m of a source; infinite is an open circuit


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A film at a moment: `log_viscous` (2, N), `log_stretch` (2,), nominal `stress` (2,) in Pa, nominal `field` in V/m and
    `charge` in C/m^2, `damage`, and `time` in s.
    """

    log_viscous: Floats
    log_stretch: Floats
    stress: Floats
    field: float = 0.0
    charge: float = 0.0
    damage: float = 0.0
    time: float = 0.0


def at_rest(film: Film) -> State:
    """The film before anything happened."""
    return State(np.zeros((2, film.modulus.size)), np.zeros(2), np.zeros(2))


def potential(film: Film, kind: str, value: Any) -> Energy:
    """U(l1, l2) in J/m^3 at fixed nominal field, or at fixed nominal charge."""
    if kind == "field":
        return lambda l1, l2: -0.5 * value * value * (l1 * l2) ** 2 * film.eps(l1, l2)
    return lambda l1, l2: 0.5 * value * value * (l1 * l2) ** -2.0 * film.eps(l1, l2) ** -1.0


def log_stress(energy: Energy, log_stretch: Any) -> Floats:
    """p = dW/d ln l (2, ...) in Pa at ln l (2, ...)."""
    stretch = np.exp(log_stretch)
    return stretch * stress(energy, *stretch)


def branch_stress(film: Film, log_stretch: Any, log_viscous: Any) -> Floats:
    """p of every branch (2, N, k) in Pa at ln l (2, k) and ln xi (2, N, k)."""
    return film.modulus[:, None] * log_stress(film.branch, log_stretch[:, None] - log_viscous)


def spring_tangent(film: Film, log_stretch: Any, log_viscous: Any) -> tuple[Floats, Floats]:
    """K = dp/d ln l of the equilibrium spring (3, k) and of every branch (3, N, k), entries 11, 12, 22 in Pa."""
    soft = film.equilibrium(*stretches(log_stretch)).parts[3:]
    return soft, film.modulus[:, None] * film.branch(*stretches(log_stretch[:, None] - log_viscous)).parts[3:]


def flow_rate(film: Film, p: Floats) -> Floats:
    """d ln xi/dt (2, N, k) in 1/s at stresses p of the branches (2, N, k) in Pa."""
    factor = 1.0 if film.activation is None else film.activation(p[0] ** 2 - p[0] * p[1] + p[1] ** 2)[0]
    return np.einsum("ij,jnk->ink", FLOW, p) * factor / (film.modulus * film.time)[:, None]


def mobility(film: Film, p: Floats) -> Floats:
    """Derivatives (2, 2, N, k) of `flow_rate` in p."""
    flow = np.broadcast_to(FLOW[:, :, None, None], (2, 2, *p.shape[1:]))
    if film.activation is not None:
        factor, slope = film.activation(p[0] ** 2 - p[0] * p[1] + p[1] ** 2)
        steeper = np.stack((2 * p[0] - p[1], 2 * p[1] - p[0]))
        flow = factor * flow + slope * np.einsum("ij,jnk->ink", FLOW, p)[:, None] * steeper
    return flow / (film.modulus * film.time)[:, None]


def relaxation_rate(film: Film, p: Floats) -> Floats:
    """1/tau of the branches (N, 1), or d(a s)/ds/tau (N, k) at stresses p (2, N, k): how fast a little more of s relaxes."""
    if film.activation is None:
        return 1 / film.time[:, None]
    squared = p[0] ** 2 - p[0] * p[1] + p[1] ** 2
    factor, slope = film.activation(squared)
    return (factor + 2 * squared * slope) / film.time[:, None]


def tangent(film: Film, log_stretch: Any, log_viscous: Any, kind: str, value: Any, weight: Any = 1.0) -> Floats:
    """T (3, k) = weighted spring tangents + that of the dielectric - s_i l_i on the diagonal, in ln l; `weight` (N, k) or 1.

    T_ij/(l_i l_j) is ds_i/dl_j. At fixed field its determinant is zero where that of the Hessian of Eqs. 9 and 10 of
    DOI 10.1115/1.4030850 is.
    """
    soft, hard = spring_tangent(film, log_stretch, log_viscous)
    electric = potential(film, kind, value)(*stretches(log_stretch)).parts
    pull = log_stress(film.equilibrium, log_stretch) + branch_stress(film, log_stretch, log_viscous).sum(axis=1) + electric[1:3]
    result = soft + (weight * hard).sum(axis=1) + electric[3:]
    result[[0, 2]] -= pull
    return result


def _solve(matrix: Floats, right: Floats, free: Sequence[int]) -> Floats:
    """Solution (2, k) of the free axes' part of a symmetric 2x2 system (3, k), zero on the other axes."""
    result = np.zeros_like(right)
    if len(free) == 2:
        determinant = matrix[0] * matrix[2] - matrix[1] ** 2
        result[0] = (matrix[2] * right[0] - matrix[1] * right[1]) / determinant
        result[1] = (matrix[0] * right[1] - matrix[1] * right[0]) / determinant
    elif free:
        result[free[0]] = right[free[0]] / matrix[2 * free[0]]
    return result


class _Balance:
    """Newton's method for the free stretches of a piece, from `guess`, with `matrix` as the first tangent if that is known."""

    def __init__(self, film: Film, piece: Piece, start: Floats) -> None:
        self.film, self.piece, self.guess = film, piece, start[:, None]
        self.free = [axis for axis in range(2) if piece.axes[axis][0] == "stress"]
        self.kind = "field" if piece.electric[0] == "field" else "charge"
        self.matrix: Floats | None = None

    def loads(self, t: Any, charge: Any) -> tuple[Any, Any, Any]:
        """The prescribed value of each axis, and the field or charge that the dielectric's potential holds fixed."""
        electric = charge if self.piece.electric[0] == "source" else self.piece.electric[1](t)
        return self.piece.axes[0][1](t), self.piece.axes[1][1](t), electric

    def solve(self, x: Floats, loads: tuple[Any, Any, Any], guess: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """ln l (2, k), p of the branches (2, N, k) and of everything (2, k), at ln xi (2, N, k)."""
        film, electric = self.film, potential(self.film, self.kind, loads[2])
        log = np.array(np.broadcast_to(self.guess if guess is None else guess, (2, x.shape[2])))
        for axis in {0, 1} - set(self.free):
            log[axis] = np.log(loads[axis])
        matrix, previous, last = self.matrix, np.inf, log

        def rest(l1: Any, l2: Any) -> Any:
            return film.equilibrium(l1, l2) + electric(l1, l2)

        for _ in range(NEWTON_STEPS):
            with np.errstate(invalid="ignore", divide="ignore"):
                hard = branch_stress(film, log, x)
                total = hard.sum(axis=1) + log_stress(rest, log)
            if not np.all(np.isfinite(total)):  # beyond what a spring can bear: half the way
                log, matrix, previous = 0.5 * (log + last), None, np.inf
                continue
            if not self.free:
                break
            if matrix is None:
                matrix = tangent(film, log, x, self.kind, loads[2])
            imbalance = total.copy()
            for axis in self.free:
                imbalance[axis] -= loads[axis] * np.exp(log[axis])
            step = _solve(matrix, imbalance, self.free)
            size = float(np.max(np.abs(step)))
            log, last = log - np.clip(step, -LARGEST_STEP, LARGEST_STEP), log
            if size < ENOUGH or previous / 2 < size < ACCEPTABLE:
                break
            matrix = matrix if size < SLOW * previous else None
            previous = size
        else:
            raise FloatingPointError("Newton's method did not converge: no equilibrium near by")
        return log, hard, total


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """What a film did at times (T,): stretches and nominal stresses (2, T), nominal `field` and `charge`, `true_field`, `damage`
    (T,), `log_viscous` (2, N, T), all in SI units.
    """

    time: Floats
    stretch: Floats
    stress: Floats
    field: Floats
    charge: Floats
    true_field: Floats
    damage: Floats
    log_viscous: Floats


class _Segment:
    """One piece of load, solved: the dense solution y(t) = (ln xi_1, ln xi_2, d/charge_unit, damage) from `start` s on."""

    def __init__(self, film: Film, piece: Piece, state: State, rtol: float, atol: float, theta: Course | None = None) -> None:
        """With `theta`, the piece is cut short where the film pulls in."""
        self.film, self.piece, self.start, self.count = film, piece, state.time, film.modulus.size
        self.balance = balance = _Balance(film, piece, state.log_stretch)
        self.unit, self.lost = film.charge_unit, 0
        self._jump(state)
        y = np.concatenate((state.log_viscous.ravel(), [state.charge / self.unit, state.damage]))
        self.sol: OdeSolution | None = None
        self.knots, self.path = np.zeros(1), balance.guess
        self.reference: tuple[Floats, Floats, Floats] = y, balance.guess, np.zeros((2, y.size))
        if piece.duration > 0:
            tight: Any = {"method": "Radau", "rtol": rtol, "atol": atol, "dense_output": True, "jac": self._jacobian}
            if theta is not None:
                tight["events"] = self._until_pull_in(theta)
            solved = solve_ivp(self._rate, (0.0, piece.duration), y, **tight)
            if not solved.success:
                raise FloatingPointError(solved.message)
            self.sol, self.knots = solved.sol, solved.t
            self.piece = balance.piece = replace(piece, duration=float(solved.t[-1]))
            self.path = np.empty((2, self.knots.size))
            balance.matrix, guess = None, balance.guess
            for row, t in enumerate(self.knots):
                self.path[:, row : row + 1] = guess = self._at(np.array([t]), guess)[0]
        self.first = y

    def _jump(self, state: State) -> None:
        """The equilibrium that loads applied at once lead to, from the present one, part by part."""
        aims, before = self.balance.loads(0.0, state.charge), [*state.stress, state.field]
        for axis in range(2):
            if self.piece.axes[axis][0] == "stretch":
                before[axis] = np.exp(state.log_stretch[axis])
        if self.balance.kind == "charge":
            before[2] = state.charge
        jumps = not np.allclose(aims, before, rtol=1e-9, atol=0)
        x = state.log_viscous[:, :, None]
        for share in np.linspace(0, 1, JUMP_PARTS + 1)[1:] if jumps else [1.0]:
            loads = [share * aim + (1 - share) * value if share < 1 else aim for aim, value in zip(aims, before, strict=True)]
            self.balance.guess = self.balance.solve(x, tuple(loads), self.balance.guess)[0]

    def _unpack(self, y: Floats) -> tuple[Floats, Floats, Floats]:
        n = self.count
        y = y.reshape(2 * n + 2, -1)
        return y[: 2 * n].reshape(2, n, y.shape[1]), y[2 * n] * self.unit, y[2 * n + 1]

    def _field(self, t: Any, log: Floats, charge: Any) -> tuple[Any, Any]:
        """Nominal field and nominal charge."""
        capacity = self.film.eps(*np.exp(log)) * np.exp(2 * (log[0] + log[1]))
        kind, course = self.piece.electric
        if kind == "field":
            return course(t) + 0 * log[0], course(t) * capacity
        charge = (charge if kind == "source" else course(t)) + 0 * log[0]
        return charge / capacity, charge

    def _currents(self, t: Any, log: Floats, charge: Any) -> Floats:
        """Rates of d/charge_unit and of the damage, (2, k)."""
        field, charge = self._field(t, log, charge)
        true = field * np.exp(log[0] + log[1])
        result = np.zeros((2, *np.shape(true)))
        if self.piece.electric[0] == "source":
            leak = 0.0 if self.film.leakage is None else self.film.leakage(true) * np.exp(log[0] + log[1])
            result[0] = ((self.piece.electric[1](t) - field) / self.piece.resistance - leak) / self.unit
        if self.film.damage is not None:
            strength, time, exponent = self.film.damage
            result[1] = np.abs(true / strength) ** exponent / time
        return result

    def _rate(self, t: float, y: Floats) -> Floats:
        x, charge, _ = self._unpack(y)
        last, log, move = self.reference  # d ln l/dy is known from the Jacobian
        guess = log + (move @ (y - last))[:, None]
        try:
            log, hard, _ = self.balance.solve(x, self.balance.loads(t, charge), guess)
        except FloatingPointError:  # a trial beyond the end of the equilibrium: the solver takes a shorter step
            self.lost += 1
            if self.lost > TRIALS:
                raise
            return np.full_like(y, np.nan)
        self.reference = y, log, move
        return np.concatenate((flow_rate(self.film, hard).ravel(), self._currents(t, log, charge).ravel()))

    def _jacobian(self, t: float, y: Floats) -> Floats:
        """d rate/dy with the stretches eliminated: dl = T^-1 (sum K_k d ln xi^k - dp/dd dd) on the free axes."""
        film, n = self.film, self.count
        x, charge, _ = self._unpack(y)
        loads = self.balance.loads(t, charge)
        log, *_ = self.balance.solve(x, loads, self.reference[1])
        hard = spring_tangent(film, log, x)[1][[0, 1, 1, 2], :, 0].reshape(2, 2, n)
        matrix = tangent(film, log, x, self.balance.kind, loads[2])
        columns = np.zeros((2, 2 * n + 2))  # -d p/dy at fixed l
        columns[:, : 2 * n] = hard.reshape(2, 2 * n)
        if self.piece.electric[0] == "source" and charge[0] != 0:
            squeeze = log_stress(potential(film, "charge", loads[2]), log)[:, 0]
            columns[:, 2 * n] = -2 * squeeze / charge[0] * self.unit  # U goes with d^2
        move = _solve(np.broadcast_to(matrix, (3, 2 * n + 2)), columns, self.balance.free)  # d ln l/dy
        self.reference, self.balance.matrix = (y, log, move), matrix
        flow = mobility(film, branch_stress(film, log, x))[..., 0]
        slope = np.einsum("ijn,jln,lm->inm", flow, hard, move).reshape(2 * n, 2 * n + 2)
        direct = np.einsum("ijn,jln->iln", flow, hard)
        for branch in range(n):
            slope[np.ix_([branch, n + branch], [branch, n + branch])] -= direct[:, :, branch]
        step = 1e-6
        shifts = step * np.eye(2)
        by_stretch = (self._currents(t, log + shifts, charge) - self._currents(t, log - shifts, charge)) / (2 * step)
        by_charge = self._currents(t, log, charge + step * self.unit) - self._currents(t, log, charge - step * self.unit)
        last = by_stretch @ move
        last[:, 2 * n] += by_charge[:, 0] / (2 * step)
        return np.concatenate((slope, last))

    def _y(self, t: Floats) -> Floats:
        """y (2 N + 2, k) at times (k,) since the piece began."""
        return np.repeat(self.first[:, None], t.size, axis=1) if self.sol is None else self.sol(t)

    def _at(self, t: Floats, guess: Floats | None = None) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """ln l, p of everything, ln xi, d and damage at times (k,) since the piece began."""
        x, charge, damage = self._unpack(self._y(t))
        if guess is None:
            guess = np.stack([np.interp(t, self.knots, row) for row in self.path])
        log, _, total = self.balance.solve(x, self.balance.loads(t, charge), guess)
        return log, total, x, charge, damage

    def history(self, t: Floats) -> History:
        """The film at times (k,) in s since the piece began."""
        log, total, x, charge, damage = self._at(t)
        field, charge = self._field(t, log, charge)
        true = field * np.exp(log[0] + log[1])
        return History(self.start + t, np.exp(log), total / np.exp(log), field, charge, true, damage, x)

    def determinant(self, t: Floats, theta: Course) -> Floats:
        """Determinant of ds_i/dl_j of the axes under stress, at fixed nominal field (at fixed charge under a charge), in Pa^2, Pa
        or 1, at times (k,); each branch with the weight exp(-theta `relaxation_rate`), `theta` in s of the time in s, and under a
        source with the charge that flows within theta.
        """
        log, _, x, charge, _ = self._at(t)
        return self._watched(t, log, x, charge, theta(self.start + t))

    def _watched(self, t: Floats, log: Floats, x: Floats, charge: Floats, theta: Any) -> Floats:
        """The determinant (k,) of films with ln l (2, k), ln xi (2, N, k) and charge (k,), watched for theta in s."""
        weight = np.exp(-theta * relaxation_rate(self.film, branch_stress(self.film, log, x)))
        electric = self.balance.loads(t, charge)[2]
        matrix = tangent(self.film, log, x, self.balance.kind, electric, weight)[[0, 1, 1, 2]].reshape(2, 2, -1)
        if self.piece.electric[0] == "source":
            # dq/dt = a dl + b dq after a change dl, so that dq = a (exp(b theta) - 1)/b dl; p goes with q^2
            shift = 1e-6
            moves = [shift * axis for axis in np.eye(2)[:, :, None]]
            a = [(self._currents(t, log + move, charge) - self._currents(t, log - move, charge))[0] for move in moves]
            more = shift * self.unit
            b = (self._currents(t, log, charge + more) - self._currents(t, log, charge - more))[0] / (2 * shift)
            flown = self.unit * np.array(a) / (2 * shift) * np.where(b < 0, np.expm1(b * theta) / np.where(b < 0, b, 1.0), theta)
            squeeze = log_stress(potential(self.film, "charge", electric), log)
            matrix = matrix + 2 * (squeeze / np.where(charge == 0, 1.0, charge))[:, None] * flown
        free, stretch = self.balance.free, np.exp(log)
        if len(free) == 2:
            return (matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]) / (stretch[0] * stretch[1]) ** 2
        return matrix[free[0], free[0]] / stretch[free[0]] ** 2 if free else np.ones_like(t)

    def _until_pull_in(self, theta: Course) -> Callable[[float, Floats], float]:
        """The determinant, as a terminal event of the solver."""

        def pulled_in(t: float, y: Floats) -> float:
            x, charge, _ = self._unpack(y)
            log = self.balance.solve(x, self.balance.loads(t, charge), self.reference[1])[0]
            return float(self._watched(np.array([t]), log, x, charge, theta(self.start + t))[0])

        pulled_in.terminal, pulled_in.direction = True, -1  # type: ignore[attr-defined]
        return pulled_in


def falls(signal: Callable[[Floats], Floats], knots: Floats, before: float) -> tuple[list[float], float]:
    """Times at which a signal of times (k,) falls through zero, looked for between the `knots` (k,) of a solver's steps, and its
    last value. The first time counts if the signal was above zero `before` the first knot.
    """
    dense = np.interp(np.arange(SAMPLES * (knots.size - 1) + 1) / SAMPLES, np.arange(knots.size), knots)
    values = signal(dense)
    rows = np.flatnonzero((values[:-1] > 0) & (values[1:] <= 0))
    found = [float(knots[0])] if before > 0 >= values[0] else []
    found += [
        brentq(lambda t: float(signal(np.array([t]))[0]), dense[row], dense[row + 1], xtol=1e-300, rtol=1e-14) for row in rows
    ]
    return found, float(values[-1])


class Run:
    """A film through pieces of load, from `state` (at rest by default); `theta` in s of the time in s watches for pull-in.

    Radau's tolerances are `rtol` and `atol`. Raises `FloatingPointError` where the equilibrium ends, or `until_pull_in` cuts the
    last piece short at pull-in; `pulled_in` is its time, None without one.
    """

    def __init__(
        self,
        film: Film,
        pieces: Sequence[Piece],
        state: State | None = None,
        *,
        theta: Course = lambda t: 0.01 * t,
        rtol: float = 1e-10,
        atol: float = 1e-13,
        until_pull_in: bool = False,
    ) -> None:
        self.film, self.theta = film, theta
        self.pulled_in: float | None = None
        self.segments: list[_Segment] = []
        state = at_rest(film) if state is None else state
        for stated in pieces:
            if until_pull_in:
                first = _Segment(film, replace(stated, duration=0.0), state, rtol, atol)
                if first.determinant(np.zeros(1), theta)[0] <= 0:
                    self.pulled_in = state.time
                    break
            segment = _Segment(film, stated, state, rtol, atol, theta if until_pull_in else None)
            self.segments.append(segment)
            piece = segment.piece
            end = segment.history(np.array([piece.duration]))
            state = State(
                end.log_viscous[..., 0],
                np.log(end.stretch[:, 0]),
                end.stress[:, 0],
                float(end.field[0]),
                float(end.charge[0]),
                float(end.damage[0]),
                state.time + piece.duration,
            )
            if piece.duration < stated.duration:
                self.pulled_in = state.time
                break
        self.final = state

    def at(self, times: ArrayLike) -> History:
        """The film at ascending times (T,) in s; at a time where two pieces meet, at the end of the earlier."""
        parts, left = [], np.atleast_1d(np.asarray(times, dtype=float))
        for segment in self.segments:
            end = segment.start + segment.piece.duration
            here, left = left[left <= end * (1 + 1e-14)], left[left > end * (1 + 1e-14)]
            if here.size:
                parts.append(segment.history(np.clip(here - segment.start, 0.0, segment.piece.duration)))
        values = [np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in History.__slots__]
        return History(*values)

    def determinant(self, times: ArrayLike) -> Floats:
        """Weighted pull-in determinant at ascending times (T,), see `_Segment.determinant`."""
        left, parts = np.atleast_1d(np.asarray(times, dtype=float)), []
        for segment in self.segments:
            end = segment.start + segment.piece.duration
            here, left = left[left <= end], left[left > end]
            if here.size:
                parts.append(segment.determinant(here - segment.start, self.theta))
        return np.concatenate(parts)

    def events(self, name: str) -> list[float]:
        """Times in s at which "breakdown", "pull-in", "damage", "loss-of-tension-1" or "loss-of-tension-2" begins: the dense roots
        of its signal on the way down, and the times of loads at once that take it below zero. Pull-in can be seen only as long as
        the equilibrium goes on: with theta > 0 it comes before the end; for theta = 0 see `fold`.
        """
        found: list[float] = []
        before = 0.0 if name.startswith("loss") else np.inf  # a film can lose only a tension that it had
        for segment in self.segments:
            times, before = falls(lambda t, segment=segment: self._signal(name, segment, t), segment.knots, before)
            found += [segment.start + t for t in times]
            if np.isnan(before):  # a prescribed stress cannot fall, but it is a tension that grips may take away
                before = float(segment.piece.axes[int(name[-1]) - 1][1](segment.piece.duration))
        return found

    def _signal(self, name: str, segment: _Segment, t: Floats) -> Floats:
        """What falls through zero at an event, at times (k,) since the piece began."""
        if name == "pull-in":
            return segment.determinant(t, self.theta)
        here = segment.history(t)
        if name == "breakdown":
            limit = self.film.breakdown(*here.stretch) if callable(self.film.breakdown) else self.film.breakdown
            return 1 - here.true_field / limit
        if name == "damage":
            return 1 - here.damage
        axis = {"loss-of-tension-1": 0, "loss-of-tension-2": 1}[name]
        return here.stress[axis] if axis not in segment.balance.free else np.full_like(t, np.nan)


def fold(film: Film, piece: Piece, state: State, rtol: float = 1e-10) -> State:
    """Where a film under constant loads and with every branch frozen loses its stability (Eq. 9 to the letter), as a `State`.

    There the stretch has a vertical tangent in time. With the tangent T of the free axes, and s in place of the time,
        dt/ds = det T,   d ln l/ds = adj(T) sum_k K_k g_k,   d ln xi/ds = g det T,   g = d ln xi/dt,
    are the same curve and smooth through it; the fold is the root of det T. det T is taken over its value at the beginning.
    """
    first = _Segment(film, replace(piece, duration=0.0), state, rtol, 1e-13)
    balance, n = first.balance, film.modulus.size
    free, electric = balance.free, piece.electric[1](0.0)
    assert piece.electric[0] == "field"

    def slopes(z: Floats) -> tuple[float, Floats]:
        log, x = z[:2, None], z[2 : 2 + 2 * n].reshape(2, n, 1)
        hard, steep = branch_stress(film, log, x), spring_tangent(film, log, x)[1][[0, 1, 1, 2], :, 0].reshape(2, 2, n)
        flow = flow_rate(film, hard)[..., 0]
        matrix = tangent(film, log, x, "field", electric)[:, 0]
        determinant = matrix[0] * matrix[2] - matrix[1] ** 2 if len(free) == 2 else matrix[2 * free[0]]
        drive = np.einsum("ijn,jn->i", steep, flow)
        move = np.zeros(2)  # adj(T) drive, without a division by det T
        if len(free) == 2:
            move[:] = matrix[2] * drive[0] - matrix[1] * drive[1], matrix[0] * drive[1] - matrix[1] * drive[0]
        else:
            move[free[0]] = drive[free[0]]
        return float(determinant), np.concatenate((move, (determinant * flow).ravel(), [determinant]))

    z = np.concatenate((first.path[:, 0], state.log_viscous.ravel(), [0.0]))
    scale = slopes(z)[0]

    def singular(s: float, z: Floats) -> float:
        return slopes(z)[0] / scale

    singular.terminal = True  # type: ignore[attr-defined]
    tight: Any = {"method": "Radau", "rtol": rtol, "atol": 1e-12, "events": singular}
    solved = solve_ivp(lambda s, z: slopes(z)[1] / scale, (0.0, 1e3 * piece.duration), z, **tight)
    if not solved.t_events[0].size:
        raise FloatingPointError("no fold within the piece")
    end = solved.y_events[0][0]
    return replace(
        state, log_stretch=end[:2], log_viscous=end[2:-1].reshape(2, n), time=state.time + float(end[-1]), field=electric
    )
