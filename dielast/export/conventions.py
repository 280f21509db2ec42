"""What every card shares: the options, the unit systems, and a material made ready for what a code can carry.

Nothing is approximated in silence: what a code cannot carry is an `InputError` that begins with the recipe key to change, or is
allowed by an option and then named in the card.
"""

from __future__ import annotations

import math
import re
import unicodedata
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, Mistakes, Problem, warn
from dielast.material.material import Material
from dielast.material.shift import WLF, Arrhenius, NoShift, ShiftLaw, ShiftTable
from dielast.material.springs import Gent
from dielast.units import ZERO_CELSIUS

Made = TypeVar("Made")

LAW_NAMES: dict[type, str] = {WLF: "wlf", Arrhenius: "arrhenius", ShiftTable: "table", NoShift: "none"}
LARGEST_LOSS = 1e-7  # of the equilibrium modulus, where a code takes one minus the sum of ratios for it


@dataclass(frozen=True, slots=True)
class Units:
    """A consistent system of units: what a number in SI is multiplied by, and the names of the units."""

    stress: float
    density: float
    molar_energy: float
    names: str


UNITS = {
    "SI": Units(1.0, 1.0, 1.0, "m, kg, s, N, Pa"),
    "mm-t-s": Units(1e-6, 1e-12, 1e3, "mm, tonne, s, N, MPa"),
    "mm-N-MPa": Units(1e-6, 1e-12, 1e3, "mm, tonne, s, N, MPa"),
}
HYPERELASTIC = ("gent", "neo-hookean", "yeoh")
MODULI = ("instantaneous", "long-term")
SCALES = ("degC", "K")


@dataclass(frozen=True, slots=True)
class CardOptions:
    """How a card is written; SI, degC.

    units: "SI", "mm-t-s" or "mm-N-MPa" (the same as the second). temperature_scale: "degC" or "K", of the model's temperatures.
    hyperelastic: None keeps the material's springs; "gent", "neo-hookean" or "yeoh" allows what the material is not.
    J_lim: one limit for every spring, for codes that know only one. moduli: "instantaneous" or "long-term", for codes that leave
    the choice. bulk_modulus (Pa) or poisson_ratio (at time zero): for what is compressible; the material itself is not.
    density in kg/m^3. temperature (degC): where a card holds whose code cannot carry the shift law. notes: further lines for the
    card's comments, ASCII.
    """

    units: str = "SI"
    temperature_scale: str = "degC"
    hyperelastic: str | None = None
    J_lim: float | None = None
    moduli: str = "instantaneous"
    bulk_modulus: float | None = None
    poisson_ratio: float | None = None
    density: float | None = None
    temperature: float | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for key, value, known in (
            ("units", self.units, tuple(UNITS)),
            ("temperature_scale", self.temperature_scale, SCALES),
            ("hyperelastic", self.hyperelastic, (*HYPERELASTIC, None)),
            ("moduli", self.moduli, MODULI),
        ):
            if value not in known:
                raise InputError(f'"{value}": one of {", ".join(str(name) for name in known if name)} is needed', argument=key)
        for key, number in (("J_lim", self.J_lim), ("bulk_modulus", self.bulk_modulus), ("density", self.density)):
            if number is not None and not 0 < number < math.inf:
                raise InputError(f"{number:g}: a positive number is needed", argument=key)
        if self.poisson_ratio is not None and not 0 <= self.poisson_ratio < 0.5:
            raise InputError(f"{self.poisson_ratio:g}: at least 0 and below 0.5 is needed", argument="poisson_ratio")
        if self.bulk_modulus is not None and self.poisson_ratio is not None:
            raise InputError("give bulk_modulus or poisson_ratio, not both", argument="bulk_modulus")


@dataclass(frozen=True, slots=True)
class Code:
    """What a code can carry: its springs, its shift laws, how many terms, a material that flows (no equilibrium modulus).

    `separate_limits`: the branches may have a J_lim of their own. `poisson_ratio`: at time zero, where the code must have a bulk
    modulus and none is stated; None where it can be incompressible. `arrhenius_in_kelvin`: Arrhenius' law in
    absolute temperatures only.
    """

    name: str
    laws: tuple[str, ...]
    shifts: tuple[type, ...]
    most_terms: int | None = None
    flows: bool = False
    separate_limits: bool = False
    poisson_ratio: float | None = None
    arrhenius_in_kelvin: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Card:
    """A material as a card states it, in the card's units; temperatures in degC.

    `law` is "neo-hookean", "gent" or "yeoh"; `limits` are J_lim of the equilibrium spring and of the branches. `modulus` and
    `time` are of shape (n,), slowest first. `bulk` is None for an incompressible card.
    """

    name: str
    law: str
    limits: tuple[float, float]
    equilibrium: float
    modulus: NDArray[np.float64]
    time: NDArray[np.float64]
    shift: ShiftLaw
    bulk: float | None
    density: float | None
    notes: tuple[str, ...]

    @property
    def instantaneous(self) -> float:
        """Shear modulus at time zero."""
        return math.fsum((self.equilibrium, *self.modulus.tolist()))

    @property
    def compressibility(self) -> float:
        """2/K, zero for an incompressible card."""
        return 0.0 if self.bulk is None else 2 / self.bulk

    @property
    def ratios(self) -> list[float]:
        """Modulus of every branch over the instantaneous one."""
        return [value / self.instantaneous for value in self.modulus.tolist()]


