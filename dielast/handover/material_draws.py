"""The draws of a material: a table beside the material file, with one row for each draw."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, located
from dielast.handover.material_file import parse_file
from dielast.io.files import EXAMPLE, Inputs, read_file, resolve
from dielast.io.table import Column, Table, finite_columns
from dielast.material.material import Material, constants_of, material_of, numbers_of
from dielast.material.spectrum import Spectrum

EQUILIBRIUM = "equilibrium_shear_modulus"
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
    """The table of draws of one material, which share their number of branches and their laws.

    `number` (draws,) holds the number of each draw. Columns of further constants that differ between draws are named by their path
    in a material file; entries of lists are numbered from 1.
    """
    laws = [material.shift.drawn() for material in materials]
    moduli = np.array([material.spectrum.shear_modulus for material in materials])
    times = np.array([material.spectrum.relaxation_time for material in materials])
    return [
        Column("draw", None, number),
        Column(EQUILIBRIUM, "Pa", np.array([material.equilibrium_modulus for material in materials])),
        *(Column(name, unit, np.array([law[name, unit] for law in laws])) for name, unit in laws[0]),
        *(Column(f"shear_modulus_{k + 1}", "Pa", column) for k, column in enumerate(moduli.T)),
        *(Column(f"relaxation_time_{k + 1}", "s", column) for k, column in enumerate(times.T)),
        *_further(materials),
    ]


def _further(materials: Sequence[Material]) -> Table:
    """The columns of all other constants that differ between the materials."""
    numbers, columns = [numbers_of(material) for material in materials], []
    for section, constants in constants_of(materials[0]).items():
        keys = [key for key in constants if section not in _OWN and f"{section}.{key}" not in _OWN and key in numbers[0][section]]
        values = {key: np.array([np.atleast_1d(stated[section][key]) for stated in numbers], dtype=float) for key in keys}
        if all(np.all(drawn == drawn[0]) for drawn in values.values()):
            continue
        # all constants of the law, as some of them may be relative to a modulus
        for key, drawn in values.items():
            path, many = f"{section}.{key}", np.ndim(numbers[0][section][key]) > 0
            names = [f"{path}_{k + 1}" for k in range(drawn.shape[1])] if many else [path]
            columns += [Column(name, constants[key].unit, column) for name, column in zip(names, drawn.T, strict=True)]
    return columns


def parse_draws(content: bytes, source: str, material: Material) -> tuple[Material, ...]:
    """The draws of `material` in the bytes of their table; raises `InputError` if they do not fit this material.

    A table without relaxation times takes those of the material.
    """
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


def beside(source: str, name: str) -> str:
    """The path of the file `name`, as the material file `source` names it."""
    if source.startswith(EXAMPLE):
        return EXAMPLE + str(PurePosixPath(source.removeprefix(EXAMPLE)).parent / name)
    return (Path(source).parent / name).as_posix()


def read_draws_beside(inputs: Inputs, name: str, material: Material) -> tuple[Material, ...]:
    """The draws of the material in the file `name` among the inputs; empty if it names no table of draws."""
    stated = parse_file(inputs.read(name), name)
    if stated.draws is None:
        return ()
    table = beside(name, stated.draws)
    return parse_draws(inputs.read(table), table, material)


def read_draws(path: str | Path) -> tuple[Material, ...]:
    """The draws of the material in a material file, which is found as by `read_material`.

    Raises `InputError` with a line for every mistake, and if the material has no draws.
    """
    content = read_file(resolve(Path(), path), str(path))
    stated = parse_file(content, str(path))
    if stated.draws is None:
        raise InputError(
            "the material has no draws: mastercurve with [uncertainty] and then spectrum make them, or calibrate", file=path
        )
    table = beside(str(path), stated.draws)
    return parse_draws(read_file(resolve(Path(), table), table), table, stated.material())
