"""Tests as a calibration sees them: what was measured, and what materials answer to the same history.

Histories that are a few straight lines long are followed together, all tests and all materials in one batch of the solver.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np

from dielast.calibration.history import corners, path_length
from dielast.errors import DielastError, InputError
from dielast.io.result import Result
from dielast.material.material import Material
from dielast.mechanics.load import Mode, Step, Track
from dielast.numerics.columns import Floats
from dielast.simulate.membrane import relax

TOGETHER = 16  # corners up to which histories are followed together, the shorter ones filled up
RTOL = 1e-5  # of the solver: a tenth of what the derivatives need
MOST = 6000  # cases that are solved together: what bounds the memory


class Experiment(Protocol):
    """A test as the fit needs it."""

    @property
    def name(self) -> str:
        """What the test is called."""

    @property
    def specimen(self) -> str:
        """Which specimen it was made on: tests of one specimen share the factor by which its stress differs."""

    @property
    def measured(self) -> Floats:
        """What was measured (n,), in SI."""

    @property
    def place(self) -> Floats:
        """Where along the curve each point lies (n,), as `path_length` has it."""

    @property
    def time(self) -> Floats:
        """When (n,), in s."""

    @property
    def stretch(self) -> Floats | None:
        """The stretch (n,), where it was prescribed."""

    @property
    def temperature(self) -> float:
        """In degC."""

    @property
    def unit(self) -> str:
        """The unit of what was measured."""

    @property
    def rest(self) -> float:
        """What was measured of a specimen at rest, which `measured` is counted from."""

    def answers(self, materials: Sequence[Material | None]) -> Floats:
        """What each material gives (materials, n), NaN where it cannot follow the test."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MeasuredTest(Result):
    """A test in which the stretch was prescribed: `time` in s, `stretch` and nominal `stress` in Pa, all (n,), times ascending.

    Time counts from the undeformed state at rest; a stretch other than 1 at time 0 was reached at once. `temperature` in degC.
    Tests of one `specimen` share the factor by which its stress differs from the material's. Raises `InputError` for columns of
    unequal length, for fewer than 3 points, for what is not finite and for times that do not ascend.
    """

    name: str
    time: Floats
    stretch: Floats
    stress: Floats
    temperature: float
    mode: Mode | str = Mode.UNIAXIAL
    specimen: str = ""
    corner_time: Floats = field(init=False)
    corner_stretch: Floats = field(init=False)
    unit: ClassVar = "Pa"
    rest: ClassVar = 0.0

    def __post_init__(self) -> None:
        time, stretch, stress = (np.asarray(getattr(self, name), dtype=float) for name in ("time", "stretch", "stress"))
        if not time.ndim == 1 or not time.shape == stretch.shape == stress.shape:
            raise InputError("time, stretch and stress need one value for each point", argument=self.name)
        if time.size < 3:
            raise InputError(f"{time.size} points: at least 3 are needed", argument=self.name)
        if not np.all(np.isfinite(time) & np.isfinite(stretch) & np.isfinite(stress)):
            raise InputError("every value must be finite", argument=self.name)
        if np.any(time < 0) or np.any(np.diff(time) <= 0):
            raise InputError("times must ascend from 0 s", argument=self.name)
        if np.any(stretch <= 0):
            raise InputError(f"a stretch of {stretch.min():g}: a number above 0 is needed (1 is undeformed)", argument=self.name)
        if time[0] == 0 and stretch[0] != 1:  # what is measured at once is not what holds a moment later
            kept = corners(time, stretch)
            corner_time, corner_stretch = time[kept], stretch[kept]
            time, stretch, stress = time[1:], stretch[1:], stress[1:]
        else:
            from_rest = np.concatenate(([0.0], time)), np.concatenate(([1.0], stretch))
            history = from_rest if time[0] > 0 else (time, stretch)
            kept = corners(*history)
            corner_time, corner_stretch = (each[kept] for each in history)
        values = {
            "time": time,
            "stretch": stretch,
            "stress": stress,
            "mode": Mode(self.mode),
            "specimen": self.specimen or self.name,
        }
        for name, value in {**values, "corner_time": corner_time, "corner_stretch": corner_stretch}.items():
            object.__setattr__(self, name, value)

    @property
    def measured(self) -> Floats:
        """The nominal stress in Pa (n,)."""
        return self.stress

    @property
    def place(self) -> Floats:
        """Where along the curve each point lies (n,)."""
        return path_length(self.time, self.stretch)

    def answers(self, materials: Sequence[Material | None]) -> Floats:
        """What each material gives (materials, n) in Pa, NaN where it cannot follow the test."""
        return Laboratory([self]).answers(materials)[0]

    @property
    def at_once(self) -> bool:
        """Whether the stretch is there at once."""
        return bool(self.corner_stretch[0] != 1)

    @property
    def largest_invariant(self) -> float:
        """The largest I1 on the way."""
        squared = np.square(self.corner_stretch)
        second = {Mode.UNIAXIAL: 1 / np.sqrt(squared), Mode.EQUIBIAXIAL: squared, Mode.PURE_SHEAR: np.ones_like(squared)}
        other = second[Mode(self.mode)]
        return float(np.max(squared + other + 1 / (squared * other)))


