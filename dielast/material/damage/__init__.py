"""The damage laws, one module each."""

from dielast.material.damage.eyring import EyringDamage as EyringDamage
from dielast.material.damage.inverse_power import InversePower as InversePower
from dielast.material.law import DamageLaw as DamageLaw
from dielast.registry import Registry

DAMAGES: Registry[type[DamageLaw]] = Registry("damage law", InversePower, EyringDamage, group="dielast.damage", base=DamageLaw)
