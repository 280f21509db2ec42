"""The damage laws, one module each."""

from __future__ import annotations

from dielast.material.damage.inverse_power import InversePower
from dielast.material.law import DamageLaw, Registry

__all__ = ["DAMAGES", "DamageLaw", "InversePower"]

DAMAGES: Registry[type[DamageLaw]] = Registry("damage law", InversePower)
