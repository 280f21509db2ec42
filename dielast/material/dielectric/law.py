"""What every dielectric law answers: the permittivity of a film."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.material.law import Law


class DielectricLaw(Law):
    """Base of the dielectric laws; a law states `at`."""

    __slots__ = ()

    def brief(self) -> float | DielectricLaw | None:
        """The shortest that `Material` takes for it: a number in F/m for a constant one, None for none at all."""
        return self

    def at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """The permittivity in F/m at temperatures in degC, of the same shape."""
        raise NotImplementedError
