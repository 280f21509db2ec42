"""Mechanical tests on specimens: relaxation at prescribed stretch, and creep at prescribed nominal stress."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, nearest, shown
from dielast.material.material import Material, materials_of
from dielast.material.springs import EQUIBIAXIAL, UNIAXIAL, Symmetry
from dielast.mechanics.cases import numbers, spread, temperatures_of
from dielast.mechanics.film import FilmState
from dielast.mechanics.history import case_count, duration_of, pieces
from dielast.mechanics.line import Line
from dielast.mechanics.load import Mode, Step
from dielast.mechanics.piece import Piece, loads_axis_1_alone
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.slack import Contact
from dielast.mechanics.span import Control
from dielast.numerics.arrays import Cases, Floats
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleMeter, CycleTable
from dielast.simulate.film_setup import check_reach
from dielast.simulate.follow import follow
from dielast.simulate.history import Arguments, History, Outcome, simulating
from dielast.simulate.options import Solver, check_tolerance
from dielast.simulate.output import Output, check_end
from dielast.simulate.quantities import TESTS, SolvedTests, values_of
from dielast.simulate.recorder import Recorder

BEARS_NOTHING, PUSHES = "bears nothing", "pushes"


@dataclass(frozen=True, slots=True)
class SlackEvent:
    """A specimen goes slack, or taut again, at `time` in s; `stretch` is the prescribed one, and its own."""

    event: str
    time: float
    stretch: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MembraneHistory(History):
    """The history of membranes: `values` (cases, times) in SI by header, as attributes too, `temperature` (cases,) in degC, and an
    `outcome` for each case.

    Nominal and true stresses are mechanical; `relaxation_modulus`, of uniaxial relaxation, is nominal stress over (stretch - 1),
    NaN at stretch 1. If the outcome of a case is not COMPLETED, its values after the time of the outcome are NaN.
    `viscous_stretch` (2, branches, cases, times) is None without `internal`, `cycles` is None without a waveform; cycles are those
    of the nominal stress if the stretch is prescribed, else of the stretch. `slack_events` are those of each case, in the order of
    time.
    """

    QUANTITIES: ClassVar = TESTS

    temperature: Floats
    values: Mapping[str, Floats]
    outcome: tuple[Outcome, ...]
    steps: Cases
    viscous_stretch: Floats | None
    points: PointMaterial
    cycles: CycleTable | None = None
    slack_events: tuple[tuple[SlackEvent, ...], ...] = ()

    def stored_energy(self) -> Floats:
        """Energy per undeformed volume in the springs, (cases, times) in J/m^3.

        Raises `InputError` without the viscous stretches.
        """
        points, squared = self._springs()
        return np.asarray(np.sum(points.modulus * points.law.energy(squared), axis=0)).reshape(self.time.shape)

    def dissipation(self) -> Floats:
        """Power per undeformed volume lost in the dashpots, (cases, times) in W/m^3: stress times rate of flow, d ln xi/dt.

        Raises `InputError` without the viscous stretches.
        """
        points, squared = self._springs()
        stress = points.law.stress(squared)
        power = 0.5 * np.einsum("nm,cnm,cnm->m", points.modulus, stress, points.flow.rate(stress))
        return np.asarray(power).reshape(self.time.shape)

    def _springs(self) -> tuple[PointMaterial, Floats]:
        """The points (cases * times), and their squared elastic stretches (2, n, cases * times)."""
        if self.viscous_stretch is None:
            raise InputError("energies need the viscous stretches: ask for internal=True")
        viscous = np.concatenate((np.ones_like(self.viscous_stretch[:, :1]), self.viscous_stretch), axis=1)
        squared = np.square(np.stack((self.stretch_1, self.stretch_2))[:, None] / viscous)
        points = self.points.take(np.repeat(np.arange(self.time.shape[0]), self.time.shape[1]))
        return points, squared.reshape(*squared.shape[:2], -1)


# the docstring is that of `relax` and `creep`, which simulate what this function has prepared
def prepare(
    material: Material | Sequence[Material],
    steps: Sequence[Step],
    *,
    mode: Mode | str = Mode.UNIAXIAL,
    temperature: ArrayLike | None = None,
    nominal_field: ArrayLike | None = None,
    slack: str | None = None,
    output: Output = Output(),
    solver: Solver = Solver(),
) -> Callable[[], MembraneHistory]:
    """Simulate specimens, initially undeformed and relaxed, under `steps` of stretch (`relax`), nominal stress (`creep`), or both.

    The number of cases is the largest length of the arrays in the steps, of `temperature` (degC; by default the reference
    temperature of the material), and of the list of materials; other lengths must be 1. All cases of one call have the same kinds
    of steps: cases with a jump in a step in which others have a waveform, for instance, need separate calls.

    Output without stated times is evenly spaced in ramps. At the time of a load applied at once, stated times show the state
    before it. In uniaxial mode the result has a `relaxation_modulus`, nominal stress over (stretch - 1), in Pa.

    A specimen whose `slack` "bears nothing" has no nominal stress where a prescribed stretch would press it together: it recovers
    freely until it is as long as that again. Its stretch is then its length, and `slack_events` are the times when it goes slack
    and taut. One that "pushes" is held at the prescribed stretch at any stress. Default: "bears nothing" in uniaxial and pure-shear
    mode without a field; other specimens push, and so do those with a step that states both axes.

    A `nominal_field` in V/m, the voltage over the undeformed thickness, acts from the start between electrodes on both faces; the
    nominal stress is then that which the machine holds.

    The equations are those of Sec. 3 of DOI 10.1115/1.4030850. Raises `InputError` for invalid arguments; a case in which the
    numerics give up is an `Outcome`, not an error.
    """
    others = [name for name in ("with_end", "electrical", "profile") if getattr(output, name) is not None]
    if others:
        raise InputError("only a film under voltage has it", argument=others[0])
    rtol = solver.rtol
    materials = materials_of(material)
    if not materials:
        raise InputError("a Material, or a list of them, is needed")
    if temperature is None:
        temperature = [material.reference_temperature for material in materials]
    temperature = numbers(temperature, "temperature")
    check_tolerance(rtol)
    field = np.zeros(1) if nominal_field is None else numbers(nominal_field, "nominal_field")
    cases = case_count(steps, temperature, np.zeros(len(materials)), field)
    temperature = temperatures_of(temperature, cases)
    electric = bool(np.any(field))
    both_axes = any(isinstance(value, tuple) for step in steps for value in (step.stretch, step.stress))
    slack = bearing(slack, Mode.of(mode), electric, both_axes)
    for entry in materials if electric else ():
        if not entry.permittivity:
            raise InputError(f"{entry.name!r} has no permittivity, which a specimen under voltage needs", argument="material")
    points = PointMaterial.of(materials, temperature, rtol, with_dielectric=electric)
    stated = output.of_cases(cases, steps)
    history = pieces(steps, mode, cases)
    if electric:
        # the field is applied at once, before the first piece
        switched_on = None, None, spread(field, "nominal_field", cases)
        history.insert(0, Line.to(history[0].controls, switched_on, np.zeros(cases)))
    check_reach(points, history)
    check_end(stated.rows, duration_of(history, cases), "history")
    stress_is_measured = any(piece.cycles and piece.controls[0] is Control.STRETCH for piece in history)

    relaxes = Mode(mode) is Mode.UNIAXIAL and any(piece.controls[0] is Control.STRETCH for piece in history)

    def simulated() -> MembraneHistory:
        recorder, meter = Recorder(stated), CycleMeter(points, np.ones(cases), stress_is_measured)
        contact = Contact(np.zeros(cases, dtype=bool), rtol) if slack == BEARS_NOTHING else None
        film = FilmState.at_rest(points, symmetry_of(history))
        followed = follow(film, history, rtol=rtol, recorders=[recorder], meter=meter, contact=contact)
        # the duration of a step to a stress at a rate that begins at a stretch, or the reverse, is known only now
        check_end(stated.rows, np.where(followed.status == Status.COMPLETED, followed.time, np.inf), "history")
        record = followed.recorders[0].collect()
        return MembraneHistory(
            temperature=temperature,
            values=values_of(TESTS, SolvedTests(record, relaxes)),
            outcome=tuple(map(Outcome.of, followed.status.tolist(), followed.time.tolist())),
            steps=followed.steps,
            viscous_stretch=None if record.internal is None else np.exp(0.5 * record.internal[:, 1:]),
            points=points,
            cycles=(followed.meter or meter).collect(),
            slack_events=_by_case(() if followed.contact is None else followed.contact.events, cases),
        )

    return simulated


def _by_case(events: Iterable[tuple[int, float, float, bool]], cases: int) -> tuple[tuple[SlackEvent, ...], ...]:
    """The events of a contact in each case."""
    by_case: list[list[SlackEvent]] = [[] for _ in range(cases)]
    for case, time, stretch, slack in sorted(events):
        by_case[case].append(SlackEvent("slack" if slack else "taut", time, stretch))
    return tuple(map(tuple, by_case))


def bearing(slack: str | None, mode: Mode, electric: bool, both_axes: bool = False) -> str:
    """What a specimen does that would be pressed together, by default as stated in `relax`: an `electric` one is under voltage, one
    with `both_axes` has steps that state them; `InputError` for anything else.
    """
    biaxial = both_axes or mode is Mode.EQUIBIAXIAL
    known = (PUSHES,) if biaxial else (BEARS_NOTHING, PUSHES)
    if slack is not None and slack not in known:
        where = "where a step states both axes" if both_axes else f"in {mode.value} mode"
        raise InputError(f"{shown(slack)}: {where} {nearest(slack, known)}", argument="slack")
    return slack or (PUSHES if electric else known[0])


def symmetry_of(pieces: Sequence[Piece]) -> Symmetry | None:
    """The symmetry that a specimen at rest keeps throughout a history, None without one."""
    if all(loads_axis_1_alone(piece).all() for piece in pieces):
        return UNIAXIAL
    values = [target for piece in pieces for target in piece.targets]
    alike = all(piece.controls[0] is piece.controls[1] for piece in pieces)
    return EQUIBIAXIAL if alike and all(np.array_equal(rows[0], rows[1], equal_nan=True) for rows in values) else None


def _prescribing(
    prepare: Callable[Arguments, Callable[[], MembraneHistory]], name: str, control: Control, other: str
) -> Callable[Arguments, MembraneHistory]:
    """The public function `name` for histories with at least one step of this control.

    `InputError` for histories that prescribe only the other control, which need the function named `other`.
    """
    other_control = next(another.value for another in Control if another is not control)

    @wraps(prepare)
    def of_control(*arguments: Arguments.args, **keywords: Arguments.kwargs) -> Callable[[], MembraneHistory]:
        stated: Any = keywords["steps"] if "steps" in keywords else arguments[1] if len(arguments) > 1 else ()
        steps = [step for step in stated if isinstance(step, Step)] if isinstance(stated, Sequence) else []
        others = [index for index, step in enumerate(steps) if getattr(step, other_control) is not None]
        if others and all(getattr(step, control.value) is None for step in steps):
            needed = f"{name} is about a {control.value} that is prescribed: state that, or use {other}"
            raise InputError(needed, step=others[0], argument=other_control)
        return prepare(*arguments, **keywords)

    return simulating(of_control, name, MembraneHistory)


relax = _prescribing(prepare, "relax", Control.STRETCH, "creep")
creep = _prescribing(prepare, "creep", Control.STRESS, "relax")
