"""The draws of a material: a table beside the material file, one draw a row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, located
from dielast.handover.material_file import draws_file, parse_material
from dielast.handover.tables import finite_columns
from dielast.io.files import EXAMPLE, read_file, resolve
from dielast.io.table import Column, Table
from dielast.material.material import Material
from dielast.material.spectrum import Spectrum

EQUILIBRIUM = "equilibrium_shear_modulus"


def draw_columns(number: NDArray[np.int64], materials: Sequence[Material]) -> Table:
    """The table of draws of one material, which share their number of branches; `number` (draws,) says which draw each is."""
    laws = [material.shift.drawn() for material in materials]
    moduli = np.array([material.spectrum.shear_modulus for material in materials])
    times = np.array([material.spectrum.relaxation_time for material in materials])
    return [
        Column("draw", None, number),
        Column(EQUILIBRIUM, "Pa", np.array([material.equilibrium_modulus for material in materials])),
        *(Column(name, unit, np.array([law[name, unit] for law in laws])) for name, unit in laws[0]),
        *(Column(f"shear_modulus_{k + 1}", "Pa", column) for k, column in enumerate(moduli.T)),
        *(Column(f"relaxation_time_{k + 1}", "s", column) for k, column in enumerate(times.T)),
    ]


def parse_draws(content: bytes, source: str, material: Material) -> tuple[Material, ...]:
    """The draws of `material` in the bytes of their table; raises `InputError` if they are not of this material.

    A table without relaxation times takes those of the material.
    """
    law = material.shift.drawn_headers()
    count = len(material.spectrum)
    first_line = content.split(b"\n", 1)[0].decode(errors="replace")
    if f",shear_modulus_{count + 1} [Pa]" in first_line:
        raise InputError(f"draws of more than the material's {count} branches: make both anew", file=source)
    headers = [f"{EQUILIBRIUM} [Pa]", *law, *(f"shear_modulus_{k + 1} [Pa]" for k in range(count))]
    if ",relaxation_time_1 [s]" in first_line:
        headers += [f"relaxation_time_{k + 1} [s]" for k in range(count)]
    columns = finite_columns(content, source, headers)
    if not columns.size:
        raise InputError("no draws", file=source)
    members = []
    for row, values in enumerate(columns.T):
        constants, moduli, times = np.split(values[1:], [len(law), len(law) + count])
        with located(file=source, row=row + 2):
            if values[0] < 0:
                raise InputError(f"an equilibrium modulus of {values[0]:g} Pa: it must not be negative")
            if not (values[0] or np.any(moduli)):
                raise InputError("every shear modulus is zero: the material carries no load")
            shift = material.shift.redrawn(constants.tolist())
            spectrum = Spectrum(times if times.size else material.spectrum.relaxation_time, moduli)
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
        raise InputError("a material without draws: mastercurve and spectrum with [uncertainty] make them", file=path)
    table = beside(str(path), name)
    return parse_draws(read_file(resolve(Path(), table), table), table, material)
