"""Prony series in the cards of finite-element codes, and in tables, read as a material.

A card has no units: a system of units is stated beside it. g_i are moduli over the instantaneous modulus, for either choice of the
elastic moduli (Abaqus: MODULI=LONG TERM, the default, or INSTANTANEOUS; ANSYS: instantaneous). The springs are incompressible.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dielast.base.errors import InputError, shown, warn
from dielast.base.units import NUMBER, TIME
from dielast.handover.export.code import UNITS, Units
from dielast.io.cells import TextFormat, decode
from dielast.io.table import as_number
from dielast.io.text_table import read_measured
from dielast.material.material import NEO_HOOKEAN, Material
from dielast.material.shift import GAS_CONSTANT, WLF, Arrhenius, NoShift, ShiftLaw, kelvin
from dielast.material.spectrum import Spectrum
from dielast.material.springs import SPRINGS, ArrudaBoyce, Gent, Ogden, SpringLaw

FLOWS = 1e-9  # of the instantaneous modulus: a smaller equilibrium modulus is rounding of the g_i
REFERENCE = 20.0  # degC, of a material without a shift law, which has the same times at every temperature


@dataclass(frozen=True, slots=True)
class PronyCard:
    """The series `g` (n,) with times `tau` (n,) in s; the shear `modulus` in Pa and the `law` of the spring, None if the card has
    none, and whether they are `long_term` rather than instantaneous; and the `shift` law.
    """

    g: tuple[float, ...]
    tau: tuple[float, ...]
    modulus: float | None = None
    law: SpringLaw = NEO_HOOKEAN
    long_term: bool = False
    shift: ShiftLaw | None = None
    name: str = "unnamed"
    left_out: tuple[str, ...] = field(default=())

    def material(self, instantaneous: float | None = None, equilibrium: float | None = None) -> Material:
        """The material; the shear modulus in Pa is that of the card, or else stated. Raises `InputError` without one modulus."""
        rest = 1 - float(np.sum(self.g))
        if min((*self.g, *self.tau), default=0) < 0 or min(self.tau, default=1) == 0 or rest < -1e-6:
            raise InputError(f"g_i from 0 on with a sum of at most 1, and positive times, are needed; the sum is {1 - rest:.9g}")
        rest = 0.0 if rest < FLOWS else rest
        stated = [value for value in (self.modulus, instantaneous, equilibrium) if value is not None]
        if len(stated) != 1:
            both = "one modulus is needed: state fit.glassy_modulus (Young's, instantaneous) or fit.equilibrium_modulus"
            raise InputError(
                both if not stated else "the modulus is in the card: leave fit.glassy_modulus and equilibrium_modulus out"
            )
        at_rest = equilibrium is not None or (self.modulus is not None and self.long_term)
        if at_rest and not rest:
            raise InputError("the g_i add up to 1, and leave no long-term modulus: an instantaneous one is needed")
        whole = stated[0] / rest if at_rest else stated[0]
        return Material(
            name=self.name,
            equilibrium_modulus=rest * whole,
            spectrum=Spectrum(np.array(self.tau), whole * np.array(self.g)),
            shift=self.shift or NoShift(REFERENCE),
            equilibrium_law=self.law.of_modulus(rest * whole),
            nonequilibrium_law=self.law,
        )


def read_prony(content: bytes, source: str, units: str | None, temperature_scale: str | None = None) -> PronyCard:
    """The Prony series in the bytes of a card of Abaqus or ANSYS, or of a table of g_i and tau_i.

    A card is in a system of `units`, with temperatures in degC or K.

    Raises `InputError` naming the file and what is missing.
    """
    text = decode(content, source)
    upper = text.upper()
    reader = _abaqus if re.search(r"^\s*\*VISCOELASTIC", upper, re.MULTILINE) else None
    reader = reader or (_ansys if re.search(r"^\s*TB\s*,\s*PRON", upper, re.MULTILINE) else None)
    if reader is None:
        return _table(content, source)
    if units is None:
        raise InputError(
            f"a card does not state its units: state prony_units, one of {', '.join(map(shown, UNITS))}", key="prony_units"
        )
    try:
        card = reader(text, UNITS[units], temperature_scale)
    except InputError as error:
        raise error.at(file=source) from None
    if card.left_out:
        warn(f"{', '.join(card.left_out)} of the card: not read", file=source)
    return card


def _table(content: bytes, source: str) -> PronyCard:
    """A table with columns g (or g_i) and tau (or tau_i) with its unit."""
    table = read_measured(content, source, TextFormat(), {})
    names = {re.sub(r"[_ ]?(i|k|n)$", "", name.strip().casefold()): name for name in table.names}
    found = {role: next((names[name] for name in known if name in names), None) for role, known in _ROLES.items()}
    if missing := [role for role, name in found.items() if name is None]:
        there = ", ".join(map(shown, table.names))
        raise InputError(
            f"no column {' and '.join(missing)}; there are {there}: a card of Abaqus or ANSYS, or g and tau [s], is needed",
            file=source,
        )
    g, tau = (table.column(str(found[role]), role, dimension) for role, dimension in (("g", NUMBER), ("tau", TIME)))
    return PronyCard(tuple(g.tolist()), tuple(tau.tolist()))


_ROLES: Mapping[str, Sequence[str]] = {"g": ("g", "rel_mod", "alpha"), "tau": ("tau", "relaxation_time", "rel_time", "time")}


def _celsius(temperature: float, scale: str | None) -> float:
    """A temperature of a card, in degC; raises `InputError` without a scale."""
    if scale is None:
        raise InputError(
            f"a card does not say whether {temperature:g} is in degC or K: state prony_temperature_scale",
            key="prony_temperature_scale",
        )
    return temperature - (kelvin(0.0) if scale == "K" else 0.0)


def _shift_of(law: str, values: Sequence[float], per_mole: float, scale: str | None) -> ShiftLaw | None:
    """The shift law of a card from its reference temperature and its constants; None if it is not among dielast's.

    `per_mole` turns the constant of the Arrhenius law into J/mol.
    """
    if not np.all(np.isfinite([*values, per_mole])):
        raise InputError("the constants of the shift law: numbers are needed")
    if law == "WLF" and len(values) == 3:  # C1 and C2 are those of the decimal logarithm in both codes
        return WLF(_celsius(values[0], scale), values[1], values[2])
    if law == "ARRHENIUS" and len(values) == 2:
        return Arrhenius(_celsius(values[0], scale), per_mole * values[1])
    return None


def _abaqus(text: str, units: Units, scale: str | None) -> PronyCard:
    """*VISCOELASTIC, TIME=PRONY with *HYPERELASTIC or *ELASTIC, and *TRS."""
    blocks: list[tuple[str, dict[str, str], list[float]]] = []
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("**")]
    for line in re.sub(r",\s*\n(?=\s*[A-Za-z])", ",", "\n".join(lines)).splitlines():  # a keyword goes on after a comma
        if line.lstrip().startswith("*"):
            keyword, *options = (part.strip() for part in line.strip().lstrip("*").split(","))
            pairs = [option.partition("=") for option in options]
            blocks.append((keyword.upper(), {key.strip().upper(): value.strip() for key, _, value in pairs}, []))
        elif blocks:
            cells = line.split(",")
            if blocks[-1][0] == "VISCOELASTIC":  # k_i may be left empty
                numbers = [as_number(cell.strip() or "0") for cell in (*cells, "", "")[:3]]
            else:
                numbers = [as_number(cell.strip()) for cell in cells if cell.strip()]
            blocks[-1][2].extend(numbers)
    series = [block for block in blocks if block[0] == "VISCOELASTIC"]
    if len(series) != 1:
        raise InputError(f"{len(series)} *VISCOELASTIC: a card of one material is needed")
    if series[0][1].get("TIME", "").upper() != "PRONY":
        raise InputError("*VISCOELASTIC without TIME=PRONY: the coefficients g_i, k_i, tau_i are needed")
    rows = np.array(series[0][2]).reshape(-1, 3)
    springs = [block for block in blocks if block[0] in ("HYPERELASTIC", "ELASTIC")]
    trs = next((block for block in blocks if block[0] == "TRS"), None)
    physical = next((block[1] for block in blocks if block[0] == "PHYSICAL CONSTANTS"), {})
    if "ABSOLUTE ZERO" in physical:
        zero = as_number(physical["ABSOLUTE ZERO"])
        scale = "K" if zero == 0 else "degC" if abs(zero + kelvin(0.0)) < 1 else scale
    gas = as_number(physical.get("UNIVERSAL GAS CONSTANT", str(GAS_CONSTANT * units.molar_energy)))
    if not gas > 0:
        raise InputError("*PHYSICAL CONSTANTS: UNIVERSAL GAS CONSTANT above 0 is needed")
    shift = None if trs is None else _shift_of(trs[1].get("DEFINITION", "WLF").upper(), trs[2], GAS_CONSTANT / gas, scale)
    known = ["MATERIAL", "DENSITY", "VISCOELASTIC", "HYPERELASTIC", "ELASTIC", "HEADING", "PHYSICAL CONSTANTS"]
    known += ["TRS"] * (shift is not None)
    left_out = [f"*{block[0]}" for block in blocks if block[0] not in known]
    left_out += ["the relaxation of the bulk modulus (k_i)"] * bool(np.any(rows[:, 1]))
    name = next((block[1]["NAME"] for block in blocks if block[0] == "MATERIAL" and "NAME" in block[1]), "unnamed")
    card = PronyCard(
        tuple(rows[:, 0].tolist()),
        tuple(rows[:, 2].tolist()),
        shift=shift,
        name=name,
        left_out=tuple(left_out),
    )
    if not springs:
        return card
    kind, stated, values = springs[0]
    long_term = stated.get("MODULI", "LONG TERM").upper() != "INSTANTANEOUS"
    law: SpringLaw = NEO_HOOKEAN
    if kind == "ELASTIC":
        modulus = values[0] / (2 * (1 + values[1]))
    else:
        terms = int(stated.get("N", "1"))
        form = next((form for form in _ABAQUS if form in stated), None)
        if form is None or (form == "REDUCED POLYNOMIAL" and terms not in (1, 3)) or (form == "POLYNOMIAL" and terms != 1):
            raise InputError(f"*HYPERELASTIC {', '.join(stated)}: one of {', '.join(_ABAQUS)} is needed")
        modulus, law = _spring(_ABAQUS[form] if terms == 1 or form != "REDUCED POLYNOMIAL" else "yeoh", values, terms)
    return replace(card, modulus=modulus / units.stress, law=_in_pascal(law, units.stress), long_term=long_term)


_ABAQUS = {
    **{"NEO HOOKE": "C10", "REDUCED POLYNOMIAL": "C10", "YEOH": "yeoh", "MOONEY-RIVLIN": "mooney-rivlin"},
    **{"POLYNOMIAL": "mooney-rivlin", "ARRUDA-BOYCE": "arruda-boyce", "OGDEN": "ogden-abaqus"},
}
_ANSYS = {
    **{"NEO": "neo-hookean", "GENT": "gent", "YEOH": "yeoh", "BOYCE": "arruda-boyce", "MOONEY": "mooney-rivlin"},
    "OGDEN": "ogden",
}


def _spring(form: str, values: Sequence[float], terms: int) -> tuple[float, SpringLaw]:
    """The initial shear modulus and the law of a spring from its constants in the card, in the unit of the card."""
    if form == "C10":
        return 2 * values[0], NEO_HOOKEAN
    if form in ("neo-hookean", "gent"):
        return values[0], NEO_HOOKEAN if form == "neo-hookean" else Gent(values[1])
    if form == "arruda-boyce":
        # the card's mu is not the initial modulus: the series of W at rest, as the codes have it
        unit = ArrudaBoyce(values[1])
        converted = unit.form("arruda-boyce")
        assert converted is not None
        return values[0] / converted.constants["mu"], unit
    if form.startswith("ogden"):
        first, second = values[: 2 * terms : 2], values[1 : 2 * terms : 2]
        # Abaqus: W = sum 2 mu_i/alpha_i^2 (...), ANSYS: W = sum mu_i/alpha_i (...)
        mu = [2 * m / a if form == "ogden-abaqus" else m for m, a in zip(first, second, strict=True)]
        law: SpringLaw = Ogden.of_file({"mu": tuple(mu), "alpha": tuple(second)}, None)
        modulus = law.initial_modulus()
        assert modulus is not None
        return modulus, law
    keys = ("C10", "C20", "C30") if form == "yeoh" else ("C10", "C01")
    modulus = 2 * values[0] if form == "yeoh" else 2 * (values[0] + values[1])
    return modulus, SPRINGS[form].of_file(dict(zip(keys, values, strict=False)), None)


def _in_pascal(law: SpringLaw, stress: float) -> SpringLaw:
    modulus = law.initial_modulus()
    return law if modulus is None else law.of_modulus(modulus / stress)


def _ansys(text: str, units: Units, scale: str | None) -> PronyCard:
    """TB,PRONY,,,,SHEAR with TB,HYPER or MP,EX and MP,NUXY, and TB,SHIFT; values of TBDATA at their places."""
    tables: list[tuple[str, list[str], dict[int, float]]] = []
    elastic: dict[str, float] = {}
    for line in text.splitlines():
        words = [word.strip() for word in line.partition("!")[0].split(",")]
        command = words[0].upper()
        if command == "TB":
            tables.append((words[1].upper()[:4], [word.upper() for word in words[2:]], {}))
        elif command == "TBDATA" and tables:
            first = int(words[1] or "1")
            tables[-1][2].update({first + k: as_number(word) for k, word in enumerate(words[2:]) if word})
        elif command == "MP" and words[1].upper() in ("EX", "NUXY", "PRXY"):
            elastic[words[1].upper()] = as_number(words[3])
    shear = [table for table in tables if table[0] == "PRON" and not "".join(table[1][3:4]).startswith("BULK")]
    if len(shear) != 1:
        raise InputError(f"{len(shear)} TB,PRONY,,,,SHEAR: a card of one material is needed")
    values = [shear[0][2].get(k, 0.0) for k in range(1, 1 + 2 * (max(shear[0][2], default=0) // 2))]
    shifts = ((options[3] if len(options) > 3 else "", data) for name, options, data in tables if name == "SHIF")
    definition, data = next(shifts, ("", {}))
    if definition == "TN":  # Tool and Narayanaswamy's law: H/R in K, and temperatures in K only
        definition, scale = "ARRHENIUS", "K"
    shift = _shift_of(definition, [data[k] for k in sorted(data)], GAS_CONSTANT, scale)
    known_tables = ("PRON", "HYPE") if shift is None else ("PRON", "HYPE", "SHIF")
    left_out = [f"TB,{name}" for name, options, _ in tables if name not in known_tables]
    left_out += ["TB,PRONY,,,,BULK"] * (sum(name == "PRON" for name, _, _ in tables) - 1)
    card = PronyCard(tuple(values[::2]), tuple(values[1::2]), shift=shift, left_out=tuple(left_out))
    hyper = [table for table in tables if table[0] == "HYPE"]
    if hyper:
        _, options, data = hyper[0]
        form, count = options[3] if len(options) > 3 else "", max(data, default=0)
        known = next((law for key, law in _ANSYS.items() if form.startswith(key[:4])), None)
        if known is None:
            raise InputError(f"TB,HYPER,,,,{form}: one of {', '.join(_ANSYS)} is needed")
        terms = int(options[2] or "1") if known == "ogden" else 1
        modulus, law = _spring(known, [data.get(k, 0.0) for k in range(1, count + 1)], terms)
        return replace(card, modulus=modulus / units.stress, law=_in_pascal(law, units.stress))
    if "EX" in elastic:
        ratio = elastic.get("NUXY", elastic.get("PRXY", 0.5))
        return replace(card, modulus=elastic["EX"] / (2 * (1 + ratio)) / units.stress)
    return card
