"""The result of a mechanical test on a membrane, and the way from library arguments to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast import kinematics
from dielast.errors import InputError
from dielast.gent import Floats, SpringLaw
from dielast.load import Mode, Step, case_count, numbers, pieces
from dielast.material import Material
from dielast.point import Points
from dielast.simulate.history import Outcome, run
from dielast.simulate.output import given_times


@dataclass(frozen=True, slots=True, eq=False)
class MembraneHistory:
    """What a membrane did: arrays (cases, times) in s and Pa, `temperature` (cases,) in degC, one `outcome` a case.

    Where an outcome is not completed, everything after its time is NaN. `viscous_stretch` (2, branches, cases, times) is None
    unless it was asked for.
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
        raise InputError("every temperature must be finite")
    if not 1e-12 <= rtol <= 0.1:
        raise InputError(f"rtol {rtol:g} is not between 1e-12 and 0.1")
    if not isinstance(points_per_decade, int) or points_per_decade < 1:
        raise InputError(f"{points_per_decade} points per decade: a whole number of at least one is needed")
    cases = case_count(steps, temperature, np.zeros(len(materials)))
    temperature = np.ascontiguousarray(np.broadcast_to(temperature, (cases,)))
    points = Points.of(materials, temperature, rtol)
    record = run(
        points,
        pieces(steps, mode, cases),
        times=None if times is None else given_times(times, cases),
        points_per_decade=points_per_decade,
        rtol=rtol,
        internal=internal,
    )
    stretch = np.exp(0.5 * record.log_squared_stretch)
    viscous = None if record.internal is None else np.exp(0.5 * record.internal[:, 1:])
    return MembraneHistory(
        temperature=temperature,
        time=record.time,
        stretch_1=stretch[0],
        stretch_2=stretch[1],
        nominal_stress_1=record.nominal_stress[0],
        nominal_stress_2=record.nominal_stress[1],
        outcome=record.outcome,
        steps=record.steps,
        viscous_stretch=viscous,
        points=points,
    )
