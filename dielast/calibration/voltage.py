"""Voltage tests: the stretch of an actuated film at voltages, without times, compared in voltage at the measured stretch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, listed
from dielast.calibration.films import Ramps, voltages
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.material.material import Material
from dielast.mechanics.span import Control
from dielast.numerics.arrays import Cases, Floats
from dielast.simulate.film_setup import ByAxis, Film, positive

QUANTITIES = ("stretch", "relative_stretch", "area_strain")
UNITS = {"ramp": "V/s", "relax": "s", "electrode_share": "1"}
Conditions = Mapping[tuple[str, str], Floats]
"""Values (materials,) of unknown conditions of tests, by name of the test and condition."""


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class VoltageTest(Result):
    """A film under a voltage that rises at the rate `ramp` in V/s: its `stretch` (n,) at each `voltage` (n,) in V; no times.

    `measure` says what the stretch is: the whole "stretch" along axis 1, the "relative_stretch" over that before the voltage, or
    the "area_strain", which is relative as well. The `film` is a single one. The `ramp`, and the conditions `relax` in s and
    `electrode_share` in place of those of the film, may be pairs: unknown between these, with a uniform prior in the logarithm.

    The misfit is in voltage at the measured stretch: a film near runaway has a well-conditioned voltage, but no such stretch. The
    factor of a specimen is on its stress, so that its voltages have the root of it.

    Raises `InputError` for columns of unequal length, fewer than 3 points above 0 V, values that are not finite, a stretch that is
    not above 0, and films and conditions that are not possible.
    """

    name: str
    voltage: Floats
    stretch: Floats
    film: Film
    ramp: ArrayLike
    temperature: float
    relax: ArrayLike | None = None
    electrode_share: ArrayLike | None = None
    measure: str = "stretch"
    specimen: str = ""
    header: ClassVar = "voltage [V]"
    unit: ClassVar = "V"
    rest: ClassVar = 0.0
    power: ClassVar = 0.5
    unused: ClassVar = np.zeros((3, 0))

    def __post_init__(self) -> None:
        voltage, stretch = np.asarray(self.voltage, dtype=float), np.asarray(self.stretch, dtype=float)
        if voltage.ndim != 1 or voltage.shape != stretch.shape:
            raise InputError("voltage and stretch need one value for each point", argument=self.name)
        if not np.all(np.isfinite(voltage) & np.isfinite(stretch)):
            raise InputError("every value must be finite", argument=self.name)
        if self.measure not in QUANTITIES:
            raise InputError(f"{self.measure!r}: {listed(QUANTITIES)} is needed", argument="measure")
        least = -1.0 if self.measure == "area_strain" else 0.0
        if np.any(stretch <= least):
            raise InputError(f"{self.measure} {stretch.min():g}: a number above {least:g} is needed", argument=self.name)
        order = np.argsort(np.abs(voltage), kind="stable")
        order = order[np.abs(voltage[order]) > 0]  # at 0 V any film is at rest
        if order.size < 3:
            raise InputError(f"at least 3 points above 0 V are needed, not {order.size}", argument=self.name)
        film = self.film
        for key in ("relax", "electrode_share"):
            if getattr(self, key) is not None:
                ends = self._range(key)
                middle: Any = {key: float(np.sqrt(ends[0] * ends[1]))}
                film = replace(film, **middle)
        self._range("ramp")
        given = {"voltage": np.abs(voltage[order]), "stretch": stretch[order], "film": film, "specimen": self.specimen or self.name}
        for name, value in given.items():
            object.__setattr__(self, name, value)
        _, reached = self._prestretch()
        thickness = positive(film.thickness, "thickness", "m", 1)
        film.share(reached, 1)
        film.weight_stress(thickness, reached)
        first, second = film.controls
        if first is Control.STRETCH and second is Control.STRETCH:
            raise InputError("both axes are clamped: a voltage does not move such a film", argument=self.name)
        if self.measure != "area_strain" and first is Control.STRETCH:
            raise InputError("axis 1 is clamped: state columns.area_strain instead of a stretch", argument=self.name)
        # a tension along both axes, or along axis 1 of a film of constant width, extends any stable film along axis 1
        extends = self.measure == "area_strain" or second is Control.STRETCH or self._alike
        if extends and not self.total and np.max(self.wanted) <= 0:
            rest = {"stretch": "prestretch", "relative_stretch": "stretch 1", "area_strain": "area strain 0"}[self.measure]
            counts = "; one that counts from the prestretch is columns.relative_stretch" if self.measure == "stretch" else ""
            text = f"no {self.measure} above 0 V is beyond the {rest} at which the film rests before the voltage{counts}"
            raise InputError(text, argument=self.name)

    @property
    def _alike(self) -> bool:
        """Whether the film is stretched and held alike along both axes."""
        first, second = (1.0 if axis is None else float(axis[0]) for axis in self._prestretch()[1])
        return first == second and self.film.controls[0] is self.film.controls[1]

    def _range(self, key: str) -> tuple[float, float]:
        """The least and the largest value of a condition; `InputError` unless both are positive and ascend."""
        ends = np.atleast_1d(np.asarray(getattr(self, key), dtype=float))
        if ends.ndim != 1 or ends.size not in (1, 2) or not np.all(np.isfinite(ends)) or ends[0] <= 0 or ends[0] > ends[-1]:
            needed = "a number above 0, or two that ascend: the least and the largest, is needed"
            raise InputError(f"{getattr(self, key)}: {needed}", argument=key)
        return float(ends[0]), float(ends[-1])

    def _prestretch(self) -> tuple[Floats, ByAxis]:
        """The duration (1,) of the prestretch, and the prestretch of both axes."""
        reached = self.film.prestretches(1)
        return self.film.ramp(reached, 1), reached

    @property
    def unknown(self) -> dict[str, tuple[float, float]]:
        """The conditions that are not known, with their least and largest values."""
        stated = {key: self._range(key) for key in UNITS if getattr(self, key) is not None}
        return {key: ends for key, ends in stated.items() if ends[0] < ends[1]}

    @property
    def measured(self) -> Floats:
        """The voltage in V (n,), ascending."""
        return self.voltage

    @property
    def nominal_field(self) -> float:
        """The largest voltage over the undeformed thickness in V/m."""
        return float(self.voltage[-1] / np.asarray(self.film.thickness))

    @property
    def time(self) -> Floats:
        """The time (n,) in s of each voltage since the ramp began, at its rate or the middle of its range."""
        low, high = self._range("ramp")
        return np.asarray(self.voltage / np.sqrt(low * high))

    @property
    def place(self) -> Floats:
        """The place (n,) of each point along the curve, which has the length 1."""
        span = float(np.ptp(self.voltage))
        return np.asarray((self.voltage - self.voltage[0]) / (span if span > 0 else 1.0))

    @property
    def wide(self) -> Floats:
        """The error (n,) of each point over that of a voltage, where stretches are wrong by the same share of their range.

        At small voltages V the stretch goes with the square of V: an error by a share of the range is one by V_max/(2V) of that
        share in voltage.
        """
        return np.asarray(np.sqrt(1 + np.square(self.voltage[-1] / (2 * self.voltage))))

    @property
    def wanted(self) -> Floats:
        """ln (n,) of the stretch along axis 1 over that at rest, or of the ratio of areas; of the whole stretch if `total`."""
        rest = 1.0
        first, _ = self._prestretch()[1]
        if self.measure == "stretch" and first is not None:
            rest = float(first[0])
        return np.log(self.stretch + 1 if self.measure == "area_strain" else self.stretch / rest)

    @property
    def total(self) -> bool:
        """Whether the stretch is that of an axis whose stretch at rest depends on the material."""
        return self.measure == "stretch" and self._prestretch()[1][0] is None

    def reach(self, material: Material) -> tuple[str, float]:
        """The mode of loading, and the largest I1 until the last point, if an axis that is free is under uniaxial stress."""
        first, second = (1.0 if axis is None else float(axis[0]) for axis in self._prestretch()[1])
        largest = float(np.exp(np.max(self.wanted)))
        if self.measure == "area_strain":
            largest = float(np.sqrt(largest)) if self.film.controls[0] is self.film.controls[1] else largest
        alike = self._alike
        one, other = first * largest, second * largest if alike else second
        return "equibiaxial" if alike else "biaxial", one**2 + other**2 + (one * other) ** -2.0


def simulated_voltages(
    tests: Sequence[VoltageTest], materials: Sequence[Material | None], conditions: Conditions, rtol: float
) -> list[Floats]:
    """The voltage (materials, n) at each measured stretch of each test, NaN for materials that cannot follow it.

    Films of one form are simulated together: those of all tests with this form, of all materials.
    """
    found = [np.full((len(materials), test.voltage.size), np.nan) for test in tests]
    forms: dict[object, list[int]] = {}
    for index, test in enumerate(tests):
        free, weight_stress = ([axis is None for axis in axes] for axes in (test._prestretch()[1], test.film.forces))
        forms.setdefault((str(test.film.boundary), tuple(free), tuple(weight_stress)), []).append(index)
    for members in forms.values():
        chosen = [
            (index, row)
            for index in members
            for row, material in enumerate(materials)
            if material is not None and _can_follow(tests[index], material)
        ]
        if not chosen:
            continue
        of_test, row = np.array(chosen, dtype=np.intp).T
        answers = voltages([cast(Material, materials[k]) for k in row.tolist()], _ramps(tests, of_test, row, conditions), rtol)
        for k in members:
            found[k][row[of_test == k]] = answers[of_test == k, : tests[k].voltage.size]
    return found


def _can_follow(test: VoltageTest, material: Material) -> bool:
    """Whether a material has a permittivity, and its shift law holds at the temperature of a test."""
    try:
        material.relaxation_time(test.temperature)
    except InputError:
        return False
    return bool(material.permittivity)


def _ramps(tests: Sequence[VoltageTest], index: Cases, row: Cases, conditions: Conditions) -> Ramps:
    """The films of tests of one form: `index` (cases,) is that of the test, `row` (cases,) that of the material."""

    def of(values: Sequence[float]) -> Floats:
        return np.array(values, dtype=float)[index]

    def condition(key: str, stated: Sequence[float]) -> Floats:
        values = of(stated)
        for k, test in enumerate(tests):
            if (known := conditions.get((test.name, key))) is not None:
                here = index == k
                values[here] = known[row[here]]
        return values

    films = [test.film for test in tests]
    first = films[int(index[0])]
    prestretches = [test._prestretch() for test in tests]
    size = max(test.voltage.size for test in tests)
    wanted = np.full((len(tests), size), np.inf)
    for k, test in enumerate(tests):
        wanted[k, : test.voltage.size] = test.wanted
    thickness = [float(np.asarray(film.thickness)) for film in films]
    weight_stress = [
        film.weight_stress(np.array([thick]), known[1]) for film, thick, known in zip(films, thickness, prestretches, strict=True)
    ]

    shares = [np.nan if film.electrode_share is None else float(np.asarray(film.electrode_share)) for film in films]

    def axes(values: Sequence[ByAxis]) -> ByAxis:
        """The values of both axes: an axis without one in the first film has none in all of them."""
        one, two = (
            None if axis[int(index[0])] is None else of([np.nan if value is None else float(value[0]) for value in axis])
            for axis in zip(*values, strict=True)
        )
        return one, two

    return Ramps(
        first.controls,
        of(thickness),
        axes([known for _, known in prestretches]),
        of([float(lasts[0]) for lasts, _ in prestretches]),
        condition("relax", [float(np.asarray(film.relax)) for film in films]),
        axes(weight_stress),
        None if first.surrounded is None else condition("electrode_share", shares),
        of([test.temperature for test in tests]),
        condition("ramp", [float(np.sqrt(np.prod(test._range("ramp")))) for test in tests]),
        of([float(test.voltage[-1]) for test in tests]),
        wanted[index],
        of([test.total for test in tests]).astype(bool),
        of([test.measure == "area_strain" for test in tests]).astype(bool),
        first.surrounded == "frame",
    )
