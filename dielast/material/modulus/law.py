"""The base class of laws of moduli over temperature: the factor on the modulus at the reference temperature."""

from __future__ import annotations

from typing import ClassVar

from numpy.typing import ArrayLike

from dielast.material.law import Law
from dielast.numerics.columns import Floats


class ModulusLaw(Law):
    """Base of the laws of moduli over temperature. A law defines `factor`."""

    __slots__ = ()
    depends_on_temperature: ClassVar[bool] = True

    def factor(self, temperature: ArrayLike, reference_temperature: float) -> Floats:
        """Modulus at temperatures (any shape) over that at `reference_temperature`, all in degC.

        Raises `InputError` for a temperature at which there is none.
        """
        raise NotImplementedError
