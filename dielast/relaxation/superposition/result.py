"""The result of time-temperature superposition: a master curve of any kind of measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.base.errors import InputError
from dielast.io.result import TabularResult
from dielast.io.table import Column, Frame, Table, spoken, to_frame
from dielast.material.measurement_kind import KINDS, KindName, MeasurementKind
from dielast.material.shift import ShiftLaw
from dielast.numerics.arrays import Flags, Floats, Index
from dielast.relaxation.superposition.checks import Undetermined
from dielast.relaxation.superposition.effects import Drift
from dielast.relaxation.superposition.shiftfit import ShiftFit
from dielast.relaxation.superposition.sweepfit import Basis


@dataclass(frozen=True, slots=True)
class Stated:
    """Errors stated by the user, as the scatter of points does not show them: the standard error of each temperature in K, and the
    relative standard deviation of the modulus of the specimen from one temperature to the next, in the order of measurement.
    """

    temperature_stderr: float
    drift: float

    def walk(self, order: Index) -> Drift:
        """The drift of curves that were measured in this `order` (m,); one that is not stated goes along the temperature."""
        return Drift.of(order if self.drift > 0 else np.arange(order.size), self.drift / np.log(10))


@dataclass(frozen=True, slots=True, eq=False)
class Placing:
    """Where a joint fit places the m curves: log10 a and log10 b (m,) relative to the curve numbered `anchor`.

    `covariance` (2m, 2m) is that of the fit, and `thermometer` (m,) are the standard errors of log10 a due to the temperatures.
    `determined` (m,) marks shift factors that the data determine. log10 a at the reference temperature is `origin`, with the
    derivative `weight` (m,) and the additional variance `excess`.
    """

    shift: Floats
    vertical: Floats
    covariance: Floats
    thermometer: Floats
    determined: Flags
    anchor: int
    origin: float
    weight: Floats
    excess: float


class _Quantity:
    """A measured quantity of a master curve: the row called `name` among the values of `field`.

    Raises `InputError` if the curve is of a kind of measurement without that quantity.
    """

    def __init__(self, name: str, field: str, doc: str) -> None:
        self.name, self.field, self.__doc__ = name, field, doc

    def __get__(self, curve: MasterCurve | None, owner: type[MasterCurve]) -> Floats:
        if curve is None:
            return self  # type: ignore[return-value]
        values: Floats = getattr(curve, self.field)
        ordinates = [name for name, _ in curve.kind.ordinates]
        if self.name == curve.kind.abscissa[0]:
            return values
        if self.name not in ordinates:
            raise InputError(f"a master curve of {curve.measurement} has no {spoken(self.name)}")
        return np.asarray(values[ordinates.index(self.name)])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MasterCurve(TabularResult):
    """A master curve of m temperatures, ascending; SI units and degC.

    `log10_shift_factor`, its standard error (both (m,)) and its `covariance` (m, m) are measured, relative to the reference
    temperature. Where the data do not determine a shift, it is NaN, its standard error is infinite, and `undetermined` has the
    reason. The errors allow for noise, for curves that do not superpose and, if the reference temperature was not measured, for the
    error of the law there (infinite if it is 50 K or more below all data and these do not determine C2). `log10_shift_factor_fit`
    (m,) is the fitted law; NaN for a temperature that a table lacks. `vertical_shift` (m,) is b. `shifted_on` says what the shifts
    of frequency sweeps were read from: both moduli, tan delta, or the storage modulus alone.

    The points used (n,), sorted by reduced abscissa: `point_temperature`, `abscissa` (time in s, or angular frequency in rad/s),
    `reduced_abscissa` (time / a, angular frequency times a) and `ordinates` (c, n): relaxation modulus (Young's, Pa, times b),
    creep compliance (tensile, 1/Pa, over b), or storage and loss modulus (Young's, Pa, times b), which are also available as
    properties by name. Points of an undetermined temperature are shifted by the law, or omitted if the law is a table.
    `smooth_abscissa` (k,), reduced, and `smooth_ordinates` (c, k) are the fitted curves.

    `equilibrium_modulus` is the fitted modulus at the longest reduced time or lowest reduced frequency (of a compliance, its
    inverse), `glassy_modulus` its maximum. `rms_residual_decades` is that of the fitted points, in log10 of modulus or compliance;
    these are averages over 1/20 decade of time or frequency. Averages that contain one of the `outlying_points`, which are far from
    the master curve, are excluded.

    `stated` are the errors stated by the user. `offset_spread` and `tilt_spread` are the estimated standard deviations, in decades
    of modulus, of the vertical offsets (beyond a stated drift) and tilts of whole curves. The standard errors include both; points,
    smooth curves and moduli are not corrected for them. `placing` is the joint fit. `ramp` is the duration in s of a ramp that was
    found in the tests and taken out, else 0; times of points are then mean ages of the load.
    """

    measurement: KindName
    reference_temperature: float
    temperature: Floats
    log10_shift_factor: Floats
    log10_shift_factor_stderr: Floats
    log10_shift_factor_fit: Floats
    covariance: Floats
    vertical_shift: Floats
    vertical_shift_stderr: Floats
    shift_fit: ShiftFit
    shifted_on: Basis
    rms_residual_decades: float
    point_temperature: Floats
    abscissa: Floats
    reduced_abscissa: Floats
    ordinates: Floats
    smooth_abscissa: Floats
    smooth_ordinates: Floats
    equilibrium_modulus: float
    glassy_modulus: float
    undetermined: tuple[Undetermined, ...]
    stated: Stated
    placing: Placing
    offset_spread: float
    tilt_spread: float
    outlying_points: int = 0
    ramp: float = 0.0

    @property
    def kind(self) -> MeasurementKind:
        """The kind of measurement that the curve was made of."""
        return KINDS[self.measurement]

    def columns(self) -> Table:
        """The points used."""
        names = (self.kind.abscissa, self.kind.reduced_abscissa, *self.kind.ordinates)
        values = (self.abscissa, self.reduced_abscissa, *self.ordinates)
        points = (Column(name, unit, column) for (name, unit), column in zip(names, values, strict=True))
        return [Column("temperature", "degC", self.point_temperature), *points]

    def shift_columns(self) -> Table:
        """The shift factors, one row per temperature."""
        return [
            Column("temperature", "degC", self.temperature),
            Column("log10_shift_factor", "1", self.log10_shift_factor),
            Column("log10_shift_factor_stderr", "1", self.log10_shift_factor_stderr),
            Column("log10_shift_factor_fit", "1", self.log10_shift_factor_fit),
            Column("vertical_shift", "1", self.vertical_shift),
        ]

    def shift_to_frame(self) -> Frame:
        """The shift factors as a data frame."""
        return to_frame(self.shift_columns())

    @property
    def law(self) -> ShiftLaw:
        """The fitted shift law, about the reference temperature."""
        return self.shift_fit.law

    @property
    def law_parameters(self) -> dict[str, float]:
        """Parameters of the law by name: C1 and C2 (K), or activation_energy (J/mol); none for a table."""
        return self.shift_fit.parameters

    @property
    def law_stderr(self) -> dict[str, float]:
        """Standard errors of the parameters; infinite where the data do not determine them."""
        return self.shift_fit.stderr

    time = _Quantity("time", "abscissa", "Times of the points of relaxation or creep in s (n,).")
    reduced_time = _Quantity("time", "reduced_abscissa", "Reduced times of the points of relaxation or creep in s (n,), ascending.")
    smooth_reduced_time = _Quantity("time", "smooth_abscissa", "Reduced times of the fitted curve in s (k,), ascending.")
    angular_frequency = _Quantity("angular_frequency", "abscissa", "Angular frequencies of the points of sweeps in rad/s (n,).")
    reduced_angular_frequency = _Quantity(
        "angular_frequency", "reduced_abscissa", "Reduced angular frequencies of the points of sweeps in rad/s (n,), ascending."
    )
    relaxation_modulus = _Quantity(
        "relaxation_modulus", "ordinates", "Young's relaxation modulus of the points in Pa (n,), times b."
    )
    creep_compliance = _Quantity("creep_compliance", "ordinates", "Tensile creep compliance of the points in 1/Pa (n,), over b.")
    storage_modulus = _Quantity("storage_modulus", "ordinates", "Young's storage modulus of the points in Pa (n,), times b.")
    loss_modulus = _Quantity("loss_modulus", "ordinates", "Young's loss modulus of the points in Pa (n,), times b.")
    smooth_modulus = _Quantity("relaxation_modulus", "smooth_ordinates", "Fitted relaxation modulus in Pa (k,).")
