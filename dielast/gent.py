"""The Gent spring under plane stress, through-thickness stress eliminated (incompressible)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Gent:
    """Gent's law for a spring of unit shear modulus; `J_lim` to infinity is neo-Hookean."""

    J_lim: float = float("inf")
