"""Whether the springs of a material are stable in all modes up to a stretch, whatever mode they were fitted to."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from dielast.io.result import Result
from dielast.material.material import Material
from dielast.material.springs.stable_range import SECOND, stable_range


@dataclass(frozen=True, slots=True)
class Stability(Result):
    """The range of stretches about 1 in which the equilibrium spring and the branches are stable in a `mode`; `furthest` is the
    stretch to check, and `tested` whether a fitted test of this mode reached it.
    """

    mode: str
    lowest: float
    highest: float
    furthest: float
    tested: bool = False

    @property
    def holds(self) -> bool:
        """Whether the springs are stable up to `furthest`."""
        return self.highest >= self.furthest

    @property
    def said(self) -> str:
        """The finding in a sentence."""
        limit = f"in {self.mode} loading at once, the springs lock or become unstable at a stretch of {self.highest:.4g}"
        needed = f"{self.furthest:.4g} is needed"
        if self.tested:
            return f"{limit}; {needed}: a simulation of loading faster than in the tests may end there"
        return f"{limit}; {needed}: to check the law, measure in this mode up to this stretch"


def stabilities(material: Material, furthest: float, tested: Collection[str] = ()) -> tuple[Stability, ...]:
    """The stability in uniaxial, equibiaxial and pure-shear loading, up to the stretch `furthest`.

    `tested` are the modes with a fitted test up to this stretch.
    """
    laws = [material.equilibrium_law] if material.equilibrium_modulus > 0 else []
    if len(material.spectrum):
        laws.append(material.nonequilibrium_law)
    stabilities = []
    for mode in SECOND:
        ranges = [stable_range(law, mode) for law in laws]
        stabilities.append(
            Stability(mode, max(low for low, _ in ranges), min(high for _, high in ranges), furthest, mode in tested)
        )
    return tuple(stabilities)
