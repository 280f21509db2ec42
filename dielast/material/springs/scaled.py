"""Laws whose constants are stresses: the constants include the initial shear modulus, and their ratios are the shape."""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np

from dielast.errors import InputError
from dielast.material.springs.law import SpringLaw
from dielast.numerics.arrays import Floats


class ScaledLaw(SpringLaw):
    """Base of laws with constants in Pa. A law defines `modulus_of`, and the formula of its initial modulus in words.

    A spring of another shear modulus has the same ratios of constants, so that a law may be stated in any unit of stress.
    """

    __slots__ = ()
    modulus_formula: ClassVar[str]
    stresses: ClassVar[tuple[str, ...]]
    """The names of the constants that are stresses."""

    def modulus_of(self) -> Floats:
        """Initial shear modulus in the unit of the constants, with the shape of the constants."""
        raise NotImplementedError

    def initial_modulus(self) -> float | None:
        """The initial shear modulus from the constants, in their unit."""
        return float(self.modulus_of())

    @classmethod
    def of_file(cls, stated: Mapping[str, Any], modulus: float | None) -> Self:
        """The law from its constants; `InputError` if a shear modulus is stated in addition."""
        if modulus is not None:
            message = f'law "{cls.name}" states its modulus by {" and ".join(cls.file_keys())}: leave shear_modulus out'
            raise InputError(message, key="shear_modulus")
        return super().of_file(stated, modulus)

    def of_modulus(self, modulus: float) -> Self:
        """The law with the constants of a spring of this modulus."""
        if modulus == self.initial_modulus():
            return self
        factor = modulus / float(self.modulus_of())
        return self.with_values({name: _times(getattr(self, name), factor) for name in self.stresses})

    def shape(self) -> dict[str, str]:
        """The constants over the shear modulus, and those that are bare numbers."""
        unit = self.of_modulus(1.0)
        return {
            f"{name}/modulus" if name in self.stresses else name: _text(value)
            for name, value in unit.values().items()
            if value is not None
        }

    def _check_modulus(self, *constants: Any) -> None:
        """`InputError` for constants that are not finite, or whose initial modulus is not positive."""
        for value in constants:
            if not np.all(np.isfinite(value)):
                raise InputError(f'law "{self.name}": every constant must be finite')
        modulus = self.modulus_of()
        if not np.all(modulus > 0):
            lowest = float(np.min(modulus))
            raise InputError(
                f"the initial shear modulus {self.modulus_formula} is {lowest:g} Pa: it must be positive; check the signs, or for "
                'a spring that carries nothing write law = "neo-hookean" and shear_modulus = "0 Pa"'
            )


def _times(value: Any, factor: float) -> Any:
    return tuple(entry * factor for entry in value) if isinstance(value, tuple) else value * factor


def _text(value: Any) -> str:
    return ", ".join(f"{entry:g}" for entry in np.atleast_1d(value))