class Laboratory:
    """All tests of a calibration, and what materials answer in them."""

    def __init__(self, tests: Sequence[Experiment], rtol: float = RTOL) -> None:
        self.tests, self.rtol = tuple(tests), rtol
        self.machine = {index: test for index, test in enumerate(self.tests) if isinstance(test, MeasuredTest)}
        groups: dict[tuple[object, ...], list[int]] = {}
        for index, test in self.machine.items():
            size = test.corner_time.size
            alone = (index,) if size > TOGETHER else ()
            groups.setdefault((test.mode, test.at_once, size > 4, *alone), []).append(index)
        self.groups = list(groups.values())

    def answers(self, materials: Sequence[Material | None]) -> list[Floats]:
        """What each material gives in each test: arrays (materials, n), NaN for a material that cannot follow a test."""
        found = [np.full((len(materials), test.measured.size), np.nan) for test in self.tests]
        there = [k for k, material in enumerate(materials) if material is not None]
        for members in self.groups:
            part = max(1, MOST // len(members))
            for first in range(0, len(there), part):
                self._solve(members, there[first : first + part], materials, found)
        for index, other in enumerate(self.tests):
            if index not in self.machine:
                found[index] = other.answers(materials)
        return found

    def _solve(self, members: list[int], chosen: list[int], materials: Sequence[Material | None], found: list[Floats]) -> None:
        """Follow the tests `members` with the `chosen` materials, as far as they reach."""
        pairs = [
            (member, index, material)
            for index in chosen
            if (material := materials[index]) is not None
            for member in members
            if _reaches(material, self.machine[member])
        ]
        if not pairs:
            return
        tests = [self.machine[member] for member, _, _ in pairs]
        width = max(test.measured.size for test in tests)
        times = np.array([np.append(test.time, np.full(width - test.time.size, test.time[-1])) for test in tests])
        try:
            history = relax(
                [material for _, _, material in pairs],
                _steps(tests),
                mode=Mode(tests[0].mode),
                temperature=[test.temperature for test in tests],
                times=times,
                rtol=self.rtol,
            )
        except DielastError:  # of one of them: it is to be known of which
            if len(pairs) > 1:
                for member, index, _ in pairs:
                    self._solve([member], [index], materials, found)
            return
        for row, (member, index, _) in enumerate(pairs):
            if history.outcome[row].completed:
                found[member][index] = history.nominal_stress_1[row, : self.tests[member].measured.size]


def _reaches(material: Material, test: MeasuredTest) -> bool:
    """Whether the springs hold as far as the test goes."""
    squared = np.square(np.array([test.corner_stretch.min(), test.corner_stretch.max()]))
    power = {Mode.UNIAXIAL: -0.5, Mode.EQUIBIAXIAL: 1.0, Mode.PURE_SHEAR: 0.0}[Mode(test.mode)]
    springs = [material.equilibrium_law, *([material.nonequilibrium_law] if test.at_once else [])]
    return all(bool(np.all(law.room(np.stack((squared, squared**power))) > 1e-6)) for law in springs)


def _steps(tests: Sequence[MeasuredTest]) -> list[Step]:
    """The histories of tests, filled up to one length, as steps; one that is long is a track."""
    first = tests[0]
    size = max(test.corner_time.size for test in tests)
    if size > TOGETHER:  # all are the same test
        return [Step(stretch=Track(first.corner_time, first.corner_stretch))]
    time, stretch = (
        np.array([np.append(values, np.full(size - values.size, values[-1])) for values in column])
        for column in ([test.corner_time for test in tests], [test.corner_stretch for test in tests])
    )
    lasting = np.diff(time, axis=1)
    opening = [Step(stretch=stretch[:, 0])] if first.at_once else []
    return [*opening, *(Step(stretch=stretch[:, k + 1], duration=lasting[:, k]) for k in range(size - 1))]
