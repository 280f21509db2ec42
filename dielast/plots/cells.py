"""Cells of a map over voltage and prestretch: filled or hatched, with the patch that explains them in the legend."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from matplotlib.typing import ColorType
from numpy.typing import NDArray

from dielast.mechanics.criteria import named
from dielast.plots.texts import unit_for
from dielast.simulate.failure_map import FailureMap

UNFINISHED = "#E6A0A0"
AT_ONCE = "0.6"
CLEAR = ListedColormap([(0.0, 0.0, 0.0, 0.0)])


def patch(colour: ColorType, label: str) -> Patch:
    """The patch of a filled region in a legend."""
    return Patch(facecolor=colour, edgecolor="black", linewidth=0.5, label=label)


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """The cells of the map of one temperature: `voltage` (nv,) in `unit`, and `prestretch` (np,), ascending, which are those of the
    result in this `order` (np,).
    """

    unit: str
    voltage: NDArray[np.float64]
    prestretch: NDArray[np.float64]
    order: NDArray[np.intp]

    @classmethod
    def of(cls, result: FailureMap) -> Cells:
        """The cells of a map of equibiaxial prestretches."""
        unit, factor = unit_for("V", float(result.voltage.max()))
        order = np.argsort(result.prestretch[:, 0])
        return cls(unit, result.voltage * factor, result.prestretch[order, 0], order)

    def fill(self, axes: Axes, where: NDArray[np.bool_], colour: str, label: str) -> Patch:
        """Fill the cells `where` (np, nv) is True."""
        cells = np.ma.masked_where(~where, np.ones(where.shape))
        axes.pcolormesh(self.voltage, self.prestretch, cells, cmap=ListedColormap([colour]), shading="nearest", rasterized=True)
        return patch(colour, label)

    def hatch(self, axes: Axes, mode: NDArray[np.str_], failures: Iterable[str], colour: ColorType) -> list[Patch]:
        """Hatch the cells whose `mode` (np, nv) is one of the `failures` with a hatch; the patches have it on a `colour`."""
        patches = []
        for failure in failures:
            hatch, where = named(failure).hatch, mode == failure
            if hatch and where.any():
                cells = np.ma.masked_where(~where, np.ones(mode.shape))
                places = self.voltage, self.prestretch
                axes.pcolor(*places, cells, cmap=CLEAR, shading="nearest", hatch=hatch, edgecolor="white", linewidth=0.0)
                patches.append(Patch(facecolor=colour, edgecolor="white", hatch=hatch, linewidth=0.5, label=f"{failure} first"))
        return patches
