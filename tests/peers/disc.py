"""An active region in a passive film on a rigid frame: closed forms, shooting, and the semi-discrete film.

Disc: undeformed polar radius R in units of the electrode's radius A, rho = A/B with the frame at R = B, r(R) the deformed radius,
stretches l1 = dr/dR, l2 = r/R, nominal stresses S1 (radial) and S2 (hoop) with dS1/dR + (S1 - S2)/R = 0 in the passive annulus,
r(B) = lp B, and the disc homogeneous with S1 = [l dW/dl1 - eps e^2 l^4]/l at its stretch l = l_a, e = V/H the nominal field.

The semi-discrete film is the stationary point of Pi = sum_p w_p [W(l^p, xi^p) + U_p(l^p)] - f.u in the unknowns u: material
points p of undeformed areas w_p (that of the disc is 1), the stretches of which are linear in u. `disc` has linear elements in r
with one point each, in the middle; `strip` two points in series. Every point has branches after the equations of peers.membrane.

For scipy's Radau, which takes no algebraic equations, u follows its equilibrium by dampers, c du/dt = -dPi/du, with c so small
that u lags by the damper's time (`damper` in s, far below every other time): an error of du/dt times that time. The Jacobian is
sparse then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from peers.energies import Energy, stress, tangent
from peers.membrane import (
    NOTHING,
    Course,
    Film,
    branch_stress,
    falls,
    flow_rate,
    log_stress,
    mobility,
    potential,
    relaxation_rate,
    spring_tangent,
)
from peers.taylor import stretches
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.sparse import block_array, bsr_array, csc_matrix, csr_array, diags_array
from scipy.sparse.linalg import spsolve

Floats = NDArray[np.float64]

JUMP_PARTS, NEWTON_STEPS = 20, 60  # parts of a load at once, and steps of Newton's method for one
LARGEST_STEP, ROUNDING, ACCEPTABLE = (
    0.1,
    4e-15,
    1e-10,
)  # relative changes of u: the largest, that at the end, and where it may stagnate


# Closed forms and shooting


def small_strain(mu: float, eps: float, field: float, rho: float) -> float:
    """Strain of an elastic disc without prestretch, eps e^2 (1 - rho^2)/(8 mu), field in V/m, mu in Pa."""
    return eps * field**2 * (1 - rho**2) / (8 * mu)


def creep_compliance(mu: float, modulus: Floats, time: Floats, at: ArrayLike) -> Floats:
    """Shear creep compliance J(t) in 1/Pa at times (T,) of the relaxation modulus mu + sum mu_k exp(-t/tau_k).

    Strain g under a unit stress: mu g + sum mu_k (g - v_k) = 1, tau_k dv_k/dt = g - v_k, a linear system solved by its matrix
    exponential.
    """
    whole, n = mu + modulus.sum(), modulus.size
    system = np.zeros((n + 1, n + 1))  # of (v, 1): g = (1 + sum mu_k v_k)/whole
    system[:n, :n] = (modulus / whole - np.eye(n)) / time[:, None]
    system[:n, n] = 1 / (whole * time)
    viscous = np.stack([expm(system * t)[:n, n] for t in np.atleast_1d(np.asarray(at, dtype=float))], axis=1)
    return np.asarray((1 + modulus @ viscous) / whole)


def shoot(energy: Energy, prestretch: float, rho: float, stretch: float) -> tuple[float, Callable[[ArrayLike], Floats]]:
    """eps e^2 in Pa (in units of the energy) that takes the elastic disc to `stretch`, and (l1, l2, S1, S2) of the annulus over R.

    Outwards from R = A, with x = ln R: dl2/dx = l1 - l2 and W_11 dl1/dx = -(W_1 - W_2) - W_12 (l1 - l2); l1(A) is the root of
    l2(B) = lp. The field then follows from the continuity of S1.
    """

    def slopes(_: float, pair: Floats) -> Floats:
        w, s, apart = tangent(energy, *pair), stress(energy, *pair), pair[0] - pair[1]
        return np.array([(-(s[0] - s[1]) - w[0, 1] * apart) / w[0, 0], apart])

    def solved(first: float) -> Any:
        return solve_ivp(slopes, (0.0, -np.log(rho)), [first, stretch], method="DOP853", rtol=1e-12, atol=1e-13, dense_output=True)

    if stretch == prestretch:
        first = stretch
    else:  # l1(A) is below the prestretch where the disc has grown
        first = brentq(lambda x: solved(x).y[1, -1] - prestretch, 0.3 * prestretch, 1.5 * prestretch, xtol=1e-14, rtol=1e-14)
    inner = stress(energy, first, stretch)[0]
    squeeze = (stretch * stress(energy, stretch, stretch)[0] - stretch * inner) / stretch**4
    path = solved(first).sol

    def profile(radius: ArrayLike) -> Floats:
        pair = path(np.log(np.asarray(radius, dtype=float)))
        return np.concatenate((pair, stress(energy, *pair)))

    return float(squeeze), profile


# The semi-discrete film


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """P material points with weights `weight` (P,), of which `active` (P,) bool carry the voltage.

    Their stretches l[2 p + axis] are `gather` (2P, U) @ u + `fixed` (2P, F) @ frame for unknowns u (U,) and prescribed frame
    stretches (F,); `home` (U, F) @ frame is u where the film is homogeneous; `pull` (U,) times a nominal tension is the load on u.
    `radius` (P,) is R/A of the points of a disc.
    """

    weight: Floats
    gather: csr_array
    fixed: Floats
    home: Floats
    active: NDArray[np.bool_]
    pull: Floats
    radius: Floats


def graded(rho: float, elements: int) -> Floats:
    """Nodes R/A of an annulus, (elements + 1,), from 1 to 1/rho, in geometric steps."""
    return np.geomspace(1.0, 1 / rho, elements + 1)


def disc(nodes: Floats) -> Structure:
    """The disc and its annulus with `nodes` (M + 1,) in R/A; u (M,) are the nodes' r/A but for the frame's, frame = (lp,)."""
    size, middle = nodes[1:] - nodes[:-1], 0.5 * (nodes[1:] + nodes[:-1])
    elements = size.size
    whole = np.zeros((2 * elements + 2, elements + 1))
    whole[:2, 0] = 1.0
    rows = np.arange(elements)
    whole[2 + 2 * rows, rows], whole[2 + 2 * rows, rows + 1] = -1 / size, 1 / size
    whole[3 + 2 * rows, rows] = whole[3 + 2 * rows, rows + 1] = 0.5 / middle
    return Structure(
        weight=np.concatenate(([1.0], 2 * middle * size)),
        gather=csr_array(whole[:, :-1]),
        fixed=whole[:, -1:] * nodes[-1],
        home=nodes[:-1, None],
        active=np.arange(elements + 1) == 0,
        pull=np.zeros(elements),
        radius=np.concatenate(([0.0], middle)),
    )


def free_disc() -> Structure:
    """The disc alone with a free rim under a nominal tension: a dead load, u = (l_a,)."""
    one = np.ones((1, 1))
    return Structure(np.ones(1), csr_array(np.ones((2, 1))), np.zeros((2, 1)), one, np.array([True]), np.array([2.0]), np.zeros(1))


def strip(share: float) -> Structure:
    """A film clamped in its width, stretch lp2, its length lp1 shared by an active part, the `share` f of it, and a passive one:
    f l_a + (1 - f) l_p = lp1, S1 equal in both. u = (l_a,), frame = (lp1, lp2).
    """
    rest = 1 - share
    return Structure(
        weight=np.array([share, rest]),
        gather=csr_array(np.array([[1.0], [0.0], [-share / rest], [0.0]])),
        fixed=np.array([[0.0, 0.0], [0.0, 1.0], [1 / rest, 0.0], [0.0, 1.0]]),
        home=np.array([[1.0, 0.0]]),
        active=np.array([True, False]),
        pull=np.zeros(1),
        radius=np.zeros(2),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """A smooth piece of load: `duration` in s, nominal `field` in V/m, stretches of the `frame` (a course each), and a nominal
    `tension` in Pa, over the time since the piece began.
    """

    duration: float
    frame: tuple[Course, ...]
    field: Course = NOTHING
    tension: Course = NOTHING


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """A structure at a time in s: unknowns `u` (U,), ln xi `log_viscous` (2, N, P), and the loads: stretches of the `frame` (F,),
    nominal `field` in V/m and `tension` in Pa.
    """

    u: Floats
    log_viscous: Floats
    frame: Floats
    field: float = 0.0
    tension: float = 0.0
    time: float = 0.0


def at_rest(film: Film, structure: Structure) -> Moment:
    """The film before anything happened."""
    frame = np.ones(structure.fixed.shape[1])
    return Moment(structure.home @ frame, np.zeros((2, film.modulus.size, structure.weight.size)), frame)


@dataclass(frozen=True, slots=True, eq=False)
class Fields:
    """All points at times (T,): stretches and nominal stresses with the Maxwell stress included (2, P, T), u (U, T), `field` (T,)
    nominal, in V/m, and `log_viscous` (2, N, P, T).
    """

    time: Floats
    stretch: Floats
    stress: Floats
    u: Floats
    field: Floats
    log_viscous: Floats


class _Assembly:
    """dPi/du, its derivatives, and the flow of all points of a structure."""

    def __init__(self, film: Film, structure: Structure) -> None:
        self.film, self.structure = film, structure
        self.points, self.branches = structure.weight.size, film.modulus.size
        self.double = np.repeat(structure.weight, 2)
        blocks = self.points * self.branches
        self.diagonal = np.arange(blocks + 1)
        self.of_point = np.repeat(np.arange(self.points), self.branches)

    def stretch(self, u: Floats, frame: Floats) -> Floats:
        """Stretches (2, P)."""
        return (self.structure.gather @ u + self.structure.fixed @ frame).reshape(-1, 2).T

    def stresses(self, log: Floats, x: Floats, field: float) -> tuple[Floats, Floats]:
        """p of everything (2, P) and of the branches (2, N, P)."""
        electric = potential(self.film, "field", field * self.structure.active)
        hard = branch_stress(self.film, log, x)
        return hard.sum(axis=1) + log_stress(lambda l1, l2: self.film.equilibrium(l1, l2) + electric(l1, l2), log), hard

    def residual(self, stretch: Floats, total: Floats, tension: float) -> Floats:
        """dPi/du (U,)."""
        return self.structure.gather.T @ (self.double * (total / stretch).T.ravel()) - tension * self.structure.pull

    def stiffness(self, log: Floats, x: Floats, field: float, weight: Any = 1.0) -> csc_matrix:
        """d2Pi/du2 (U, U) with each branch's tangent times `weight` (N, 1) or 1."""
        total, _ = self.stresses(log, x, field)
        soft, hard = spring_tangent(self.film, log, x)
        electric = potential(self.film, "field", field * self.structure.active)(*stretches(log)).parts[3:]
        matrix = soft + (weight * hard).sum(axis=1) + electric
        matrix[[0, 2]] -= total
        stretch = np.exp(log)
        blocks = matrix[[0, 1, 1, 2]].reshape(2, 2, -1) / (stretch[:, None] * stretch[None])
        w = self.structure.weight
        inner = bsr_array((np.moveaxis(w * blocks, 2, 0), np.arange(self.points), np.arange(self.points + 1)))
        return csc_matrix(self.structure.gather.T @ inner @ self.structure.gather)

    def jacobian(self, log: Floats, x: Floats, field: float, damping: Floats) -> csc_matrix:
        """d(du/dt, d ln xi/dt)/d(u, ln xi), viscous stretches in the order (P, N, 2), sparse."""
        film, gather, blocks = self.film, self.structure.gather, self.points * self.branches
        top = diags_array(-1 / damping) @ self.stiffness(log, x, field)
        if not blocks:
            return csc_matrix(top)
        stretch = np.exp(log)
        hard = spring_tangent(film, log, x)[1][[0, 1, 1, 2]].reshape(2, 2, self.branches, self.points).transpose(3, 2, 0, 1)
        flow = mobility(film, branch_stress(film, log, x)).transpose(3, 2, 0, 1) @ hard
        by_point = np.broadcast_to(np.arange(blocks), (blocks,))
        pushed = -(self.structure.weight / stretch).T[:, None, :, None] * hard
        across = gather.T @ bsr_array((pushed.reshape(-1, 2, 2), by_point, self.branches * np.arange(self.points + 1)))
        driven = (flow / stretch.T[:, None, None, :]).reshape(-1, 2, 2)
        down = bsr_array((driven, self.of_point, self.diagonal), shape=(2 * blocks, 2 * self.points)) @ gather
        relaxing = bsr_array((-flow.reshape(-1, 2, 2), by_point, self.diagonal))
        return csc_matrix(block_array([[top, diags_array(-1 / damping) @ across], [down, relaxing]]))


