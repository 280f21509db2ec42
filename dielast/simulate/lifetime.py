"""Time to failure over voltage: the exponential law, a straight line of log10 t over V, and the inverse power law, a straight line
of log10 t over log10 V.
"""

from dataclasses import dataclass

import numpy as np

from dielast.io.result import Result, TabularResult
from dielast.io.table import Column, Table
from dielast.numerics.arrays import Floats, rms
from dielast.simulate.failure_map import FailureMap

UNITS = {"slope": "1/V", "intercept": "1", "rms_residual": "1", "r_squared": "1"}
POWER = ("power_exponent", "power_intercept", "power_rms_residual", "power_r_squared")
EXPONENTIAL_LAW, POWER_LAW = "exponential", "inverse power"
ROOM = 1.8  # factor between the limits of a figure's time axis and the shortest and longest times
EXACT = 1e-6  # decades; about the accuracy of solved times, below which residuals have no meaning
MARKER = 3.5 / 150  # size of a marker over the height of the axes


@dataclass(frozen=True, slots=True, repr=False)
class LifetimeLine(Result):
    """Two laws of the time to failure at one `temperature` (degC) and `prestretch`, fitted to the same number of `points`:

        log10(t / 1 s) = intercept + slope V                                      (slope in 1/V)
        log10(t / 1 s) = power_intercept - power_exponent log10(V / 1 V).

    Residuals are in decades. `furthest` are the largest residuals of the exponential and of the power law, and `resolution` is the
    size of a marker in a figure of the whole map. Constants that need more points than there are are NaN.
    """

    temperature: float
    prestretch: tuple[float, float]
    slope: float
    intercept: float
    rms_residual: float
    r_squared: float
    points: int
    electrode_share: float | None = None
    power_exponent: float = np.nan
    power_intercept: float = np.nan
    power_rms_residual: float = np.nan
    power_r_squared: float = np.nan
    furthest: tuple[float, float] = (np.nan, np.nan)
    resolution: float = np.inf

    @property
    def aic_difference(self) -> float:
        """Akaike's criterion of the exponential law minus that of the power law, the difference of n ln(sum of squares).

        Both laws have two constants. If it is positive, the power law is closer. NaN if a law is not known, or for two points.
        """
        residuals = np.maximum((self.rms_residual, self.power_rms_residual), EXACT)
        return float(2 * self.points * np.log(residuals[0] / residuals[1])) if self.points > 2 else np.nan

    @property
    def drawn_law(self) -> str:
        """The law that a figure draws: the closer one; empty if a point deviates from it by more than the size of a marker."""
        law, residual = (POWER_LAW, self.furthest[1]) if self.aic_difference > 0 else (EXPONENTIAL_LAW, self.furthest[0])
        return law if residual <= self.resolution else ""

    def drawn(self, voltage: Floats) -> Floats:
        """Times to failure in s at voltages in V (any shape), by the drawn law."""
        if self.drawn_law == POWER_LAW:
            return np.asarray(10 ** (self.power_intercept - self.power_exponent * np.log10(voltage)))
        return np.asarray(10 ** (self.intercept + self.slope * voltage))


class LifetimeLines(tuple[LifetimeLine, ...], TabularResult):
    """Laws by temperature and prestretch, in a tuple that is also a table."""

    __slots__ = ()

    def __repr__(self) -> str:
        slopes = f": slope={self[0].slope:.5g} ... {self[-1].slope:.5g}" if self else ""
        return f"LifetimeLines(<{len(self)}{slopes}>)"

    def columns(self) -> Table:
        """The table of the constants of both laws, one row per temperature and prestretch."""

        def column(name: str, unit: str) -> Column:
            return Column(name, unit, np.array([getattr(line, name) for line in self], dtype=float))

        prestretch = np.array([line.prestretch for line in self], dtype=float).reshape(-1, 2)
        return [
            column("temperature", "degC"),
            *(Column(f"prestretch_{axis + 1}", "1", prestretch[:, axis]) for axis in (0, 1)),
            *([column("electrode_share", "1")] if any(line.electrode_share is not None for line in self) else []),
            *(column(name, unit) for name, unit in UNITS.items()),
            Column("points", None, np.array([line.points for line in self], dtype=np.int64)),
            *(column(name, "1") for name in (*POWER, "aic_difference")),
        ]

    def not_drawn(self) -> str:
        """A sentence on the lines that a figure omits, and the reason; empty if it draws all lines."""
        fitted = [line for line in self if line.points > 2]
        missing = [line for line in fitted if not line.drawn_law]
        if not missing:
            return ""
        largest = max(line.furthest[line.aic_difference > 0] for line in missing)
        return f"{len(missing)} of {len(fitted)} lines: no law meets all points, the closer one is up to {largest:.2g} decades off"


def fit_lifetime(result: FailureMap) -> LifetimeLines:
    """Least-squares lines of the log time to failure (s) over voltage (V), and over its log, for each temperature and prestretch
    (nt, np), through the films that fail after 0 s and within the horizon.
    """
    lines = []
    times = result.time_to_failure[np.isfinite(result.time_to_failure) & (result.time_to_failure > 0)]
    resolution = MARKER * float(np.log10(ROOM**2 * times.max() / times.min())) if times.size else np.inf
    for i, j in np.ndindex(result.time_to_failure.shape[:2]):
        film = float(result.temperature[i]), (float(result.prestretch[j, 0]), float(result.prestretch[j, 1]))
        share = None if result.electrode_share is None else float(result.electrode_share[j])
        time = result.time_to_failure[i, j]
        used = np.isfinite(time) & (time > 0)
        voltage, decades = result.voltage[used], np.log10(time[used])
        # the power law cannot include a failure at 0 V
        powers = np.log10(voltage) if np.all(voltage > 0) else np.full(voltage.size, np.nan)
        exponential, power = _line(voltage, decades), _line(powers, decades)
        furthest = exponential[4], power[4]
        line = LifetimeLine(*film, *exponential[:4], voltage.size, share, -power[0], *power[1:4], furthest, resolution)
        lines.append(line)
    return LifetimeLines(lines)


def _line(x: Floats, y: Floats) -> tuple[float, float, float, float, float]:
    """Slope, intercept, rms residual, R^2 and largest residual of the least-squares line of y over x, both (n,); NaN if n < 2."""
    if x.size < 2:
        return (np.nan,) * 5
    centred = x - x.mean()
    slope = float(centred @ y / (centred @ centred))
    intercept = float(y.mean() - slope * x.mean())
    # the residuals of a line through two points are rounding errors
    residual = y - intercept - slope * x if x.size > 2 else np.zeros(2)
    spread = float(np.sum((y - y.mean()) ** 2))
    r_squared = 1 - float(residual @ residual) / spread if spread > 0 else np.nan
    return slope, intercept, rms(residual), r_squared, float(np.abs(residual).max())
