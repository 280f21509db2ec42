"""The first event of one criterion in many films: when it was, and how the films were then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from dielast.numerics.columns import Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class EventArrays:
    """When the signal of one criterion first fell to zero, and how the films were then: arrays (cases,), NaN where it did not.

    `time` in s since the voltage programme began, `field` the nominal field in V/m; Lambda and the mechanical nominal stress in Pa
    are (2, cases); `determinant` is that of pull-in, `exposed` (exposures, cases) what adds up over time.
    """

    time: Floats
    field: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    determinant: Floats
    exposed: Floats

    @classmethod
    def never(cls, cases: int, exposures: int) -> EventArrays:
        """It has not happened yet, to films of which so many things add up over time."""
        return cls(*(np.full((*axes, cases), np.nan) for axes in ((), (), (2,), (2,), (), (exposures,))))

    @classmethod
    def joined(cls, parts: Sequence[EventArrays]) -> EventArrays:
        """That of the cases of all parts, one part after another."""
        return cls(*(np.concatenate([getattr(part, one.name) for part in parts], axis=-1) for one in fields(cls)))

    @property
    def row(self) -> Floats:
        """A row of output at the event (6 + exposures, cases): Lambda, nominal stress, field, determinant, what adds up."""
        single = self.field[None], self.determinant[None]
        return np.concatenate((self.log_squared_stretch, self.nominal_stress, *single, self.exposed))

    def take(self, cases: Cases) -> EventArrays:
        """The same for some of the cases."""
        return EventArrays(*(getattr(self, one.name)[..., cases] for one in fields(self)))

    def put(self, cases: Cases, part: EventArrays) -> None:
        """Write what happened to some of the cases (k,)."""
        for one in fields(self):
            getattr(self, one.name)[..., cases] = getattr(part, one.name)
