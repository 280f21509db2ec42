"""The draws of a material: a table beside the material file, one draw a row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError
from dielast.handover.material_file import draws_file, parse_material
from dielast.handover.tables import finite_columns
from dielast.io.files import EXAMPLE, read_file, resolve
from dielast.io.table import Column, Table
from dielast.material.material import Material
from dielast.material.shift import WLF, Arrhenius, ShiftLaw, ShiftTable
from dielast.material.spectrum import Spectrum

EQUILIBRIUM = "equilibrium_shear_modulus"


def draw_columns(number: NDArray[np.int64], materials: Sequence[Material]) -> Table:
    """The table of draws of one material, which share their number of branches; `number` (draws,) says which draw each is."""
    laws = [_constants(each.shift) for each in materials]
    moduli = np.array([each.spectrum.shear_modulus for each in materials])
    times = np.array([each.spectrum.relaxation_time for each in materials])
    return [
        Column("draw", None, number),
        Column(EQUILIBRIUM, "Pa", np.array([each.equilibrium_modulus for each in materials])),
        *(Column(name, unit, np.array([law[name, unit] for law in laws])) for name, unit in laws[0]),
        *(Column(f"shear_modulus_{k + 1}", "Pa", column) for k, column in enumerate(moduli.T)),
        *(Column(f"relaxation_time_{k + 1}", "s", column) for k, column in enumerate(times.T)),
    ]


def parse_draws(content: bytes, source: str, material: Material) -> tuple[Material, ...]:
    """The draws of `material` in the bytes of their table; raises `InputError` if they are not of this material.

    A table without relaxation times takes those of the material.
    """
    law = constant_headers(material.shift)
    count = len(material.spectrum)
    first_line = content.split(b"\n", 1)[0].decode(errors="replace")
    if f",shear_modulus_{count + 1} [Pa]" in first_line:
        raise InputError(f"{source}: draws of more than the material's {count} branches: make both anew")
    headers = [f"{EQUILIBRIUM} [Pa]", *law, *(f"shear_modulus_{k + 1} [Pa]" for k in range(count))]
    if ",relaxation_time_1 [s]" in first_line:
        headers += [f"relaxation_time_{k + 1} [s]" for k in range(count)]
    columns = finite_columns(content, source, headers)
    if not columns.size:
        raise InputError(f"{source}: no draws")
    members = []
    for row, values in enumerate(columns.T):
        constants, moduli, times = np.split(values[1:], [len(law), len(law) + count])
        try:
            if values[0] < 0:
                raise InputError(f"an equilibrium modulus of {values[0]:g} Pa: it must not be negative")
            if not (values[0] or np.any(moduli)):
                raise InputError("every shear modulus is zero: the material carries no load")
            shift = with_constants(material.shift, constants.tolist())
            spectrum = Spectrum(times if times.size else material.spectrum.relaxation_time, moduli)
        except InputError as error:
            raise InputError(f"{source}: row {row + 2}: {error}") from None
        members.append(replace(material, equilibrium_modulus=float(values[0]), spectrum=spectrum, shift=shift))
    return tuple(members)


def beside(source: str, name: str) -> str:
    """The path of the file that a material file called `source` calls `name`."""
    if source.startswith(EXAMPLE):
        return EXAMPLE + str(PurePosixPath(source.removeprefix(EXAMPLE)).parent / name)
    return str(Path(source).parent / name)


def read_draws(path: str | Path) -> tuple[Material, ...]:
    """The draws of the material in a material file, as `read_material` finds it.

    Raises `InputError` with a line for every mistake, and if it has none.
    """
    content = read_file(resolve(Path(), path), str(path))
    material, name = parse_material(content, str(path)), draws_file(content, str(path))
    if name is None:
        raise InputError(f"{path}: a material without draws: mastercurve and spectrum with [uncertainty] make them")
    table = beside(str(path), name)
    return parse_draws(read_file(resolve(Path(), table), table), table, material)


def _constants(law: ShiftLaw) -> dict[tuple[str, str], float]:
    """What differs from draw to draw, by name and unit."""
    match law:
        case WLF():
            return {("C1", "1"): law.C1, ("C2", "K"): law.C2}
        case Arrhenius():
            return {("activation_energy", "J/mol"): law.activation_energy}
        case ShiftTable():
            return {(f"log10_shift_factor_{t:g}", "1"): a for t, a in zip(law.temperature, law.log10_shift, strict=True)}
    return {}


def constant_headers(law: ShiftLaw) -> list[str]:
    """The headers of what differs from draw to draw."""
    return [f"{name} [{unit}]" for name, unit in _constants(law)]


def with_constants(law: ShiftLaw, constants: list[float]) -> ShiftLaw:
    """The same law with other constants; raises `InputError` naming the column of one that must be positive and is not."""
    for header, value in zip(constant_headers(law), constants, strict=True):
        if isinstance(law, WLF) and value <= 0:
            raise InputError(f'column "{header}": {value:g}: a number above 0 is needed')
    match law:
        case WLF():
            return WLF(law.reference_temperature, *constants)
        case Arrhenius():
            return Arrhenius(law.reference_temperature, *constants)
        case ShiftTable():
            return ShiftTable(law.reference_temperature, law.temperature, tuple(constants))
    return law