def prepare(material: Material, code: Code, options: CardOptions) -> Card:
    """The material as `code` can carry it; raises `InputError`, a problem for each option to change, where it cannot."""
    wrong = Mistakes()
    units = UNITS[options.units]
    there = material.spectrum.shear_modulus > 0
    dropped = int(np.count_nonzero(~there))
    modulus, time = material.spectrum.shear_modulus[there], material.spectrum.relaxation_time[there]
    wrong.tried(lambda: _check_branches(material, len(modulus), code))
    spring = wrong.tried(lambda: _spring(material, code, options))
    shifted = wrong.tried(lambda: _shift(material.shift, time, code, options))
    bulk = wrong.tried(lambda: _bulk(material.equilibrium_modulus + float(np.sum(modulus)), code, options))
    wrong.refuse()
    assert spring is not None
    assert shifted is not None
    (law, limits), (shift, time, note) = spring, shifted
    notes = [
        f"Name in dielast: {plain(material.name)}",
        f"Units: {units.names}; moduli are shear moduli unless said otherwise.",
        note,
        *options.notes,
    ]
    if dropped:
        notes.append(f"Left out: branches of zero modulus ({dropped}).")
        warn(f"the cards leave out {dropped} branches of zero modulus")
    notes += _spring_notes(material, law, limits)
    if bulk is not None:
        notes.append("The material is incompressible; the bulk modulus K makes Young's modulus 9 K G/(3 K + G), short of 3 G.")
    notes += [
        "Exact: the linear viscoelastic response. At large strain the code's own convolution of the elastic stress stands in for",
        "the branches' own elastic and viscous stretches (DOI 10.1115/1.4030850).",
        "Not carried: permittivity, electrostatic stress, breakdown field.",
    ]
    return Card(
        name=identifier(material.name),
        law=law,
        limits=limits,
        equilibrium=material.equilibrium_modulus * units.stress,
        modulus=modulus * units.stress,
        time=time,
        shift=shift,
        bulk=None if bulk is None else bulk * units.stress,
        density=None if options.density is None else options.density * units.density,
        notes=tuple(notes),
    )


def ratios_below_one(card: Card, code: Code) -> list[str]:
    """The ratios as they are written; raises `InputError` if one minus their sum no longer gives the equilibrium modulus."""
    written = [number(value) for value in card.ratios]
    rest, wanted = math.fsum((1.0, *(-float(text) for text in written))), card.equilibrium / card.instantaneous
    if abs(rest - wanted) > LARGEST_LOSS * wanted:
        raise InputError(
            f"{code.name} takes one minus the sum of the ratios for the equilibrium modulus, which is only "
            f"{wanted:.2g} of the instantaneous one and would be lost in rounding: keep fewer branches ([truncate] keep)",
            argument="formats",
        )
    return written


def yeoh_series(modulus: float, limit: float) -> tuple[float, float, float]:
    """Yeoh's constants, those of Gent's energy to the third power of I1 - 3."""
    return modulus / 2, modulus / (4 * limit), modulus / (6 * limit**2)


def number(value: float) -> str:
    """15 significant digits, fewer where that would take more than the 20 characters that Abaqus reads."""
    return next(text for digits in range(15, 0, -1) if len(text := f"{value:.{digits}g}") <= 20)


def temperature(value: float, options: CardOptions) -> str:
    """A temperature in degC as a number on the model's scale."""
    return number(value + (ZERO_CELSIUS if options.temperature_scale == "K" else 0.0))


def identifier(name: str) -> str:
    """A name of ASCII letters, digits and underscores that begins with a letter, at most 60 long."""
    text = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    text = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")[:60].rstrip("_")
    return text if text[:1].isalpha() else f"material_{text}".rstrip("_")


def plain(text: str) -> str:
    """Text that no code's comment stumbles over: printable ASCII, no backslash, no double hyphen."""
    shown = "".join(mark if mark.isascii() and mark.isprintable() and mark != "\\" else "?" for mark in text)
    return re.sub(r"-(?=-)", "- ", shown)[:100]


def _check_branches(material: Material, terms: int, code: Code) -> None:
    wrong = Mistakes()
    if terms == 0:
        wrong.append(Problem(f"{code.name}: no branch has a modulus: there is nothing viscoelastic to write", argument="formats"))
    if code.most_terms is not None and terms > code.most_terms:
        wrong.append(
            Problem(
                f"{code.name} takes at most {code.most_terms} Prony terms, the spectrum has {terms}: "
                "fit fewer ([fit] branches), or as many as a window of times needs ([reduce] window)",
                argument="formats",
            )
        )
    if material.equilibrium_modulus == 0 and not code.flows:
        wrong.append(
            Problem(
                f"{code.name} needs an equilibrium modulus above zero (ratios that sum to less than one): "
                "the material flows; if it does not, state fit.equilibrium_modulus",
                argument="formats",
            )
        )
    wrong.refuse()


