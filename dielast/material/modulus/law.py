"""Base of the laws of moduli over temperature: the factor on the modulus at the reference temperature."""

from __future__ import annotations

from typing import ClassVar

from numpy.typing import ArrayLike

from dielast.material.law import Law
from dielast.numerics.arrays import Floats


class ModulusLaw(Law):
    """Base of the laws; a law defines `factor`."""

    __slots__ = ()
    depends_on_temperature: ClassVar[bool] = True

    def factor(self, temperature: ArrayLike, reference_temperature: float) -> Floats:
        """Modulus over that at `reference_temperature`, at temperatures (any shape), all in degC; `InputError` for a temperature
        at which the law does not hold.
        """
        raise NotImplementedError
