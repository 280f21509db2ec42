"""Whether the springs of a material are stable in every mode as far as is asked for, whatever they were fitted to."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from dielast.io.result import Result
from dielast.material.material import Material
from dielast.material.springs.stable_range import SECOND, stable_range


@dataclass(frozen=True, slots=True)
class Stability(Result):
    """The stretches about 1 between which the equilibrium spring and the branches are stable in a `mode`; `furthest` is that asked
    for, and `tested` whether a fitted test of this mode went so far.
    """

    mode: str
    lowest: float
    highest: float
    furthest: float
    tested: bool = False

    @property
    def holds(self) -> bool:
        """Whether the springs are stable as far as is asked for."""
        return self.highest >= self.furthest

    @property
    def said(self) -> str:
        """The finding in a sentence."""
        found = f"stretched at once in {self.mode} loading, the springs end or are unstable at {self.highest:.4g}"
        asked = f"{self.furthest:.4g} is asked for"
        if self.tested:
            return f"{found}; {asked}: loading that is faster than in the tests may end there"
        return f"{found}; {asked}: tests as far as that in this mode would tell whether the law is wrong there"


def stabilities(material: Material, furthest: float, tested: Collection[str] = ()) -> tuple[Stability, ...]:
    """The stability in uniaxial, equibiaxial and pure-shear loading, up to the stretch `furthest`.

    `tested` are the modes in which a fitted test went so far.
    """
    laws = [material.equilibrium_law] if material.equilibrium_modulus > 0 else []
    if len(material.spectrum):
        laws.append(material.nonequilibrium_law)
    found = []
    for mode in SECOND:
        ranges = [stable_range(law, mode) for law in laws]
        found.append(Stability(mode, max(low for low, _ in ranges), min(high for _, high in ranges), furthest, mode in tested))
    return tuple(found)
