"""The base class of hyperelastic laws: stress, tangent, energy, domain, and their forms in files and material cards.

The film is an incompressible membrane under plane stress, axes 1 and 2 principal. A spring is described by its squared elastic
stretches, shape (2, ...): A = lambda_1^2 and B = lambda_2^2, with C = 1/(A B) = lambda_3^2. All energies are of unit shear modulus.
"""

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Self

import numpy as np

from dielast.base.errors import InputError
from dielast.material.law import Law
from dielast.numerics.arrays import Cases, Floats


@dataclass(frozen=True, slots=True)
class Symmetry:
    """A symmetry that a load maintains: axis 2 has B = A^`second` and C = A^-`thinning`, I1 = `fronts` A + (3 - `fronts`) C, and
    the flow of a spring is dx_1/dt = `flow` p / (3 tau).
    """

    second: float
    thinning: float
    fronts: int
    flow: int


UNIAXIAL = Symmetry(second=-0.5, thinning=0.5, fronts=1, flow=2)
EQUIBIAXIAL = Symmetry(second=1.0, thinning=2.0, fronts=2, flow=1)


@dataclass(frozen=True, slots=True)
class CardForm:
    """A spring in the form of a finite-element code: the `law`, the shear `modulus`, and the other constants of the law.

    Constants that are stresses are in the unit of the modulus. `exact` is False if the form only approximates the spring; `notes`
    describe the loss, `needs` the constant that the spring lacks for this form.
    """

    law: str
    modulus: float
    constants: Mapping[str, float]
    notes: tuple[str, ...] = ()
    needs: str = ""
    exact: bool = True


