"""The passive parts of films, around the electrode, discretised for the solver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.errors import InputError
from dielast.mechanics.cases import of_case
from dielast.mechanics.passive.forms import Spread, across_disc, across_strip, disc, strip
from dielast.mechanics.passive.mesh import points_needed
from dielast.mechanics.passive.structure import Structure
from dielast.mechanics.point_material import Points
from dielast.numerics.arrays import Cases, Floats

COARSER = 10.0 ** np.arange(-10, -1)  # tolerances to suggest where the requested one cannot be met


@dataclass(frozen=True, slots=True, eq=False)
class Passive:
    """The passive parts of films: the `share` (cases,) of the electrode of a disc in a frame or of a strip, and the number of
    `points` (cases,) in the passive part.
    """

    share: Floats
    points: Cases
    is_strip: bool

    @classmethod
    def of(cls, points: Points, share: Floats, first: Floats, second: Floats | None, mesh_rtol: float) -> Passive:
        """The passive parts of films with these prestretches (cases,), strips if there is a second one.

        Raises `InputError` for a `mesh_rtol` that no number of points meets.
        """
        if second is not None:
            return cls(share, np.ones(share.size, dtype=np.intp), True)
        needed = points_needed(points, share, first, mesh_rtol)
        if not needed.all():
            case = int(np.argmin(needed))
            film = f"the film around an electrode of share {float(share[case])!r}, at prestretch {first[case]:g},"
            exact = f"no division of {film} is so exact"
            larger = next((rtol for rtol in COARSER if rtol > mesh_rtol and points_needed(points, share, first, rtol).all()), None)
            instead = "nor so that a larger one would do" if larger is None else f"{larger:g} can be had"
            raise InputError(f"{mesh_rtol:g}: {exact}; {instead}", argument="mesh_rtol", case=of_case(case, share.size))
        return cls(share, needed, False)

    def structure(self, cases: Cases, first: Floats, second: Floats) -> Structure:
        """The structure of the films `cases` (k,), which all have the same number of points, at prestretches (k,)."""
        share = self.share[cases]
        return strip(share, first, second) if self.is_strip else disc(share, first, int(self.points[cases[0]]))

    def spread(self, cases: Cases) -> Spread:
        """The places of these films at which profiles are evaluated."""
        share = self.share[cases]
        return across_strip(share) if self.is_strip else across_disc(share, int(self.points[cases[0]]))
