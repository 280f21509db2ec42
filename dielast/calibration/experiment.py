"""Tests for a calibration: measured values, times, temperature and specimen."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dielast.base.errors import DielastError, InputError
from dielast.calibration.voltage import VoltageTest
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.material.material import Material
from dielast.mechanics.load import Mode
from dielast.numerics.arrays import Cases, Flags, Floats, rms
from dielast.simulate.membrane import BEARS_NOTHING, bearing

TOLERANCE = 1e-3  # of the range of the values: lets straight lines remove the noise of a machine


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MeasuredTest(Result):
    """A test in which the stretch was prescribed: `time` in s, `stretch` and nominal `stress` in Pa, all (n,), times ascending.

    Time counts from the undeformed state at rest; a stretch other than 1 at time 0 was reached at once. `temperature` in degC.
    A constant voltage between electrodes on both faces is stated as a `nominal_field`; the stress is still that of the machine.
    Tests of one `specimen` share the factor by which its stress differs from that of the material. Raises `InputError` for columns
    of unequal length, fewer than 3 points, values that are not finite, times that do not ascend, and a test without stretch or
    stress.
    """

    name: str
    time: Floats
    stretch: Floats
    stress: Floats
    temperature: float
    mode: Mode | str = Mode.UNIAXIAL
    specimen: str = ""
    nominal_field: float = 0.0
    """Constant voltage over the undeformed thickness, V/m."""
    ramp_rate: float | None = None
    """Rate in 1/s of the ramp from rest to the first stretch, which is held until the time of the first point; None: a ramp that
    ends at this time.
    """
    slack: str | None = None
    """What the specimen does that the stretch would press together, as in `relax`: "bears nothing" or "pushes"."""
    left_out: Flags | None = None
    """Points (n,) that the misfit leaves out, although the history goes through them; None: no point. Once they are in
    `unused`, this is None.
    """
    unused: Floats = field(init=False)
    """Time in s, stretch and stress in Pa of the points left out, (3, m)."""
    corner_time: Floats = field(init=False)
    corner_stretch: Floats = field(init=False)
    header: ClassVar = "nominal_stress_1 [Pa]"
    unit: ClassVar = "Pa"
    rest: ClassVar = 0.0
    wide: ClassVar = 1.0
    power: ClassVar = 1.0

    def __post_init__(self) -> None:
        time, stretch, stress = (np.asarray(getattr(self, name), dtype=float) for name in ("time", "stretch", "stress"))
        if not time.ndim == 1 or not time.shape == stretch.shape == stress.shape:
            raise InputError("time, stretch and stress need one value for each point", argument=self.name)
        if time.size < 3:
            raise InputError(f"at least 3 points are needed, not {time.size}", argument=self.name)
        if not np.all(np.isfinite(time) & np.isfinite(stretch) & np.isfinite(stress)):
            raise InputError("every value must be finite", argument=self.name)
        if not np.isfinite(self.nominal_field):
            raise InputError("a finite number is needed", argument="nominal_field")
        if np.any(time < 0) or np.any(np.diff(time) <= 0):
            raise InputError("times must ascend from 0 s", argument=self.name)
        if np.any(stretch <= 0):
            raise InputError(f"a stretch of {stretch.min():g}: a number above 0 is needed (1 is undeformed)", argument=self.name)
        if not np.any(stress):
            raise InputError("the stress is 0 throughout: nothing was measured", argument=self.name)
        if np.all(stretch == 1) and not self.nominal_field:
            raise InputError(
                "the stretch is 1 throughout: a test of an undeformed specimen determines no constant", argument=self.name
            )
        # at a stretch reached at once, the stress changes within the first moment
        if time[0] == 0 and (stretch[0] != 1 or self.nominal_field):
            kept = corners(time, stretch)
            corner_time, corner_stretch = time[kept], stretch[kept]
            time, stretch, stress = time[1:], stretch[1:], stress[1:]
        else:
            before = self._before(float(time[0]), float(stretch[0]))
            corner_time, corner_stretch = np.append(before[0], time), np.append(before[1], stretch)
            kept = corners(corner_time, corner_stretch)
            corner_time, corner_stretch = corner_time[kept], corner_stretch[kept]
        used = np.ones(time.size, dtype=bool) if self.left_out is None else ~np.ravel(self.left_out).astype(bool)[-time.size :]
        if used.size != time.size:
            raise InputError("left_out needs one value for each point", argument=self.name)
        if not used.all() and np.count_nonzero(used) < 3:
            left = f"{np.count_nonzero(used)} of {used.size} points are not left out of the misfit: at least 3 are needed"
            raise InputError(left, argument=self.name)
        unused = np.stack((time, stretch, stress))[:, ~used]
        time, stretch, stress = time[used], stretch[used], stress[used]
        values = {
            "left_out": None,
            "unused": unused,
            "time": time,
            "stretch": stretch,
            "stress": stress,
            "mode": Mode.of(self.mode),
            "slack": bearing(self.slack, Mode.of(self.mode), bool(self.nominal_field)),
            "specimen": self.specimen or self.name,
        }
        for name, value in {**values, "corner_time": corner_time, "corner_stretch": corner_stretch}.items():
            object.__setattr__(self, name, value)

    def _before(self, time: float, stretch: float) -> tuple[list[float], list[float]]:
        """Times and stretches before the first point."""
        if time == 0:
            return [], []
        if self.ramp_rate is None:
            return [0.0], [1.0]
        if not self.ramp_rate > 0:
            raise InputError(f"{self.ramp_rate:g} /s: a rate above 0 is needed", argument="ramp_rate")
        lasts = abs(stretch - 1) / self.ramp_rate
        if lasts > time:
            late = f"at {self.ramp_rate:g} /s a stretch of {stretch:g} is reached after {lasts:g} s"
            raise InputError(f"{late}, but the first point is at {time:g} s: state a higher rate", argument="ramp_rate")
        return ([0.0, lasts], [1.0, stretch]) if 0 < lasts < time else ([0.0], [1.0])

    @property
    def measured(self) -> Floats:
        """The nominal stress in Pa (n,)."""
        return self.stress

    @property
    def place(self) -> Floats:
        """The path length (n,) of each point along the curve."""
        return path_length(self.time, self.stretch)

    @property
    def may_be_slack(self) -> bool:
        """Whether the specimen bears no pressure."""
        return self.slack == BEARS_NOTHING

    @property
    def followed(self) -> Floats:
        """The stretch (n,) on the straight lines between the corners."""
        return np.interp(self.time, self.corner_time, self.corner_stretch)

    @property
    def largest_invariant(self) -> float:
        """The largest I1 of the test."""
        return float(np.max(first_invariant(self.corner_stretch, Mode(self.mode))))


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedExperiment:
    """A test with a simulation, such as an actuation test of a recipe: `measured` values of the column `header`, in its `unit` and
    less the value at `rest`, at times (n,) in s and at `temperature` in degC. Tests of one `specimen` share its stress factor.
    """

    name: str
    specimen: str
    time: Floats
    measured: Floats
    rest: float
    unit: str
    temperature: float
    header: str
    stretch: ClassVar = None  # not prescribed
    wide: ClassVar = 1.0
    power: ClassVar = 1.0
    unused: ClassVar = np.zeros((3, 0))

    @property
    def place(self) -> Floats:
        """The path length (n,) of each point along the curve."""
        return path_length(self.time, self.measured)

    def answers(self, materials: Sequence[Material | None]) -> Floats:
        """The simulated values (materials, n) less `rest`, NaN if a material cannot follow the test."""
        raise NotImplementedError

    def reach(self, material: Material) -> tuple[str, float]:
        """The mode of loading, such as "equibiaxial", and the largest I1 of this material until the last point."""
        raise NotImplementedError


Experiment = MeasuredTest | SimulatedExperiment | VoltageTest
"""A test as the fit needs it: `wide` is the error of its points over that of a usual one at their level, one number or (n,), and
its values go with the `power` of the stress.
"""


def relative_error(tests: Sequence[Experiment], misses: Sequence[Floats]) -> float:
    """The root mean square of the differences (n,) from the measured values over that of the measured values less those at rest,
    over all points with a difference that is not NaN; NaN if there are none, or if these measured values are 0.

    The values of each test are over their own root mean square if the units of the tests differ.
    """
    miss, measured = _comparable(tests, misses)
    return rms(miss) / rms(measured) if np.any(measured) else np.nan


def explained(tests: Sequence[Experiment], misses: Sequence[Floats]) -> float:
    """The share of the variance of the measured values that a model with the differences (n,) explains, over the same points as in
    `relative_error`; NaN if these values do not vary.
    """
    miss, measured = _comparable(tests, misses)
    variance = float(np.var(measured)) if measured.size else 0.0
    return 1 - float(np.mean(np.square(miss))) / variance if variance > 0 else np.nan


def _comparable(tests: Sequence[Experiment], misses: Sequence[Floats]) -> tuple[Floats, Floats]:
    """The differences that are not NaN and the measured values (k,) of all tests, of one size if their units differ."""
    mixed = len({test.unit for test in tests}) > 1
    sizes = [rms(test.measured) if mixed else 1.0 for test in tests]
    measured = np.concatenate([test.measured / size for test, size in zip(tests, sizes, strict=True)])
    miss = np.concatenate([miss / size for miss, size in zip(misses, sizes, strict=True)])
    known = np.isfinite(miss)
    return miss[known], measured[known]


def answers_of(
    solve: Callable[[Sequence[Material]], Sequence[Floats]], materials: Sequence[Material | None], points: int
) -> Floats:
    """The values (materials, points) that `solve` returns for all materials together, or one by one if one of them fails.

    NaN for a material that fails, and for None.
    """
    values = np.full((len(materials), points), np.nan)

    def fill(part: Sequence[tuple[int, Material]]) -> None:
        try:
            answers = solve([material for _, material in part])
        except DielastError:
            for entry in part if len(part) > 1 else ():
                fill([entry])
            return
        for (row, _), answer in zip(part, answers, strict=True):
            values[row] = answer

    if there := [(row, material) for row, material in enumerate(materials) if material is not None]:
        fill(there)
    return values


def corners(time: Floats, value: Floats) -> Cases:
    """Indices of corners: straight lines between them deviate by at most `TOLERANCE` times the range of values from all points
    (n,).

    They include the first and the last point (Ramer 1972, DOI 10.1016/S0146-664X(72)80017-0; distances along the axis of values).
    """
    allowed = TOLERANCE * float(np.ptp(value)) + 1e-12 * float(np.max(np.abs(value)))
    kept = np.zeros(time.size, dtype=bool)
    kept[[0, -1]] = True
    waiting = [(0, time.size - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        line = np.interp(time[inner], time[[first, last]], value[[first, last]])
        miss = np.abs(value[inner] - line)
        furthest = int(np.argmax(miss))
        if miss[furthest] > allowed:
            middle = first + 1 + furthest
            kept[middle] = True
            waiting += [(first, middle), (middle, last)]
    return np.flatnonzero(kept)


def first_invariant(stretch: Floats, mode: Mode) -> Floats:
    """I1 (n,) of an incompressible film at stretches (n,)."""
    squared = np.square(stretch)
    second: Floats = {Mode.UNIAXIAL: 1 / stretch, Mode.EQUIBIAXIAL: squared, Mode.PURE_SHEAR: np.ones_like(squared)}[mode]
    total: Floats = squared + second + 1 / (squared * second)
    return total


def path_length(time: Floats, value: Floats) -> Floats:
    """The path length (n,) of each point along a curve, in ranges of the value and decades of time; independent of the sampling.

    A ramp has a length of about 1, and so has each decade of a hold.
    """
    reach = float(np.ptp(value))
    moved = np.diff(value) / reach if reach > 0 else np.zeros(time.size - 1)
    first = time[time > 0][0] if np.any(time > 0) else 1.0
    later = np.diff(np.log10(np.maximum(time, first)))
    # the value measures the path in a ramp, time in a hold
    return np.concatenate(([0.0], np.cumsum(np.where(np.abs(moved) > 0.02 * later, np.abs(moved), later))))
