"""Simulation of the tests of a calibration, for all tests and all materials at once.

Under a prescribed stretch the branches are independent (`mechanics.stretched`), and with linear flow the stress is linear in the
moduli: a branch that several materials share, such as the materials of a finite difference, is solved once. A specimen that goes
slack is followed once more, with its branches together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Self, TypeVar

import numpy as np

from dielast.base.errors import InputError
from dielast.calibration.experiment import Experiment, MeasuredTest, SimulatedExperiment, answers_of
from dielast.calibration.voltage import Conditions, VoltageTest, simulated_voltages
from dielast.material.law import FlowLaw, Law
from dielast.material.laws_of_cases import LawsOfCases
from dielast.material.material import Material
from dielast.material.springs import EQUIBIAXIAL, UNIAXIAL, SpringLaw, gathered
from dielast.mechanics.flow import Flow, flow_laws
from dielast.mechanics.load import Mode, Step, Track
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.slack import borne
from dielast.mechanics.stretched import Histories, carried
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.simulate.membrane import MembraneHistory, relax
from dielast.simulate.options import Solver
from dielast.simulate.output import Output

RTOL = 1e-5  # of the solver
PRESSED = 1e-6  # pressure over the largest measured stress from which on a specimen is followed as one that may be slack
MOST = 6000  # branches that are solved together, to bound the memory
Kind = TypeVar("Kind", bound=Law)
SYMMETRIES = {Mode.UNIAXIAL: UNIAXIAL, Mode.EQUIBIAXIAL: EQUIBIAXIAL, Mode.PURE_SHEAR: None}


class Laboratory:
    """All tests of a calibration, and their simulation."""

    def __init__(self, tests: Sequence[Experiment], rtol: float = RTOL) -> None:
        self.tests, self.rtol = tuple(tests), rtol
        self.machine = {index: test for index, test in enumerate(self.tests) if isinstance(test, MeasuredTest)}
        self.films = {index: test for index, test in enumerate(self.tests) if isinstance(test, VoltageTest)}
        self.electric = [index for index, test in self.machine.items() if test.nominal_field]
        alone = [index for index in self.machine if index not in self.electric]
        self.groups = {mode: [index for index in alone if self.machine[index].mode is mode] for mode in Mode}
        self.temperatures = np.unique([test.temperature for test in self.machine.values()])

    def answers(self, materials: Sequence[Material | None], conditions: Conditions | None = None) -> list[Floats]:
        """The simulated values in each test: arrays (materials, n), NaN for a material that cannot follow a test.

        `conditions` are those of voltage tests that are not known, for each material.
        """
        values = [np.full((len(materials), test.measured.size), np.nan) for test in self.tests]
        there = [k for k, material in enumerate(materials) if material is not None]
        if self.machine and there:
            springs = Springs.of([material for material in materials if material is not None], self.temperatures)
            for mode, members in self.groups.items():
                if members:
                    self._carried(mode, members, springs, materials, np.array(there), values)
        for index in self.electric:
            values[index] = answers_of(partial(self._under_voltage, index), materials, values[index].shape[1])
        for index, test in enumerate(self.tests):
            if isinstance(test, SimulatedExperiment):
                values[index] = test.answers(materials)
        found = simulated_voltages(list(self.films.values()), materials, conditions or {}, self.rtol)
        for index, voltage in zip(self.films, found, strict=True):
            values[index] = voltage
        return values

    def _under_voltage(self, index: int, materials: Sequence[Material]) -> list[Floats]:
        return completed_stress(under_voltage(self.machine[index], materials, self.rtol))

    def _carried(
        self,
        mode: Mode,
        members: Sequence[int],
        springs: Springs,
        materials: Sequence[Material | None],
        there: Cases,
        values: list[Floats],
    ) -> None:
        """Fill in the tests `members`, all of one mode, for the valid `materials`, those `there`.

        Where the prescribed stretch would press a specimen together that bears nothing, all its branches are solved together.
        """
        tests = [self.machine[index] for index in members]
        corner_time, corner_stretch = (
            _filled([getattr(test, name) for test in tests]) for name in ("corner_time", "corner_stretch")
        )
        # also at the corners, where the stress of a specimen that is unloaded is least
        time, stretch = (
            _filled([np.concatenate(pair) for pair in pairs])
            for pairs in (
                [(test.time, test.corner_time) for test in tests],
                [(test.followed, test.corner_stretch) for test in tests],
            )
        )
        at = np.searchsorted(self.temperatures, [test.temperature for test in tests])
        modulus, fluidity = springs.modulus[:, at], springs.fluidity[:, at]  # (materials, tests, springs)
        law, flow = (np.broadcast_to(number, modulus.shape) for number in (springs.law[:, None], springs.flow[:, None, None]))
        carrying = modulus > 0
        test = np.broadcast_to(np.arange(len(tests))[:, None], modulus.shape)
        activating = np.where(springs.flows.number[flow] < 0, 0.0, modulus)  # linear flow does not depend on the modulus
        place, which = _alike(test[carrying], law[carrying], fluidity[carrying], flow[carrying], activating[carrying])
        own_test, own_law, own_flow = (number[carrying][place] for number in (test, law, flow))
        own_fluidity, own_modulus = (value[carrying][place] for value in (fluidity, activating))
        stress = np.empty((place.size, time.shape[1]))
        for first in range(0, place.size, MOST):
            part = slice(first, first + MOST)
            k = own_test[part]
            stress[part] = carried(
                springs.laws.take(own_law[part]),
                Flow.of(springs.flows.take(own_flow[part]), own_fluidity[None, part], own_modulus[None, part]),
                SYMMETRIES[mode],
                Histories(corner_time[k], corner_stretch[k]),
                time[k],
                stretch[k],
                self.rtol,
            )
        every = np.full(modulus.shape, -1, dtype=np.intp)
        every[carrying] = which
        pressed = np.zeros((there.size, len(members)), dtype=bool)
        for row, index in enumerate(members):
            each, size = tests[row], tests[row].measured.size
            whole = np.zeros((there.size, size + each.corner_time.size))
            for spring in range(modulus.shape[2]):
                some = every[:, row, spring] >= 0
                whole[some] += modulus[some, row, spring, None] * stress[every[some, row, spring], : whole.shape[1]]
            known = springs.known & np.isfinite(whole).all(axis=1)
            values[index][there] = np.where(known[:, None], whole[:, :size], np.nan)
            if each.may_be_slack:
                pressed[:, row] = known & (np.min(whole, axis=1) < -PRESSED * float(np.max(np.abs(each.measured))))
        material, place = np.nonzero(pressed)
        if place.size:
            of_each = [entry for entry in (materials[k] for k in there[material].tolist()) if entry is not None]
            temperature = np.array([tests[k].temperature for k in place.tolist()])
            points = PointMaterial.of(of_each, temperature, self.rtol, with_dielectric=False)
            histories = Histories(corner_time[place], corner_stretch[place])
            free = borne(points, mode, SYMMETRIES[mode], histories, time[place], self.rtol)
            for entry, row, values_of_one in zip(there[material].tolist(), place.tolist(), free, strict=True):
                values[members[row]][entry] = values_of_one[: tests[row].measured.size]


@dataclass(frozen=True, slots=True, eq=False)
class Springs:
    """The springs of materials at temperatures: `modulus` in Pa and `fluidity` 1/(3 tau) in 1/s, both (materials, temperatures,
    springs), the equilibrium spring first; `law` (materials, springs) of the `laws`, which act on arrays (..., 1, laws); `flow`
    (materials,) of the `flows`; and which materials are `known` (materials,) at all temperatures, that is, within the range of
    their shift law.
    """

    modulus: Floats
    fluidity: Floats
    law: Cases
    laws: SpringLaw
    flow: Cases
    flows: LawsOfCases[FlowLaw]
    known: Flags

    @classmethod
    def of(cls, materials: Sequence[Material], temperature: Floats) -> Self:
        """The springs at temperatures (k,) in degC."""
        most = max(len(material.spectrum) for material in materials)
        modulus, fluidity = np.zeros((2, len(materials), temperature.size, most + 1))
        known = np.ones(len(materials), dtype=bool)
        pairs, laws = _distinct([law for material in materials for law in (material.equilibrium_law, material.nonequilibrium_law)])
        law = pairs.reshape(-1, 2)[:, np.minimum(np.arange(most + 1), 1)]
        flow, flows = _distinct([material.flow for material in materials])
        for row, material in enumerate(materials):
            count, place = len(material.spectrum), material.reference_temperature
            try:
                fluidity[row, :, 1 : count + 1] = 1 / (3 * material.relaxation_time(temperature))
                modulus[row, :, 0] = material.equilibrium_modulus * material.equilibrium_scaling.factor(temperature, place)
                factor = material.nonequilibrium_scaling.factor(temperature, place)
            except InputError:  # outside a table
                known[row] = False
                continue
            modulus[row, :, 1 : count + 1] = np.multiply.outer(
                np.broadcast_to(factor, temperature.shape), material.spectrum.shear_modulus
            )
        joined = gathered([(law, law) for law in laws], np.ones((1, len(laws)), dtype=bool))
        return cls(modulus, fluidity, law, joined if len(laws) > 1 else laws[0], flow, flow_laws(flows, len(flows)), known)


def under_voltage(test: MeasuredTest, materials: Sequence[Material], rtol: float = RTOL) -> MembraneHistory:
    """The simulation of a test under voltage, which couples the branches: a case for each material."""
    return relax(
        materials,
        [Step(stretch=Track(test.corner_time, test.corner_stretch))],
        mode=test.mode,
        temperature=test.temperature,
        nominal_field=test.nominal_field,
        slack=test.slack,
        output=Output(times=test.time),
        solver=Solver(rtol=rtol),
    )


def completed_stress(history: MembraneHistory) -> list[Floats]:
    """The stress (n,) of each material in a test under voltage; NaN where the numerics gave up."""
    rows = zip(history.nominal_stress_1, history.outcome, strict=True)
    return [stress.copy() if outcome.completed else np.full_like(stress, np.nan) for stress, outcome in rows]


def _filled(columns: Sequence[Floats]) -> Floats:
    """Columns as rows of an array (columns, k); shorter ones are padded with their last value."""
    size = max(column.size for column in columns)
    return np.array([np.append(column, np.full(size - column.size, column[-1])) for column in columns])


def _distinct(laws: Sequence[Kind]) -> tuple[Cases, list[Kind]]:
    """The index (k,) of each law among those that differ in class or constants, and these."""
    keys = [(type(law), *law.values().values()) for law in laws]
    distinct: dict[tuple[object, ...], Kind] = {}
    for key, law in zip(keys, laws, strict=True):
        distinct.setdefault(key, law)
    number = {key: index for index, key in enumerate(distinct)}
    return np.array([number[key] for key in keys], dtype=np.intp), list(distinct.values())


def _alike(*columns: Cases | Floats) -> tuple[Cases, Cases]:
    """First indices (u,) of the distinct tuples of numbers (k,), and the index (k,) of each tuple among them."""
    order = np.lexsort(columns[::-1])
    ordered = [values[order] for values in columns]
    new = np.append(True, np.any([values[1:] != values[:-1] for values in ordered], axis=0))[: order.size]  # none of none
    which = np.empty(order.size, dtype=np.intp)
    which[order] = np.cumsum(new) - 1
    return order[new], which
