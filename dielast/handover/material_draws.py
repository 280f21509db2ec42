"""The draws of a material: a table beside the material file, with one row for each draw."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, Problem, located
from dielast.handover.material_file import parse_file, parse_material
from dielast.io.files import EXAMPLE, Inputs, read_file
from dielast.io.manifest import SUMMARY, check_whole
from dielast.io.table import Column, Table, as_number, finite_columns, parse_csv
from dielast.io.toml import parse_toml
from dielast.material.material import Material, constants_of, material_of, numbers_of
from dielast.material.spectrum import Spectrum
from dielast.material.springs import SPRINGS, SpringLaw

EQUILIBRIUM = "equilibrium_shear_modulus"
LAWS = ("equilibrium_law", "nonequilibrium_law")
_SPRINGS = ("equilibrium", "nonequilibrium")
_OWN = (
    "shift",
    "equilibrium.shear_modulus",
    "nonequilibrium.shear_modulus",
    "nonequilibrium.relaxation_time",
    "nonequilibrium.scale",
)
"""Constants that have columns of other names, or are contained in such columns."""
_FURTHER = re.compile(r"(?P<section>[a-z]+)\.(?P<key>\w+?)(_(?P<place>\d+))? \[[^\]]*\]")


def draw_columns(number: NDArray[np.int64], materials: Sequence[Material]) -> Table:
    """The table of draws of one material, which share their number of branches and their laws but those of springs.

    `number` (draws,) holds the number of each draw. Columns of further constants that differ between draws are named by their path
    in a material file; entries of lists are numbered from 1. Where the laws of springs differ, columns hold their names, and a
    constant that a law does not have is NaN.
    """
    laws, pairs = [material.shift.drawn() for material in materials], {_pair(material) for material in materials}
    moduli = np.array([material.spectrum.shear_modulus for material in materials])
    times = np.array([material.spectrum.relaxation_time for material in materials])
    return [
        Column("draw", None, number),
        *([] if len(pairs) == 1 else _law_columns(materials)),
        Column(EQUILIBRIUM, "Pa", np.array([material.equilibrium_modulus for material in materials])),
        *(Column(name, unit, np.array([law[name, unit] for law in laws])) for name, unit in laws[0]),
        *(Column(f"shear_modulus_{k + 1}", "Pa", column) for k, column in enumerate(moduli.T)),
        *(Column(f"relaxation_time_{k + 1}", "s", column) for k, column in enumerate(times.T)),
        *(_further(materials) if len(pairs) == 1 else _of_several_laws(materials)),
    ]


def _pair(material: Material) -> tuple[str, str]:
    return material.equilibrium_law.name, material.nonequilibrium_law.name


def _law_columns(materials: Sequence[Material]) -> Table:
    """The names of the laws of both kinds of springs."""
    return [Column(name, None, list(names)) for name, names in zip(LAWS, zip(*map(_pair, materials), strict=True), strict=True)]


def _of_several_laws(materials: Sequence[Material]) -> Table:
    """The further columns of materials with different laws of springs, each law in turn."""
    found: dict[str, Column] = {}
    for pair in dict.fromkeys(map(_pair, materials)):
        rows = [row for row, material in enumerate(materials) if _pair(material) == pair]
        for column in _further([materials[row] for row in rows], _SPRINGS):
            values = np.full(len(materials), np.nan)
            if column.name in found:
                values = np.asarray(found[column.name].values, dtype=float)
            values[rows] = column.values
            found[column.name] = Column(column.name, column.unit, values)
    return list(found.values())


def _further(materials: Sequence[Material], every: Sequence[str] = ()) -> Table:
    """The columns of all other constants that differ between the materials, and of all constants in the sections `every`."""
    numbers, columns = [numbers_of(material) for material in materials], []
    for section, constants in constants_of(materials[0]).items():
        keys = [key for key in constants if section not in _OWN and f"{section}.{key}" not in _OWN and key in numbers[0][section]]
        values = {key: np.array([np.atleast_1d(stated[section][key]) for stated in numbers], dtype=float) for key in keys}
        if section not in every and all(np.all(drawn == drawn[0]) for drawn in values.values()):
            continue
        # all constants of the law, as some of them may be relative to a modulus
        for key, drawn in values.items():
            path, many = f"{section}.{key}", np.ndim(numbers[0][section][key]) > 0
            names = [f"{path}_{k + 1}" for k in range(drawn.shape[1])] if many else [path]
            columns += [Column(name, constants[key].unit, column) for name, column in zip(names, drawn.T, strict=True)]
    return columns


def parse_draws(content: bytes, source: str, material: Material) -> tuple[Material, ...]:
    """The draws of `material` in the bytes of their table; raises `InputError` if they do not fit this material.

    A table without relaxation times takes those of the material. Draws may have spring laws of their own.
    """
    if f",{','.join(LAWS)},".encode() in content.partition(b"\n")[0]:
        return _of_own_laws(content, source, material)
    law = material.shift.drawn_headers()
    count = len(material.spectrum)
    first_line = content.split(b"\n", 1)[0].decode(errors="replace")
    if f",shear_modulus_{count + 1} [Pa]" in first_line:
        raise InputError(
            f"draws with more branches than the material has ({count}): run the command that wrote both again", file=source
        )
    headers = [f"{EQUILIBRIUM} [Pa]", *law, *(f"shear_modulus_{k + 1} [Pa]" for k in range(count))]
    if ",relaxation_time_1 [s]" in first_line:
        headers += [f"relaxation_time_{k + 1} [s]" for k in range(count)]
    further = _further_headers(first_line)
    columns = finite_columns(content, source, [*headers, *(match[0] for match in further)])
    if not columns.size:
        raise InputError("no draws", file=source)
    members = []
    for row, (values, others) in enumerate(zip(columns[: len(headers)].T, columns[len(headers) :].T, strict=True)):
        constants, moduli, times = np.split(values[1:], [len(law), len(law) + count])
        with located(file=source, row=row + 2):
            if values[0] < 0:
                raise InputError(f"an equilibrium modulus of {values[0]:g} Pa: at least 0 is needed")
            if not (values[0] or np.any(moduli)):
                raise InputError("every shear modulus is zero: the material carries no load")
            shift = material.shift.redrawn(constants.tolist())
            spectrum = Spectrum(times if times.size else material.spectrum.relaxation_time, moduli)
            member = replace(material, equilibrium_modulus=float(values[0]), spectrum=spectrum, shift=shift)
            members.append(_with_further(member, further, others.tolist()) if further else member)
    return tuple(members)


def _of_own_laws(content: bytes, source: str, material: Material) -> tuple[Material, ...]:
    """The draws of a table that names the laws of their springs: those of each pair of laws are a table of their own."""
    cells = parse_csv(content, source)
    pairs = list(zip(*(cells.pop(name) for name in LAWS), strict=True))
    found: dict[int, Material] = {}
    for pair in dict.fromkeys(pairs):
        rows = [row for row, other in enumerate(pairs) if other == pair]
        own = {header: [values[row] for row in rows] for header, values in cells.items()}
        own = {header: values for header, values in own.items() if any(value not in ("", "nan") for value in values)}
        part = "\n".join(",".join(row) for row in (own, *zip(*own.values(), strict=True))) + "\n"
        with located(file=source, row=rows[0] + 2):
            laws = [_law_of(name, section, own, f"{EQUILIBRIUM} [Pa]") for name, section in zip(pair, _SPRINGS, strict=True)]
        member = replace(material, equilibrium_law=laws[0], nonequilibrium_law=laws[1])
        try:
            found |= zip(rows, parse_draws(part.encode(), source, member), strict=True)
        except InputError as error:
            raise error.changed(partial(_in_whole, rows)) from None
    return tuple(found[row] for row in sorted(found))


def _in_whole(rows: Sequence[int], problem: Problem) -> Problem:
    """The problem with the row of the whole table, of which a part holds the `rows` (from 0)."""
    return problem if problem.row is None else replace(problem, row=rows[problem.row - 2] + 2)


def _law_of(name: str, section: str, columns: Mapping[str, list[str]], modulus: str) -> SpringLaw:
    """The law of a spring with the constants in the first row of the `columns`."""
    kind, stated = SPRINGS[name], dict[str, Any]()
    for header, values in columns.items():
        if (match := _FURTHER.fullmatch(header)) and match["section"] == section and match["key"] in kind.file_keys():
            value = as_number(values[0])
            stated[match["key"]] = (*stated.get(match["key"], ()), value) if match["place"] else value
    return kind.of_file(stated, as_number(columns[modulus][0]) if section == "equilibrium" and kind.takes_modulus else None)


def further_constants(content: bytes) -> list[str]:
    """The paths, in a material file, of the constants in a table of draws besides moduli, relaxation times and shift."""
    return [
        f"{match['section']}.{match['key']}" for match in _further_headers(content.partition(b"\n")[0].decode(errors="replace"))
    ]


def _further_headers(first_line: str) -> list[re.Match[str]]:
    return [match for cell in first_line.strip().split(",") if (match := _FURTHER.fullmatch(cell.strip('"')))]


def _with_further(member: Material, further: Sequence[re.Match[str]], values: Sequence[float]) -> Material:
    """The draw with the constants in the columns `further`; raises `InputError` for a constant that the material does not have."""
    numbers = numbers_of(member)
    for match, value in zip(further, values, strict=True):
        section, key, place = match["section"], match["key"], match["place"]
        constants = numbers.get(section, {})
        if place is None and key in constants_of(member).get(section, {}):
            constants[key] = value
        elif place is not None and isinstance(constants.get(key), list | tuple) and 0 < int(place) <= len(constants[key]):
            constants[key] = [*constants[key][: int(place) - 1], value, *constants[key][int(place) :]]
        else:
            raise InputError(f'column "{match[0]}": the material has no such constant: run the command that wrote both again')
    return material_of(member, numbers)


def in_folder_of(source: str, name: str) -> str:
    """The path of the file `name`, as the material file `source` names it."""
    if source.startswith(EXAMPLE):
        return EXAMPLE + str(PurePosixPath(source.removeprefix(EXAMPLE)).parent / name)
    return (Path(source).parent / name).as_posix()


def read_draws_beside(inputs: Inputs, name: str, material: Material) -> tuple[Material, ...]:
    """The draws of the material in the file `name` among the inputs; empty if it names no table of draws.

    Raises `InputError` if the two files are not of one run.
    """
    content = inputs.read(name)
    stated = parse_file(content, name)
    if stated.draws is None:
        return ()
    table = in_folder_of(name, stated.draws)
    draws = inputs.read(table)
    check_pair(inputs.folder, name, {PurePosixPath(name).name: content, stated.draws: draws})
    return parse_draws(draws, table, material)


def read_draws(path: str | Path) -> tuple[Material, ...]:
    """The draws of the material in a material file, which is found as by `read_material`.

    Raises `InputError` with a line for every mistake, if the material has no draws, and if the two files are not of one run.
    """
    inputs, name = Inputs(Path()), str(path)
    members = read_draws_beside(inputs, name, parse_material(inputs.read(name), name))
    if not members:
        lacking = "the material has no draws: mastercurve with [uncertainty] and then spectrum make them, or calibrate"
        raise InputError(lacking, file=path)
    return members


def check_pair(home: Path, name: str, contents: Mapping[str, bytes]) -> None:
    """Raise `InputError` if a material file and its draws are not as the summary beside them lists them; nothing without one."""
    summary = in_folder_of(name, SUMMARY)
    if not name.startswith(EXAMPLE) and os.path.isfile(home / summary):
        try:
            stated = parse_toml(read_file(home / summary, summary), summary)
        except InputError:  # a file of the user's with this name
            return
        check_whole(Path(name).parent, stated, contents)
