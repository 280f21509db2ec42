"""The ideal dielectric."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.material.law import Constant, DielectricLaw
from dielast.numerics.arrays import Floats
from dielast.units import PERMITTIVITY

VACUUM_PERMITTIVITY = 8.8541878128e-12  # F/m, CODATA 2018


@dataclass(frozen=True, slots=True)
class ConstantPermittivity(DielectricLaw):
    """One `permittivity` in F/m at all temperatures and stretches; a `relative_permittivity` is converted to it."""

    permittivity: float = 0.0
    relative_permittivity: float | None = None

    name: ClassVar = "constant"
    title: ClassVar = "constant permittivity"
    constants: ClassVar = (
        Constant("permittivity", "Absolute permittivity of the ideal dielectric.", PERMITTIVITY, above=0.0, left_out=0.0),
        Constant("relative_permittivity", "Permittivity over that of vacuum; instead of permittivity.", at_least=1.0, needed=False),
    )

    def __post_init__(self) -> None:
        if self.relative_permittivity is not None:
            if self.permittivity:
                raise InputError("state permittivity or relative_permittivity, not both")
            object.__setattr__(self, "permittivity", self.relative_permittivity * VACUUM_PERMITTIVITY)
            object.__setattr__(self, "relative_permittivity", None)

    def brief(self) -> float | None:
        """The number; None if it is 0, which means that none is stated."""
        return self.permittivity or None

    def at(self, temperature: ArrayLike) -> Floats:
        """The permittivity."""
        return np.full(np.shape(temperature), self.permittivity)
