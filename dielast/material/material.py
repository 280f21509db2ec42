"""A dielectric elastomer: an equilibrium spring, relaxation processes, a shift law, a dielectric.

Calibration and tables of draws change a material by its numbers, by section and key of its file, without knowledge of its laws.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.units import STRESS, TIME
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.material.breakdown import Breakdown as Breakdown, BreakdownLaw
from dielast.material.damage import DamageLaw
from dielast.material.dielectric import VACUUM_PERMITTIVITY as VACUUM_PERMITTIVITY, ConstantPermittivity, DielectricLaw
from dielast.material.flow import LINEAR_FLOW
from dielast.material.law import Constant, FlowLaw, Law
from dielast.material.modulus import CONSTANT_MODULUS, ModulusLaw
from dielast.material.shift import ShiftLaw
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent, SpringLaw
from dielast.numerics.arrays import Floats

NEO_HOOKEAN = Gent()

Numbers = dict[str, dict[str, Any]]
"""Values in SI, each a number or a list of numbers, by section and key."""

SCALE = "scale"
"""The key of a common factor on the moduli of all branches."""
MODULUS = Constant("shear_modulus", "Initial shear modulus.", STRESS, above=0.0)
OF_BRANCHES = (
    Constant("shear_modulus", "Shear moduli of all branches.", STRESS, above=0.0, many=True),
    Constant("relaxation_time", "Relaxation times of all branches.", TIME, above=0.0, many=True),
    Constant(SCALE, "Common factor on the moduli of all branches.", above=0.0),
)


@dataclass(frozen=True, slots=True)
class CalibratedRange(Result):
    """The range of the tests to which a material was fitted: `modes` of loading, the largest first invariant I1 of the stretches,
    the shortest and longest `time` in s, and the lowest and highest `temperature` in degC.
    """

    modes: tuple[str, ...]
    largest_invariant: float
    time: tuple[float, float]
    temperature: tuple[float, float]
    law_spread: float | None = None
    """The largest ratio between laws that these tests cannot tell apart of the voltage of an equibiaxial film; None if no others
    were tried.
    """
    specimen_scatter: float | None = None
    """Standard deviation of the logarithm of the factor of a specimen on its stress; None if unknown."""
    model_error: float | None = None
    """Standard deviation of the error of the model along a curve, over the level of the stress; None if unknown."""
    scatter_freedom: float | None = None
    """Degrees of freedom of both together; None if they are known exactly."""
    undetermined: tuple[str, ...] = ()
    """Paths of the constants that the tests do not determine, in the order in which the draws divide their ranges into strata."""


@dataclass(frozen=True, slots=True)
class Window(Result):
    """The shortest and the longest reduced `time` in s of the curve that a spectrum was fitted to, and whether the curve had
    reached its plateau.
    """

    time: tuple[float, float]
    plateau_reached: bool


@checked
@dataclass(frozen=True, slots=True, repr=False)
class Material(Result):
    """A viscoelastic dielectric elastomer; SI units, temperatures in degC.

    `equilibrium_modulus` is the shear modulus mu_eq in Pa of the spring `equilibrium_law`; `spectrum` holds the relaxation
    processes at the reference temperature, each with the spring `nonequilibrium_law`; `permittivity` is a
    number in F/m or the law of a dielectric.
    `measured_temperature` is the range in which the shift factors were measured, None if unknown. The moduli hold at the reference
    temperature; `equilibrium_scaling` and `nonequilibrium_scaling` say how those of the equilibrium spring and of the branches
    change with temperature. `breakdown` and `damage` are criteria of electrical failure, None for none. `calibrated` is the range
    of the tests that the material was fitted to, None if it was not fitted. `origin` says of constants, by their paths such as
    "equilibrium.shear_modulus", where they are from: "stated", "measured", or "fitted: " with the names of the tests.
    `flow` is the law by which branches flow under stress.
    `window` holds the times at which the relaxation was measured, None if unknown; where that was too short for the plateau,
    `equilibrium_range` are the bounds of mu_eq in Pa. `density` is in kg/m^3, None if unknown.
    """

    name: str
    equilibrium_modulus: float
    spectrum: Spectrum
    shift: ShiftLaw
    equilibrium_law: SpringLaw = NEO_HOOKEAN
    nonequilibrium_law: SpringLaw = NEO_HOOKEAN
    permittivity: float | DielectricLaw | None = None
    breakdown: BreakdownLaw | None = None
    measured_temperature: tuple[float, float] | None = None
    damage: DamageLaw | None = None
    equilibrium_scaling: ModulusLaw = CONSTANT_MODULUS
    nonequilibrium_scaling: ModulusLaw = CONSTANT_MODULUS
    calibrated: CalibratedRange | None = None
    flow: FlowLaw = LINEAR_FLOW
    origin: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    window: Window | None = None
    equilibrium_range: tuple[float, float] | None = None
    density: float | None = None

    @property
    def reference_temperature(self) -> float:
        """Temperature in degC at which the spectrum holds."""
        return self.shift.reference_temperature

    @property
    def dielectric(self) -> DielectricLaw | None:
        """The law of the permittivity; None if none is stated."""
        if not self.permittivity:
            return None
        return self.permittivity if isinstance(self.permittivity, DielectricLaw) else ConstantPermittivity(self.permittivity)

    def relaxation_time(self, temperature: ArrayLike) -> Floats:
        """Relaxation times in s at `temperature` (degC) of any shape; the branches are a new last axis.

        Raises `InputError` at temperatures at which the shift law does not hold.
        """
        shift_factor = 10 ** self.shift.log10_shift_factor(temperature)
        return np.asarray(shift_factor[..., None] * self.spectrum.relaxation_time)


def numbers_of(material: Material) -> Numbers:
    """All numbers of a material that may be varied, by section and key of its file."""
    modulus, spring = material.equilibrium_modulus, material.equilibrium_law
    others = {key: value for key, value in spring.of_modulus(modulus).numbers().items() if key in spring.beside_modulus()}
    numbers: Numbers = {
        "equilibrium": {**({"shear_modulus": modulus} if spring.takes_modulus else {}), **others},
        "nonequilibrium": {
            "shear_modulus": material.spectrum.shear_modulus.tolist(),
            "relaxation_time": material.spectrum.relaxation_time.tolist(),
            SCALE: 1.0,
            **material.nonequilibrium_law.numbers(),
        },
    }
    return numbers | {section: law.numbers() for section, law in _laws(material).items()}


def paths_of(material: Material) -> list[str]:
    """The paths of all constants that a material states; a list of branches has one path."""
    known = {section: group.items() for section, group in numbers_of(material).items()}
    finite = [(section, key) for section, group in known.items() for key, value in group if _is_stated(key, value)]
    return [f"{section}.{key}" for section, key in finite]


def _is_stated(key: str, value: Any) -> bool:
    return key != SCALE and value is not None and np.size(value) > 0 and bool(np.all(np.isfinite(np.asarray(value, dtype=float))))


def constants_of(material: Material) -> dict[str, dict[str, Constant]]:
    """The constants that the numbers are values of, by section and key."""
    spring = material.equilibrium_law
    constants = {
        "equilibrium": (*([MODULUS] if spring.takes_modulus else []), *spring.constants),
        "nonequilibrium": (*OF_BRANCHES, *material.nonequilibrium_law.constants),
        **{section: law.constants for section, law in _laws(material).items()},
    }
    return {section: {constant.file_key: constant for constant in group} for section, group in constants.items()}


def material_of(material: Material, numbers: Mapping[str, Mapping[str, Any]]) -> Material:
    """The material with other numbers, those of both springs among them; the laws of other sections stay as they are unless they
    have numbers. Raises `InputError` for numbers that its laws do not allow.
    """
    equilibrium, branches = dict(numbers["equilibrium"]), dict(numbers["nonequilibrium"])
    modulus = equilibrium.pop("shear_modulus", None)
    spring = type(material.equilibrium_law).of_file(equilibrium, modulus)
    moduli, times, factor = (branches.pop(key) for key in ("shear_modulus", "relaxation_time", SCALE))
    changed: dict[str, Any] = {
        "equilibrium_modulus": spring.initial_modulus() if modulus is None else modulus,
        "equilibrium_law": spring,
        "spectrum": Spectrum(np.asarray(times, dtype=float), factor * np.asarray(moduli, dtype=float)),
        "nonequilibrium_law": type(material.nonequilibrium_law).of_file(branches, None),
    }
    for section, law in _laws(material).items():
        if section not in numbers:
            continue
        place = (material.reference_temperature,) if section == "shift" else ()
        made = type(law)(*place, **law.arguments(numbers[section]))
        changed["permittivity" if section == "dielectric" else section] = made
    return replace(material, **changed)


def _laws(material: Material) -> dict[str, Law]:
    """The laws of a material other than the springs, by section."""
    laws = {
        "shift": material.shift,
        "flow": material.flow,
        "dielectric": material.dielectric,
        "breakdown": material.breakdown,
        "damage": material.damage,
    }
    return {section: law for section, law in laws.items() if law is not None}


def materials_of(material: Material | Sequence[Material]) -> list[Material]:
    """One material for all cases, or those of the cases, as a list."""
    return [material] if isinstance(material, Material) else list(material)
