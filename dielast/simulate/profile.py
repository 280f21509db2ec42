"""Stretches and stresses across a film with a passive part, at stated times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Table, case_table
from dielast.mechanics.passive.forms import Spread
from dielast.mechanics.passive.framed import FramedFilms, Surroundings
from dielast.mechanics.symmetric import Films
from dielast.numerics.arrays import Cases, Floats
from dielast.simulate.record import Recorder

UNITS = {
    **{"time": "s", "radius": "1", "stretch_1": "1", "stretch_2": "1"},
    **{"nominal_stress_1": "Pa", "nominal_stress_2": "Pa"},
}
"""The columns of a profile, with their units."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Profiles(TabularResult):
    """The columns (rows,) of each case by header, one time after another.

    The radius of a disc in a frame is over that of the electrode; for a strip, it is the place along the length over half the
    length of the electrode. The edge of the electrode appears twice, on its active and on its passive side. Axis 1 is the radius,
    or the length. Stresses are nominal and include the Maxwell stress.
    """

    cases: tuple[Mapping[str, Floats], ...]

    def columns(self) -> Table:
        """The table of all cases, one after another."""
        return case_table(dict(enumerate(self.cases)))


@dataclass(slots=True, eq=False)
class ProfileRecorder(Recorder):
    """An observer of the stepper that stores profiles of films with a passive part: stretches and nominal stresses (4 radii, cases,
    times) at the places of `spread`.
    """

    spread: Spread = field(kw_only=True)

    @property
    def rows(self) -> int:
        """The number of values of a film at a time."""
        return 4 * len(self.spread.radius)

    @property
    def needs_springs(self) -> bool:
        """Stresses need the viscous stretches."""
        return True

    def _write(
        self,
        system: Films,
        state: Floats,
        pooled: Cases,
        case: Cases,
        row: Cases,
        moment: Floats,
        begin: Floats,
        more: Sequence[Floats],
    ) -> None:
        """Store the profiles of films at `moment` (k,) in s since their span began."""
        films = system.take(pooled)
        assert isinstance(films, FramedFilms)
        now = Surroundings(films.assembly, state[films.border :])
        stresses = now.stresses(films.internal(state), films.load.value(moment)[2])
        at_points = np.concatenate((now.stretch(), stresses))
        profiles = np.einsum("rpc,apc->arc", self.spread.weight[..., case], at_points)
        self._values[-1][:, case, row] = profiles.reshape(self.rows, -1)

    def profiles(self, ends: Floats) -> Profiles:
        """The profiles of each case up to its end (cases,) in s."""
        (stored,), times, radii = self._values, self.output.times, len(self.spread.radius)
        assert times is not None
        result: list[Mapping[str, Floats]] = []
        for case, end in enumerate(ends.tolist()):
            shown = np.isfinite(stored[0, case]) & (times[case] <= end * (1 + 1e-12))
            columns = [
                np.repeat(times[case, shown], radii),
                np.tile(self.spread.radius[:, case], np.count_nonzero(shown)),
                *(values.T.ravel() for values in stored[:, case, shown].reshape(4, radii, -1)),
            ]
            result.append({f"{name} [{unit}]": column for (name, unit), column in zip(UNITS.items(), columns, strict=True)})
        return Profiles(tuple(result))