class _Part:
    """One piece of load of a structure, solved: y = (u less its first value, ln xi in the order P, N, 2) over time."""

    def __init__(self, assembly: _Assembly, drive: Drive, moment: Moment, rtol: float, atol: float, damper: float) -> None:
        self.assembly, self.drive, self.start = assembly, drive, moment.time
        none = np.zeros_like(moment.log_viscous)
        self.damping = damper * assembly.stiffness(np.zeros((2, assembly.points)), none, 0.0).diagonal()
        self.base = self._jump(moment)
        self.first = np.concatenate((np.zeros(self.base.size), moment.log_viscous.transpose(2, 1, 0).ravel()))
        self.knots, self.sol = np.zeros(1), None
        if drive.duration > 0:
            tight: Any = {"method": "Radau", "rtol": rtol, "atol": atol, "dense_output": True, "jac": self._jacobian}
            solved = solve_ivp(self._rate, (0.0, drive.duration), self.first, **tight)
            if not solved.success:
                raise FloatingPointError(solved.message)
            self.knots, self.sol = solved.t, solved.sol

    def _loads(self, t: float) -> tuple[Floats, float, float]:
        """Frame (F,), nominal field and tension at a time since the piece began."""
        return np.array([course(t) for course in self.drive.frame]), self.drive.field(t), self.drive.tension(t)

    def _jump(self, moment: Moment) -> Floats:
        """u (U,) at the beginning: the equilibrium that loads applied at once lead to from the present one, part by part."""
        aim, before, u = self._loads(0.0), (moment.frame, moment.field, moment.tension), moment.u
        same, last = all(np.allclose(a, b, rtol=1e-12, atol=0) for a, b in zip(aim, before, strict=True)), moment.frame
        for share in [1.0] if same else np.linspace(0, 1, JUMP_PARTS + 1)[1:]:
            frame, field, tension = (share * a + (1 - share) * b for a, b in zip(aim, before, strict=True))
            u, last, previous = u + self.assembly.structure.home @ (frame - last), frame, np.inf
            for _ in range(NEWTON_STEPS):
                stretch = self.assembly.stretch(u, frame)
                log = np.log(stretch)
                total, _ = self.assembly.stresses(log, moment.log_viscous, field)
                residual = self.assembly.residual(stretch, total, tension)
                step = spsolve(self.assembly.stiffness(log, moment.log_viscous, field), residual)
                size = float(np.max(np.abs(step / u)))
                u = u - step * min(1.0, LARGEST_STEP / max(size, 1e-300))
                if size < ROUNDING or previous / 2 < size < ACCEPTABLE:
                    break
                previous = size
            else:
                raise FloatingPointError("Newton's method did not converge: no equilibrium near by")
        return u

    def _unpack(self, t: float, y: Floats) -> tuple[Floats, Floats, tuple[Floats, float, float]]:
        """Stretches (2, P), ln xi (2, N, P) and loads."""
        loads, n = self._loads(t), self.base.size
        x = y[n:].reshape(self.assembly.points, self.assembly.branches, 2).transpose(2, 1, 0)
        return self.assembly.stretch(self.base + y[:n], loads[0]), x, loads

    def _rate(self, t: float, y: Floats) -> Floats:
        stretch, x, (_, field, tension) = self._unpack(t, y)
        total, hard = self.assembly.stresses(np.log(stretch), x, field)
        flow = flow_rate(self.assembly.film, hard).transpose(2, 1, 0)
        return np.concatenate((-self.assembly.residual(stretch, total, tension) / self.damping, flow.ravel()))

    def _jacobian(self, t: float, y: Floats) -> csc_matrix:
        stretch, x, (_, field, _) = self._unpack(t, y)
        return self.assembly.jacobian(np.log(stretch), x, field, self.damping)

    def at(self, t: float) -> tuple[Floats, Floats, Floats, Floats, float]:
        """Stretches (2, P), nominal stresses (2, P), u (U,), ln xi (2, N, P) and field at a time since the piece began."""
        y = self.first if self.sol is None else self.sol(t)
        stretch, x, (_, field, _) = self._unpack(t, y)
        total, _ = self.assembly.stresses(np.log(stretch), x, field)
        return stretch, total / stretch, self.base + y[: self.base.size], x, field


