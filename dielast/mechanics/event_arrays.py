"""The first event of one criterion in many films: its time, and the films at that time."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from dielast.numerics.arrays import ByCase, Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class EventArrays(ByCase):
    """The first event of one criterion: arrays (cases,), NaN for films without that event.

    `time` is in s since the voltage programme began, `field` the nominal field in V/m; Lambda and the mechanical nominal stress in
    Pa are (2, cases); `determinant` is that of pull-in, `exposed` (exposures, cases) are the integrals of exposure.
    """

    time: Floats
    field: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    determinant: Floats
    exposed: Floats

    @classmethod
    def never(cls, cases: int, exposures: int) -> EventArrays:
        """No events yet, in films with this number of `exposures`."""
        return cls(*(np.full((*axes, cases), np.nan) for axes in ((), (), (2,), (2,), (), (exposures,))))

    @property
    def row(self) -> Floats:
        """A row of output at the event (6 + exposures, cases): Lambda, nominal stress, field, determinant, exposures."""
        single = self.field[None], self.determinant[None]
        return np.concatenate((self.log_squared_stretch, self.nominal_stress, *single, self.exposed))

    def put(self, cases: Cases, part: EventArrays) -> None:
        """Write the events `part` of the cases (k,)."""
        for one in fields(self):
            getattr(self, one.name)[..., cases] = getattr(part, one.name)
