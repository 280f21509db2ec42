"""The uncertainty of a master curve by resampling: master curves of the same tests with different noise.

`dielast.superposition.resample` describes how new tests are generated. Each draw is shifted and fitted like the measurement.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dielast.errors import InputError, NumericsError, without_warnings
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.measurement import Measurement
from dielast.material.shift import ShiftLaw
from dielast.numerics.arrays import Floats, Index
from dielast.numerics.random_streams import stream
from dielast.superposition.mastercurve import Vertical, build_master_curve
from dielast.superposition.resample import Resampled
from dielast.superposition.result import MasterCurve

GRID = 100  # reduced times at which the curves of all draws are stored


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MasterCurveDraws(TabularResult):
    """Draws of a master curve of m temperatures: the results of resampled tests, one row per draw.

    `log10_shift_factor` and `vertical_shift` (draws, m) at `temperature` (m,) in degC are NaN where a draw does not determine them.
    `law_parameters` (draws, p) are the parameters of the shift `law` that vary between draws, in the units of `law.drawn`.
    `smooth_ordinates` (draws, c, k) are the smooth curves at `smooth_abscissa` (k,), both as in `MasterCurve`.
    `number` (draws,) numbers the draws from 0; draws without a master curve are missing.
    """

    number: Index
    temperature: Floats
    log10_shift_factor: Floats
    vertical_shift: Floats
    law: ShiftLaw
    law_parameters: Floats
    smooth_abscissa: Floats
    smooth_ordinates: Floats

    def columns(self) -> Table:
        """The shift factors of all draws, one draw after another."""
        count, m = self.log10_shift_factor.shape
        return [
            Column("draw", None, np.repeat(self.number, m)),
            Column("temperature", "degC", np.tile(self.temperature, count)),
            Column("log10_shift_factor", "1", self.log10_shift_factor.ravel()),
            Column("vertical_shift", "1", self.vertical_shift.ravel()),
        ]

    def stderr(self) -> dict[str, float]:
        """Standard errors of the law's parameters by name: the standard deviations of the draws."""
        spread = np.std(self.law_parameters, axis=0, ddof=1)
        return dict(zip((name for name, _ in self.law.drawn()), spread.tolist(), strict=True))


def bootstrap_master_curve(
    curves: Sequence[Measurement],
    master: MasterCurve,
    *,
    draws: int,
    seed: int = 1,
    law: str = "wlf",
    vertical: Vertical = "none",
    thermal_expansion: float = 0.0,
    progress: Callable[[int, int], None] | None = None,
) -> MasterCurveDraws:
    """Draws of the `master` curve that `build_master_curve` made from `curves` with the same arguments.

    A draw depends only on `seed` and its number. `progress` is called with the number of finished draws and the total. Units and
    shapes are those of `MasterCurveDraws`. The method is the wild bootstrap of `dielast.superposition.resample` (Wu, DOI
    10.1214/aos/1176350142). Raises `InputError` for fewer than two draws, and `NumericsError` if less than half of them give a
    master curve.
    """
    if (draws := int(draws)) < 2:
        raise InputError(f"{draws} draws: at least 2 are needed")
    if not curves:
        raise InputError("at least one curve is needed", argument="curves")
    resampled = Resampled.of(curves, master)
    grid = np.geomspace(master.smooth_abscissa[0], master.smooth_abscissa[-1], GRID)
    rows: list[tuple[int, Floats, Floats, Floats, Floats]] = []
    for draw in range(draws):
        with without_warnings():
            try:
                drawn = build_master_curve(
                    resampled.draw(stream(seed, "measurements", draw)),
                    reference_temperature=master.reference_temperature,
                    law=law,
                    vertical=vertical,
                    thermal_expansion=thermal_expansion,
                    on=master.shifted_on if len(master.ordinates) > 1 else "auto",
                    temperature_stderr=master.stated.temperature_stderr,
                    drift=master.stated.drift,
                )
                values = master.shift_fit.doubted(master.law.numbers_of(drawn.law), stream(seed, "law", draw))
                master.law.redrawn(values.tolist())  # no material relaxes more slowly when it is warmer
            except (InputError, NumericsError):
                continue
            finally:
                if progress is not None:
                    progress(draw + 1, draws)
        # a draw whose temperatures move too far loses one of them
        shift = np.full((2, master.temperature.size), np.nan)
        shift[:, np.searchsorted(master.temperature, drawn.temperature)] = drawn.log10_shift_factor, drawn.vertical_shift
        rows.append((draw, *shift, values, _on_grid(drawn, grid)))
    if 2 * len(rows) < draws:
        raise NumericsError(f"only {len(rows)} of {draws} draws give a master curve: the data are too poor for an uncertainty")
    number, shift, raised, values, smooth = (np.array(column) for column in zip(*rows, strict=True))
    return MasterCurveDraws(number, master.temperature, shift, raised, master.law, values, grid, smooth)


def _on_grid(master: MasterCurve, grid: Floats) -> Floats:
    """Smooth curves (c, k) through all points at the abscissas `grid` (k,), extrapolated linearly in log-log."""
    x, at = np.log(master.smooth_abscissa), np.log(grid)
    before, after = np.minimum(at - x[0], 0.0), np.maximum(at - x[-1], 0.0)
    rows = []
    for y in np.log(master.smooth_ordinates):
        beyond = before * (y[1] - y[0]) / (x[1] - x[0]) + after * (y[-1] - y[-2]) / (x[-1] - x[-2])
        rows.append(np.exp(np.interp(at, x, y) + beyond))
    return np.array(rows)