class DiscRun:
    """A structure through pieces of load, from `moment` (at rest by default); `theta` in s of the time in s watches for pull-in.

    `damper` is the time in s by which u lags. Raises `FloatingPointError` where the solver gives up.
    """

    def __init__(
        self,
        film: Film,
        structure: Structure,
        drives: Sequence[Drive],
        moment: Moment | None = None,
        *,
        theta: Course = lambda t: 0.01 * t,
        rtol: float = 1e-8,
        atol: float = 1e-11,
        damper: float = 1e-12,
    ) -> None:
        self.film, self.structure, self.theta = film, structure, theta
        self.assembly = _Assembly(film, structure)
        self.parts: list[_Part] = []
        moment = at_rest(film, structure) if moment is None else moment
        for drive in drives:
            part = _Part(self.assembly, drive, moment, rtol, atol, damper)
            self.parts.append(part)
            _, _, u, x, field = part.at(drive.duration)
            frame, _, tension = part._loads(drive.duration)
            moment = Moment(u, x, frame, float(field), float(tension), moment.time + drive.duration)
        self.final = moment

    def at(self, times: ArrayLike) -> Fields:
        """All points at ascending times (T,) in s; at a time where two pieces meet, at the end of the earlier."""
        times, values = np.atleast_1d(np.asarray(times, dtype=float)), []
        for t in times:
            part = next(part for part in self.parts if t <= (part.start + part.drive.duration) * (1 + 1e-14))
            values.append(part.at(min(t - part.start, part.drive.duration)))
        stretch, nominal, u, x, field = (np.stack(column, axis=-1) for column in zip(*values, strict=True))
        return Fields(times, stretch, nominal, u, field, x)

    def eigenvalue(self, times: ArrayLike) -> Floats:
        """Smallest eigenvalue of d2Pi/du2 at times (T,) in s, each branch with the weight exp(-theta/tau) (`relaxation_rate`)."""
        times = np.atleast_1d(np.asarray(times, dtype=float))
        fields = self.at(times)
        result = np.empty(times.size)
        for row, t in enumerate(times):
            log = np.log(fields.stretch[..., row])
            rate = relaxation_rate(self.film, branch_stress(self.film, log, fields.log_viscous[..., row]))
            weight = np.exp(-self.theta(t) * rate)
            matrix = self.assembly.stiffness(log, fields.log_viscous[..., row], fields.field[row], weight)
            result[row] = np.linalg.eigvalsh(matrix.toarray())[0]
        return result

    def signal(self, name: str, times: ArrayLike) -> Floats:
        """What falls through zero at an event, at times (T,) in s: see `events`."""
        if name == "pull-in":
            return self.eigenvalue(times)
        here, active = self.at(times), self.structure.active
        if name == "breakdown":
            stretch = here.stretch[:, np.argmax(active)]
            limit = self.film.breakdown(*stretch) if callable(self.film.breakdown) else self.film.breakdown
            return 1 - here.field * stretch[0] * stretch[1] / limit
        axis = {"loss-of-tension-1": 0, "loss-of-tension-2": 1}[name]
        return here.stress[axis, ~active].min(axis=0)

    def events(self, name: str) -> list[float]:
        """Times in s at which "breakdown" or "pull-in" of the active part, or "loss-of-tension-1" or "-2" of the passive part
        begins: dense roots on the way down.
        """
        found: list[float] = []
        before = np.inf
        for part in self.parts:
            times, before = falls(lambda t, part=part: self.signal(name, part.start + t), part.knots, before)
            found += [part.start + t for t in times]
        return found