def _spring(material: Material, code: Code, options: CardOptions) -> tuple[str, tuple[float, float]]:
    limits = []
    for law in (material.equilibrium_law, material.nonequilibrium_law):
        if not isinstance(law, Gent) or np.ndim(law.J_lim):
            raise InputError(f"a card holds Gent springs of one J_lim only, not {type(law).__name__}", argument="formats")
        limits.append(float(law.J_lim))
    limited = min(limits) < math.inf or options.J_lim is not None
    wanted = options.hyperelastic or ("gent" if limited else "neo-hookean")
    if wanted not in code.laws:
        instead = [f'"{law}"' for law in code.laws if law != "gent"] if wanted == "gent" else [f'"{law}"' for law in code.laws]
        raise InputError(
            f'{code.name} has no "{wanted}" law: allow {" or ".join(instead)} instead, '
            "which the card will name as an approximation",
            argument="hyperelastic",
        )
    if wanted == "neo-hookean":
        return wanted, (math.inf, math.inf)
    if not limited:
        raise InputError(f'"{wanted}" needs a J_lim, and the material has none: state J_lim', argument="hyperelastic")
    if options.J_lim is not None:
        return wanted, (options.J_lim, options.J_lim)
    if limits[0] != limits[1] and not code.separate_limits:
        raise InputError(
            f"{code.name} has one J_lim for the equilibrium spring and the branches alike, "
            f'not {limits[0]:g} and {limits[1]:g}: state one, or allow hyperelastic = "neo-hookean"',
            argument="J_lim",
        )
    return wanted, (limits[0], limits[1])


def _spring_notes(material: Material, law: str, limits: tuple[float, float]) -> list[str]:
    own = tuple(
        float(spring.J_lim) for spring in (material.equilibrium_law, material.nonequilibrium_law) if isinstance(spring, Gent)
    )
    both = "J_lim = {:g} (equilibrium) and {:g} (branches)"
    notes = [f"Springs: {law}" + ("." if law == "neo-hookean" else f", {both.format(*limits)}.")]
    if law != "yeoh" and limits == own:
        return notes
    notes.append(f"APPROXIMATION, allowed by the recipe: the material's springs are Gent's with {both.format(*own)}.")
    if law == "neo-hookean":
        notes.append(
            "  A neo-Hookean spring is too soft by the share (I1 - 3)/J_lim of Gent's stiffness: 1 % at I1 - 3 = 0.01 J_lim."
        )
    elif law == "yeoh":
        notes.append(
            "  Yeoh's is the series of Gent's energy to the third power of I1 - 3: too soft by the share ((I1 - 3)/J_lim)^3"
        )
        notes.append("  of Gent's stiffness: 1 % at I1 - 3 = 0.215 J_lim, 10 % at 0.464 J_lim; it has no limit.")
    return notes


def _shift(law: ShiftLaw, time: NDArray[np.float64], code: Code, options: CardOptions) -> tuple[ShiftLaw, NDArray[np.float64], str]:
    if isinstance(law, (*code.shifts, NoShift)):
        there = f"{law.reference_temperature:g} degC"
        if isinstance(law, Arrhenius) and code.arrhenius_in_kelvin and options.temperature_scale != "K":
            raise InputError(
                f'{code.name} takes the Arrhenius law in absolute temperatures only: "K" is needed', argument="temperature_scale"
            )
        if isinstance(law, NoShift):
            return law, time, f"Relaxation times hold at {there}; the material has no shift law."
        return law, time, f"Relaxation times hold at {there}, the reference temperature of the shift law."
    name = LAW_NAMES.get(type(law), type(law).__name__)
    if options.temperature is None:
        raise InputError(
            f'{code.name} has no shift function for the law "{name}": state the one temperature that its card holds for',
            argument="temperature",
        )
    shift_factor = float(10 ** law.log10_shift_factor(options.temperature))
    scaled = time * shift_factor
    if not np.all(np.isfinite(scaled) & (scaled > 0)):
        raise InputError(
            f"{options.temperature:g} degC: the relaxation times are beyond what a number holds", argument="temperature"
        )
    note = f'Relaxation times hold at {options.temperature:g} degC ONLY: {code.name} has no shift function for the law "{name}".'
    return NoShift(options.temperature), scaled, note


def _bulk(shear: float, code: Code, options: CardOptions) -> float | None:
    if options.bulk_modulus is not None:
        if options.bulk_modulus <= 2 / 3 * shear:
            raise InputError(
                f"{options.bulk_modulus:g} Pa with an instantaneous shear modulus of {shear:.4g} Pa makes "
                f"Poisson's ratio negative: more than {2 / 3 * shear:.4g} Pa is needed, for rubbers about 2 GPa",
                argument="bulk_modulus",
            )
        return options.bulk_modulus
    ratio = code.poisson_ratio if options.poisson_ratio is None else options.poisson_ratio
    return None if ratio is None else 2 * shear * (1 + ratio) / (3 * (1 - 2 * ratio))
