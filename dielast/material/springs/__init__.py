"""The hyperelastic laws of springs, one module each."""

from dielast.base.registry import Registry
from dielast.material.springs.arruda_boyce import ArrudaBoyce as ArrudaBoyce
from dielast.material.springs.gathered import gathered as gathered
from dielast.material.springs.gent import Gent as Gent
from dielast.material.springs.gent_i2 import GentI2 as GentI2
from dielast.material.springs.law import (
    EQUIBIAXIAL as EQUIBIAXIAL,
    UNIAXIAL as UNIAXIAL,
    CardForm as CardForm,
    SpringLaw as SpringLaw,
    Symmetry as Symmetry,
)
from dielast.material.springs.mooney_rivlin import MooneyRivlin as MooneyRivlin
from dielast.material.springs.neo_hookean import NeoHookean as NeoHookean
from dielast.material.springs.ogden import Ogden as Ogden
from dielast.material.springs.yeoh import Yeoh as Yeoh

SPRINGS: Registry[type[SpringLaw]] = Registry(
    "spring law",
    Gent,
    NeoHookean,
    Yeoh,
    ArrudaBoyce,
    MooneyRivlin,
    Ogden,
    GentI2,
    group="dielast.springs",
    base=SpringLaw,
)