class SpringLaw(Law):
    """Base of the hyperelastic laws. A law defines at least `stress`, `tangent` and `energy`.

    The constants of a law are numbers in a material, and arrays (..., n, cases) or (..., n, 1) if `gathered` has joined the laws of
    n springs.
    """

    __slots__ = ()
    takes_modulus: ClassVar[bool] = True
    """Whether a material file states the shear modulus of the equilibrium spring in addition to the constants."""
    always_stable: ClassVar[bool] = False
    """Whether tension increases with stretch in every mode for any values of the constants."""

    def stress(self, squared_stretch: Floats) -> Floats:
        """True stresses (p, q), shape (2, ...), at squared stretches (2, ...); not finite outside the law's domain."""
        raise NotImplementedError

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """Stresses (2, ...), and their derivatives in ln A and ln B: dp/dlnA, dp/dlnB = dq/dlnA, dq/dlnB, shape (3, ...).

        These are half the derivatives K11, K12, K22 in the logarithmic stretches.
        """
        raise NotImplementedError

    def energy(self, squared_stretch: Floats) -> Floats:
        """Strain energy per undeformed volume over the shear modulus, shape (...); infinite outside the law's domain."""
        raise NotImplementedError

    def margin(self, squared_stretch: Floats) -> Floats:
        """The distance (...) of the stretches from the limit of the law's domain: 1 at rest, 0 at the limit, negative beyond.

        It is 1 everywhere for a law that holds at every stretch.
        """
        return np.ones(np.shape(squared_stretch)[1:])

    def axial_stress(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> Floats:
        """p (...) under a symmetry, at A = `front` and C = `thickness`, both of which may be overwritten."""
        first: Floats = self.stress(np.stack((front, front**symmetry.second)))[0]
        return first

    def axial_tangent(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> tuple[Floats, Floats]:
        """p and dp/dlnA (...) under a symmetry, at A = `front` and C = `thickness`, both of which may be overwritten."""
        stress, half = self.tangent(np.stack((front, front**symmetry.second)))
        return stress[0], half[0] + symmetry.second * half[1]

    def equibiaxial_tangent(self, front: Floats) -> tuple[Floats, Floats]:
        """dp/dlnA - dp/dlnB and dp/dlnB (...) where both axes have A = `front`, which may be overwritten."""
        _, half = self.tangent(np.stack((front, front)))
        return half[0] - half[1], half[1]

    def describe_limit(self) -> str:
        """The limit of the law, in words that follow "is beyond"."""
        return f"the end of the {self.title} law"

    def warning(self, whose: str) -> str:
        """A warning of implausible constants, or an empty text; `whose` names the spring."""
        return ""

    def unlimited(self) -> Self:
        """The same law without a limit of its domain, for a spring that carries no stress."""
        return self

    def initial_modulus(self) -> float | None:
        """The shear modulus from the constants, in their unit; None if the constants state only a shape."""
        return None

    @classmethod
    def of_file(cls, stated: Mapping[str, Any], modulus: float | None) -> Self:
        """The law from its constants (SI) by their keys in a material file, and the shear `modulus` in Pa stated there, or None.

        Raises `InputError` for constants that are missing, invalid or of another law.
        """
        return cls(**cls.arguments(stated))

    @classmethod
    def beside_modulus(cls) -> tuple[str, ...]:
        """The keys of the constants that a material file states beside the shear modulus, if it takes one."""
        return tuple(constant.file_key for constant in cls.constants if constant.needed)

    def of_modulus(self, modulus: float) -> Self:
        """The law of a spring of this shear modulus in Pa, which constants that are stresses state."""
        return self

    def in_file(self, modulus: float) -> dict[str, Any]:
        """The constants by their keys in a material file, for the equilibrium spring of this shear `modulus` in Pa."""
        return {key: value for key, value in self.of_modulus(modulus).stated().items() if key in self.beside_modulus()}

    def shape(self) -> dict[str, str]:
        """The constants as text by name; those that are stresses are divided by the shear modulus."""
        return {name: f"{value:g}" for name, value in self.values().items()}

    def forms(self, modulus: float = 1.0) -> tuple[CardForm, ...]:
        """The spring of a shear `modulus` in the laws of finite-element codes that can represent it, the closest law first."""
        return ()

    def form(self, law: str, modulus: float = 1.0) -> CardForm | None:
        """The spring of a shear `modulus` as the `law` of a finite-element code; None if that law cannot represent it."""
        return next((form for form in self.forms(modulus) if form.law == law), None)

    def arrays(self) -> dict[str, Floats]:
        """The constants that are arrays (..., n, cases) or (..., n, 1) of several springs, by name."""
        return {name: value for name, value in self.values().items() if np.ndim(value) >= 2}

    def take(self, cases: Cases) -> Self:
        """The law for the selected cases (k,), with arrays (..., n, k): a product with an array (..., n, 1) takes longer."""
        if not self.arrays():
            return self
        law, first = copy(self), np.zeros_like(cases)
        for name in (known.name for known in fields(self)):  # type: ignore[arg-type]
            value = getattr(self, name)
            if np.ndim(value) >= 2:  # a constant, or what the law computes from it
                object.__setattr__(law, name, value.take(cases if value.shape[-1] > 1 else first, axis=-1))
        return law

    def apart(self, springs: int, cases: int) -> Self:
        """The law of `springs` springs in `cases` cases as that of single springs in springs times cases cases, spring after
        spring.
        """
        law = copy(self)
        for name in (known.name for known in fields(self)):  # type: ignore[arg-type]
            value = getattr(self, name)
            if np.ndim(value) >= 2:
                wide = np.broadcast_to(value, (*value.shape[:-2], springs, cases))
                object.__setattr__(law, name, wide.reshape(*value.shape[:-2], 1, springs * cases))
        return law

    def of_spring(self, spring: int, case: int) -> Self:
        """The law of one spring in one case."""
        of_one = {
            name: value[..., min(spring, value.shape[-2] - 1), min(case, value.shape[-1] - 1)]
            for name, value in self.arrays().items()
        }
        return self.with_values({name: value if np.ndim(value) else float(value) for name, value in of_one.items()})

    def with_idle_spring(self) -> Self:
        """The law of n + 1 springs, the last of which has no limit of its domain."""
        idle = self.of_spring(0, 0).unlimited().values()
        several = {name: value for name, value in self.arrays().items() if value.shape[-2] > 1}
        last = {name: np.asarray(idle[name])[..., None, None] + np.zeros_like(value[..., :1, :]) for name, value in several.items()}
        return self.with_values({name: np.concatenate((value, last[name]), axis=-2) for name, value in several.items()})


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
