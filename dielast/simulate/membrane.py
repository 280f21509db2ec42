"""The result of a mechanical test on a membrane, and the way from library arguments to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError
from dielast.io.result import TabularResult
from dielast.io.table import Table, case_table
from dielast.material.material import Material
from dielast.material.springs import Floats, SpringLaw
from dielast.mechanics import kinematics
from dielast.mechanics.load import Mode, Step, case_count, numbers, pieces
from dielast.mechanics.point import Points
from dielast.mechanics.span import Control
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleMeter, CycleTable
from dielast.simulate.follow import REASONS, Condition, Outcome, follow
from dielast.simulate.reach import check_reach, symmetry_of
from dielast.simulate.record import Recorder, Wanted, check_cycles, check_end, given_times, kept_cycles


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MembraneHistory(TabularResult):
    """What a membrane did: arrays (cases, times) in s and Pa, `temperature` (cases,) in degC, one `outcome` a case.

    Where an outcome is not completed, everything after its time is NaN. `viscous_stretch` (2, branches, cases, times) is None
    unless it was asked for, `cycles` unless there is a waveform; they are about the nominal stress where the stretch is
    prescribed, and else about the stretch.
    """

    temperature: Floats
    time: Floats
    stretch_1: Floats
    stretch_2: Floats
    nominal_stress_1: Floats
    nominal_stress_2: Floats
    outcome: tuple[Outcome, ...]
    steps: NDArray[np.intp]
    viscous_stretch: Floats | None
    points: Points
    cycles: CycleTable | None = None

    def case(self, row: int) -> dict[str, Floats]:
        """The columns of a case up to where it ended, (rows,), by their headers."""
        columns = {
            "time [s]": self.time,
            "stretch_1 [1]": self.stretch_1,
            "stretch_2 [1]": self.stretch_2,
            "nominal_stress_1 [Pa]": self.nominal_stress_1,
            "nominal_stress_2 [Pa]": self.nominal_stress_2,
            "true_stress_1 [Pa]": self.true_stress_1,
            "true_stress_2 [Pa]": self.true_stress_2,
        }
        reached = np.isfinite(self.stretch_1[row])
        return {header: np.asarray(values[row][reached]) for header, values in columns.items()}

    def columns(self) -> Table:
        """All cases, one below the other, without `relaxation_modulus`, which is that of uniaxial relaxation alone."""
        return case_table(self.temperature.tolist(), [self.case(row) for row in range(self.time.shape[0])])

    @property
    def true_stress_1(self) -> Floats:
        """Mechanical true stress in axis 1, Pa."""
        return self.nominal_stress_1 * self.stretch_1

    @property
    def true_stress_2(self) -> Floats:
        """Mechanical true stress in axis 2, Pa."""
        return self.nominal_stress_2 * self.stretch_2

    @property
    def relaxation_modulus(self) -> Floats:
        """Nominal stress over (stretch - 1) in axis 1, Pa; where the stretch is 1 it is not defined and infinite."""
        strain = self.stretch_1 - 1
        defined = strain != 0
        return np.where(defined, self.nominal_stress_1 / np.where(defined, strain, 1.0), np.where(np.isnan(strain), np.nan, np.inf))

    @property
    def completed(self) -> bool:
        """Whether every case went through to the end."""
        return all(outcome.completed for outcome in self.outcome)

    def stored_energy(self) -> Floats:
        """Energy per undeformed volume in the springs, (cases, times) in J/m^3; needs the viscous stretches."""
        squared, law, modulus, _ = self._springs()
        return np.asarray(np.sum(modulus * kinematics.energy(law, squared), axis=0)).reshape(self.time.shape)

    def dissipation(self) -> Floats:
        """Power per undeformed volume lost in the dashpots, (cases, times) in W/m^3, from Eqs. 7 and 8 of DOI 10.1115/1.4030850.

        Needs the viscous stretches.
        """
        squared, law, modulus, rate = self._springs()
        p, q = kinematics.stress(law, squared)
        return np.asarray(np.sum(modulus * rate * (p * p - p * q + q * q), axis=0)).reshape(self.time.shape)

    def _springs(self) -> tuple[Floats, SpringLaw, Floats, Floats]:
        """Squared elastic stretches (2, n, cases * times), and law, modulus and rate to go with them."""
        if self.viscous_stretch is None:
            raise InputError("energies need the viscous stretches: ask for internal=True")
        viscous = np.concatenate((np.ones_like(self.viscous_stretch[:, :1]), self.viscous_stretch), axis=1)
        squared = np.square(np.stack((self.stretch_1, self.stretch_2))[:, None] / viscous)
        points = self.points.take(np.repeat(np.arange(self.time.shape[0]), self.time.shape[1]))
        return squared.reshape(*squared.shape[:2], -1), points.law, points.modulus, points.rate


def simulate(
    material: Material | Sequence[Material],
    steps: Sequence[Step],
    *,
    mode: Mode | str = Mode.UNIAXIAL,
    temperature: ArrayLike | None = None,
    times: ArrayLike | None = None,
    points_per_decade: int = 30,
    rtol: float = 1e-6,
    internal: bool = False,
    cycles: str | Sequence[int] | None = None,
) -> MembraneHistory:
    """A membrane at rest under `steps`; arguments, result and errors as in `creep`."""
    materials = [material] if isinstance(material, Material) else list(material)
    if not materials or not all(isinstance(each, Material) for each in materials):
        raise InputError("a Material, or a list of them, is needed")
    if isinstance(steps, Step):
        raise InputError("a list of steps is needed")
    if temperature is None:
        temperature = [each.reference_temperature for each in materials]
    temperature = numbers(temperature, "temperature")
    if not np.all(np.isfinite(temperature)):
        raise InputError("every value must be finite", argument="temperature")
    if not 1e-12 <= rtol <= 0.1:
        raise InputError(f"{rtol:g} is not between 1e-12 and 0.1", argument="rtol")
    if not isinstance(points_per_decade, int) or points_per_decade < 1:
        raise InputError(f"{points_per_decade}: a whole number of at least one is needed", argument="points_per_decade")
    cases = case_count(steps, temperature, np.zeros(len(materials)))
    temperature = np.ascontiguousarray(np.broadcast_to(temperature, (cases,)))
    points = Points.of(materials, temperature, rtol)
    course = pieces(steps, mode, cases)
    check_reach(points, course)
    stressed = any(control is Control.STRETCH for piece in course if piece.path is not None for control in piece.controls[:1])
    wanted = Wanted(None if times is None else given_times(times, cases), points_per_decade, kept_cycles(cycles), internal)
    check_cycles(wanted.cycles, course)
    recorder = Recorder(wanted, cases, points.rate.shape[0])
    meter = CycleMeter(points.permittivity, np.ones(cases), stressed)
    condition, status, tries = follow(
        points,
        course,
        Condition.at_rest(points),
        symmetry=symmetry_of(course),
        rtol=rtol,
        recorder=recorder,
        meter=meter,
    )
    outcome = tuple(
        Outcome(state == Status.COMPLETED, float(time), REASONS.get(Status(state), ""))
        for state, time in zip(status.tolist(), condition.time, strict=True)
    )
    check_end(wanted.times, np.where(status == Status.COMPLETED, condition.time, np.inf), "history")
    time, values, inner = recorder.collect()
    stretch = np.exp(0.5 * values[:2])
    viscous = None if inner is None else np.exp(0.5 * inner[:, 1:])
    return MembraneHistory(
        temperature=temperature,
        time=time,
        stretch_1=stretch[0],
        stretch_2=stretch[1],
        nominal_stress_1=values[2],
        nominal_stress_2=values[3],
        outcome=outcome,
        steps=tries,
        viscous_stretch=viscous,
        points=points,
        cycles=meter.collect(),
    )
