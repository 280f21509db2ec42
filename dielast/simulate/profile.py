"""Stretches and stresses across a film with a passive part, at stated times."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Table, case_table
from dielast.mechanics.equations import Films
from dielast.mechanics.passive.forms import Spread
from dielast.mechanics.passive.framed import FramedFilms, Surroundings
from dielast.numerics.arrays import Cases, Floats
from dielast.simulate.recorder import Recorder

UNITS = {
    **{"time": "s", "radius": "1", "stretch_1": "1", "stretch_2": "1"},
    **{"nominal_stress_1": "Pa", "nominal_stress_2": "Pa"},
}
"""The columns of a profile, with their units."""
RESOLVED = 1e-4
"""Largest difference of the transverse stretches on both sides of the electrode's edge, relative to that of the electrode;
of taut films it is some 1e-5, and radial stretches are less exact by far.
"""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Profiles(TabularResult):
    """The columns (rows,) of each case by header, one time after another.

    The radius of a disc in a frame is over that of the electrode; for a strip, it is the place along the length over half the
    length of the electrode. The edge of the electrode appears twice, on its active and on its passive side. Axis 1 is the radius,
    or the length. Stresses are nominal and total, Maxwell stress included.

    Once the film around a disc has lost tension, its mesh, which is chosen for a taut film, may be too coarse next to the
    electrode (see `unresolved`). Stretches and stresses are NaN where it yields a stretch that is not positive.
    """

    cases: tuple[Mapping[str, Floats], ...]

    def columns(self) -> Table:
        """The table of all cases, one after another."""
        return case_table(dict(enumerate(self.cases)))


def unresolved(profile: Mapping[str, Floats]) -> Floats:
    """The times (k,) in s of a case's profile at which the mesh does not resolve the passive film next to the electrode.

    The edge of the electrode is one circle of the film, r(A) = l_a A, so that the hoop stretches on both its sides are equal. The
    mesh fulfils this if they differ by at most `RESOLVED`, and no place is without a positive stretch.
    """
    time, radius, hoop = (profile[header] for header in ("time [s]", "radius [1]", "stretch_2 [1]"))
    inner, outer = hoop[radius == 1].reshape(-1, 2).T  # rows of a time: inside, edge, edge, outside
    times = time[radius == 1][::2]
    apart = ~(np.abs(outer - inner) <= RESOLVED * inner)
    return np.asarray(times[apart | np.isin(times, time[np.isnan(hoop)])])


@dataclass(slots=True, eq=False)
class ProfileRecorder(Recorder):
    """An observer of the stepper that stores profiles of films with a passive part: stretches and nominal stresses (4 radii, cases,
    times) at the places of `spread`.
    """

    spread: Spread = field(kw_only=True)

    @property
    def width(self) -> int:
        """The number of values of a film at a time."""
        return 4 * len(self.spread.radius)

    @property
    def needs_springs(self) -> bool:
        """Stresses need the viscous stretches."""
        return True

    def _evaluated(self, system: Films, state: Floats, pooled: Cases, case: Cases, moment: Floats, age: Floats) -> Floats:
        """The profiles (values, k) of films at `moment` (k,) in s since their span began."""
        films = system.take(pooled)
        assert isinstance(films, FramedFilms)
        now = Surroundings(films.assembly, state[films.border :])
        stresses = now.stresses(films.internal(state), films.load.value(moment)[2])
        at_points = np.concatenate((now.stretch(), stresses))
        profiles = np.einsum("rpc,apc->arc", self.spread.weight[..., case], at_points)
        return np.asarray(profiles.reshape(self.width, -1))

    def profiles(self, ends: Floats) -> Profiles:
        """The profiles of each case up to its end (cases,) in s."""
        self._write()
        (stored,), times, radii = self._values, self.output.rows, len(self.spread.radius)
        assert times is not None
        result: list[Mapping[str, Floats]] = []
        for case, end in enumerate(ends.tolist()):
            shown = np.isfinite(stored[0, case]) & (times[case] <= end * (1 + 1e-12))
            values = stored[:, case, shown].reshape(4, radii, -1)
            possible = np.all(values[:2] > 0, axis=0)  # no film passes through itself
            columns = [
                np.repeat(times[case, shown], radii),
                np.tile(self.spread.radius[:, case], np.count_nonzero(shown)),
                *(column.T.ravel() for column in np.where(possible, values, np.nan)),
            ]
            result.append({f"{name} [{unit}]": column for (name, unit), column in zip(UNITS.items(), columns, strict=True)})
        return Profiles(tuple(result))
