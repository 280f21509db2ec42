"""`[data]` of a recipe of `mastercurve` or `spectrum`, as far as the files themselves say what belongs there."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from dielast.base.errors import InputError, as_toml, shown
from dielast.material.measurement_kind import KINDS
from dielast.readings.columns_recipe import MODULI, OVER_FREQUENCY, STRAINS, STRESSES, first_role, unmeasured
from dielast.readings.isotherms import WIDEST
from dielast.readings.named import TOLERANCE, NamedTemperatures, celsius, levels_of, specimen_above, temperatures_in_names
from dielast.readings.recipe import CurveData, MeasurementData
from dielast.readings.seen import Given, SeenColumn, SeenFile, SeenTable
from dielast.readings.steps import Part, parts_of
from dielast.readings.values import is_held, reached_at
from dielast.recipe.lines import FILL, RecipeLines

_ORDINATES = {"modulus", "compliance", "storage", "loss", "tan_delta", "complex_modulus", *STRESSES}
_ROLES = ("temperature", "set", "time", "modulus", "compliance", *OVER_FREQUENCY, *STRAINS, *STRESSES)
_SHEETS, _LISTED = 5, 8  # of a workbook that are named, and columns
_NO_TEMPERATURE = "neither a column nor the names of the files state it with its unit"


def state_data(recipe: RecipeLines, given: Given, one: bool) -> list[float] | None:
    """Write the section `[data]` into a recipe, of a test at `one` temperature or of tests at several.

    Returns the temperatures in degC, ascending, None if a key for them must be filled in. Raises `InputError` for files that are no
    such tests.
    """
    files = given.seen
    if len({seen.is_export for seen in files}) > 1:
        raise InputError("tables and exports of instruments do not go into one recipe")
    if one and len(files) > 1:
        raise InputError(f"{len(files)} files are given, but a spectrum is of one test or curve: dielast mastercurve takes several")
    if files[0].is_export:
        return _state_export(recipe, given, one)
    table = files[0].first
    columns = table.columns(_ROLES)
    used, kind = _measured(table, columns)
    if "temperature" in columns and not table.levels:
        used = {"temperature": columns["temperature"]} | used
        if "set" in columns and table.has_numbers(columns["set"].place):
            used["set"] = columns["set"]
    if len(files) > 1 and not table.levels:
        used = _shared(files, used)
    recipe.unsure = not (_ORDINATES & used.keys())
    levels, named = _temperatures(given, _levels(given, used), "temperature" in used or bool(table.levels), one)

    recipe.section("[data]")
    several = not one and (len(files) > 1 or (named is not None and levels is not None))
    recipe.key("files" if several else "file", given.stated if several else files[0].name, _shape(given))
    state_sheet(recipe, files[0])
    further = [] if one or several or "temperature" in used or table.levels else ["temperature"]
    state_columns(recipe, table, used, [*_missing(used, kind), *further])
    state_units(recipe, used)
    if named is not None and several:
        _state_temperatures(recipe, named)
    elif levels and named is None:
        _note_temperatures(recipe, "headers state" if table.levels else "column holds", levels)
    _state_kind(recipe, table, used, kind)
    _state_test(recipe, table, used)
    if stated := specimen_of(table, list(used)):
        recipe.key("specimen", *stated)
    _state_ramp(recipe, table, used, kind)
    if one:
        _state_reference(recipe, levels)
    for seen in files:
        recipe.doubts += seen.doubts
    return levels


def _temperatures(
    given: Given, levels: list[float] | None, stated: bool, one: bool
) -> tuple[list[float] | None, NamedTemperatures | None]:
    """The temperatures in degC, and what the names of the files say of them unless the files state them (`levels`).

    Raises `InputError` for several temperatures where `one` is needed, and for one where several are.
    """
    named = None if stated else _in_names(given)
    if named is not None and not named.doubt:
        levels = levels_of(np.array([celsius(quantity) for quantity in named.quantities]))
    if one and levels is not None and len(levels) > 1:
        raise InputError(f"{len(levels)} temperatures: dielast mastercurve takes them, and dielast spectrum its result")
    if not one and levels is not None and len(levels) == 1:
        raise InputError(f"one temperature, {levels[0]:g} degC: dielast spectrum takes it, a master curve needs several")
    return levels, named


def _note_temperatures(recipe: RecipeLines, found: str, levels: Sequence[float]) -> None:
    recipe.note(f"The {found} {len(levels)} temperature{'s' if len(levels) > 1 else ''}, {_span(levels)}.")


def _state_reference(recipe: RecipeLines, levels: Sequence[float] | None) -> None:
    value, lacking = (f"{levels[0]:g} degC", "") if levels else (FILL, f": {_NO_TEMPERATURE}")
    recipe.key("reference_temperature", value, f"of the test or curve{lacking}")


def state_columns(recipe: RecipeLines, table: SeenTable, used: Mapping[str, SeenColumn], missing: Sequence[str] = ()) -> None:
    """State the key `columns`, with what shows the roles in a comment; roles that are `missing` must be filled in."""
    by_unit = [f"{role} by {column.reason}" for role, column in used.items() if column.reason != "its name"]
    parts = ["; ".join([*(["by their names"] if len(by_unit) < len(used) else []), *by_unit])]
    if left := table.unnamed(used.values()):
        some = ", ".join(map(as_toml, left[:_LISTED])) + (", ..." if len(left) > _LISTED else "")
        parts.insert(0 if missing else 1, f"{'one of' if missing else 'not used:'} {some}")
    names = {role: column.name for role, column in used.items()}
    recipe.key("columns", dict.fromkeys(missing, FILL) | names, "; ".join(filter(None, parts)))


def state_units(recipe: RecipeLines, used: Mapping[str, SeenColumn]) -> None:
    """State the key `units`, to be filled in, for columns whose headers lack a unit; by role or by axis of a comparison."""
    if unknown := without_unit(used):
        recipe.key("units", dict.fromkeys(unknown, FILL), "the headers state no unit that fits")


def without_unit(used: Mapping[str, SeenColumn]) -> list[str]:
    """What columns are called here that lack a unit."""
    return [called for called, column in used.items() if column.lacks_unit]


def state_sheet(recipe: RecipeLines, seen: SeenFile) -> None:
    """State the sheet of a workbook that was looked at, or that there are others."""
    if seen.sheet is not None:
        what = "measurement" if seen.is_export or seen.first.is_measured() else "table"
        recipe.key("sheet", seen.sheet, f"the first sheet with a {what}; {listed_sheets(seen.other_sheets)}")
    elif seen.other_sheets:
        recipe.option(f"sheet = {as_toml(seen.other_sheets[0])}", f"the first sheet is read; {listed_sheets(seen.other_sheets)}")


def listed_sheets(others: Sequence[str]) -> str:
    """The other sheets of a workbook, for a comment."""
    return f"other sheets: {', '.join(map(shown, others[:_SHEETS]))}" + (", ..." if len(others) > _SHEETS else "")


def _shared(files: Sequence[SeenFile], used: Mapping[str, SeenColumn]) -> dict[str, SeenColumn]:
    """The columns in use by the names that they have in all files: without their units where these differ.

    Raises `InputError` for a file that has no such column, has it under another name, or states no unit where another file does.
    """
    shared = dict[str, SeenColumn]()
    for seen in files[1:]:
        columns = seen.first.columns(_ROLES)
        for role, first in used.items():
            what = role.replace("_", " ")
            if role not in columns:
                wrong = f"no column of the {what} was recognised, which {files[0].name} has: tests of one kind make one recipe"
                raise InputError(wrong, file=seen.name)
            column, known = columns[role], shared.get(role, first)
            if column.lacks_unit != first.lacks_unit:
                bare, stated = (seen, files[0]) if column.unit is None else (files[0], seen)
                wrong = f"the header of the {what} states no unit, but that of {stated.name} does: write it into the header"
                raise InputError(wrong, file=bare.name)
            if column.name != known.name:
                name = seen.first.table.names[column.place]
                if name != files[0].first.table.names[first.place]:
                    wrong = f'the {what} is called "{column.name}", but in {files[0].name} "{first.name}": one name is needed'
                    raise InputError(wrong, file=seen.name)
                known = replace(first, name=name)
            shared[role] = known
    return shared


def _measured(table: SeenTable, columns: Mapping[str, SeenColumn]) -> tuple[dict[str, SeenColumn], str | None]:
    """The columns of the measurement that a table shows, and its kind; None if the columns do not decide it."""
    moduli = next((roles for roles in MODULI if roles <= columns.keys()), None)
    swept = [role for role in ("frequency", "angular_frequency") if role in columns]
    if moduli and swept:
        chosen = [*swept, *(role for role in OVER_FREQUENCY[2:6] if role in moduli), "complex_viscosity"]
        return {role: columns[role] for role in chosen if role in columns}, "oscillation"
    time = [role for role in ("time",) if role in columns]
    for role, kind in (("modulus", "relaxation"), ("compliance", "creep")):
        if role in columns and not swept:
            return {name: columns[name] for name in (*time, role)}, kind
    strain, stress = first_role(STRAINS, columns), first_role(STRESSES, columns)
    if strain and stress and not swept:
        found = {role: columns[role] for role in (*time, strain, stress)}
        held = [role for role in (strain, stress) if time and _held(table, columns, role)]
        return found, None if len(held) != 1 else "relaxation" if held == [strain] else "creep"
    return {role: column for role, column in columns.items() if role not in ("temperature", "set")}, None


def _missing(used: Mapping[str, SeenColumn], kind: str | None) -> list[str]:
    """The roles that a measurement needs and no column was recognised for."""
    swept = {"frequency", "angular_frequency", "storage", "loss", "tan_delta", "complex_modulus"} & used.keys()
    if kind == "oscillation":
        return []
    if swept:
        abscissa = [] if swept & {"frequency", "angular_frequency"} else ["frequency"]
        ordinates = [] if "storage" in used else ["storage"]
        return [*abscissa, *ordinates, *([] if {"loss", "tan_delta"} & used.keys() else ["loss"])]
    strain, stress = first_role(STRAINS, used), first_role(STRESSES, used)
    lacking = [] if "time" in used else ["time"]
    if bool(strain) != bool(stress):
        lacking.append("stress" if strain else "strain")
    elif not strain and not {"modulus", "compliance"} & used.keys():
        lacking.append("modulus")
    return lacking


def _held(table: SeenTable, columns: Mapping[str, SeenColumn], role: str) -> bool:
    time, load = table.raw(columns["time"].place), table.raw(columns[role].place)
    rows = _first_run(time)
    time, load = time[rows], load[rows]
    kept = np.isfinite(time) & np.isfinite(load)
    return bool(kept.any()) and is_held(time[kept], load[kept])


def _first_run(time: np.ndarray) -> slice:
    """The rows of the first test of a table, up to where the times start again."""
    falls = np.flatnonzero(np.diff(time) < 0)
    return slice(0, int(falls[0]) + 1 if falls.size else time.size)


def _levels(given: Given, used: Mapping[str, SeenColumn]) -> list[float] | None:
    """The temperatures in degC that headers or a column of the files state; None if none do."""
    if given.seen[0].first.levels:
        return sorted({level for seen in given.seen for level in seen.first.levels})
    if "temperature" not in used:
        return None
    found = []
    for seen in given.seen:
        column = seen.first.columns(_ROLES).get("temperature")
        numbers = None if column is None else seen.first.numbers(column)
        if numbers is None:
            return None
        found.append(numbers)
    return levels_of(np.concatenate(found))


def _in_names(given: Given) -> NamedTemperatures:
    """The temperatures of the files as their names state them; what is doubtful, or not stated, is to be filled in."""
    found = temperatures_in_names([Path(name).name for name in given.names])
    if found is None:
        return NamedTemperatures((FILL,) * len(given.names), None, _NO_TEMPERATURE)
    if found.doubt:
        return NamedTemperatures(tuple(f"{quantity} {FILL}" for quantity in found.quantities), None, found.doubt)
    return found


def _state_temperatures(recipe: RecipeLines, named: NamedTemperatures) -> None:
    key, value = ("temperatures", list(named.quantities)) if named.pattern is None else ("temperature_in_name", named.pattern)
    recipe.key(key, value, named.doubt or "from the names of the files")


def _shape(given: Given) -> str:
    """What the files are, for a comment."""
    seen = given.seen
    rows = sum(table.table.lines.size for file in seen for table in file.tables)
    return f"{seen[0].format}{'' if len(seen) == 1 else f', {len(seen)} files'}, {rows} rows"


def _span(levels: Sequence[float]) -> str:
    return f"{min(levels):g} to {max(levels):g} degC" if len(set(levels)) > 1 else f"{levels[0]:g} degC"


def _state_kind(recipe: RecipeLines, table: SeenTable, used: Mapping[str, SeenColumn], kind: str | None) -> None:
    over = [role for role in (*STRAINS, *STRESSES) if role in used]
    if len(over) == 2 and "time" in used:
        if kind is None:
            recipe.key("measurement", FILL, f'"relaxation" or "creep": neither {over[0]} nor {over[1]} is held')
        else:
            recipe.key("measurement", kind, f"the {over[0] if kind == 'relaxation' else over[1]} is held")


def _state_test(recipe: RecipeLines, table: SeenTable, used: Mapping[str, SeenColumn]) -> None:
    names = [str(table.table.names[column.place]).strip() for column in used.values()]
    shear = [name for name in names if name == "G" or name.startswith(("G_", "G "))]
    tension = [name for name in names if name == "E" or name.startswith(("E_", "E "))]
    deformation = table.deformation or ("shear" if shear and not tension else "tension" if tension and not shear else None)
    if {"extension", "force", "stretch"} & used.keys():
        deformation = "tension"
    if deformation is None:
        recipe.option('test = "shear"', "CHECK: no header says tension or shear; tension is the default")
    else:
        recipe.key("test", deformation, "by the names of the columns")


def specimen_of(table: SeenTable, roles: Sequence[str]) -> tuple[dict[str, str], str] | None:
    """The value and the comment of the key `specimen` for columns of these roles; None if they need none."""
    if unmeasured(roles, None) is None:
        return None
    above = specimen_above(table)
    keys = [*(["gauge_length"] if "extension" in roles else []), *(["width", "thickness"] if "force" in roles else [])]
    lines = ", ".join(dict.fromkeys(line for key, (_, line) in above.items() if key in keys))
    comment = f'from "{lines}" above the table' if lines else "undeformed"
    return {key: above[key][0] if key in above else FILL for key in keys}, comment


def _state_ramp(recipe: RecipeLines, table: SeenTable, used: Mapping[str, SeenColumn], kind: str | None) -> None:
    if kind == "oscillation" or "time" not in used:
        return
    applied = first_role(STRESSES if kind == "creep" else STRAINS, used)
    time = table.numbers(used["time"])
    if applied is not None and time is not None:
        rows = _first_run(time)
        load = np.abs(table.raw(used[applied].place)[rows] - (applied == "stretch"))
        kept = np.isfinite(time[rows]) & np.isfinite(load)
        reached = reached_at(time[rows][kept], load[kept]) if kept.sum() > 2 and kind is not None else None
        if reached is not None and reached > 0:
            recipe.key("ramp", f"{reached:.3g} s", f"the {applied} is reached then: times become mean log ages of it")
            return
    comment = "times that count from the start of the loading: state how long it took"
    if np.nanmin(table.raw(used["time"].place)) <= 0:
        recipe.key("ramp", FILL, f"{comment}; times begin at 0")
    else:
        recipe.option('ramp = "1 s"', f"CHECK: {comment}")


def _state_export(recipe: RecipeLines, given: Given, one: bool) -> list[float] | None:
    """The section for exports of instruments: columns and units come from the files."""
    parts: list[Part] = []
    left_out: list[str] = []
    for index, name in enumerate(given.names):
        content = given.inputs.read(name)
        data = (CurveData if one else MeasurementData).model_validate({"file": name})
        in_file, others = parts_of(content, name, index, data)
        parts += in_file
        left_out += others
    levels = _levels_of_parts(parts)
    levels, named = _temperatures(given, levels, levels is not None, one)
    several = not one and (len(given.names) > 1 or named is not None)
    recipe.section("[data]")
    recipe.key(
        "files" if several else "file",
        given.stated if several else given.names[0],
        f"{_shape(given)}: names and units come from it",
    )
    if named is not None and several:
        _state_temperatures(recipe, named)
    elif levels and named is None:
        _note_temperatures(recipe, "steps state", levels)
    kinds = list(dict.fromkeys(part.kind.name for part in parts))
    words = " or ".join(f'"{kind}", {KINDS[kind].tests}' for kind in kinds)
    if len(kinds) > 1:
        recipe.key("measurement", FILL, f"there are {words}")
    else:
        recipe.option(f'measurement = "{kinds[0]}"', f"{len(parts)} step{'s' if len(parts) > 1 else ''}")
    if left_out:
        recipe.note(f"Steps that are not used: {', '.join(map(as_toml, left_out[:5]))}{', ...' if len(left_out) > 5 else ''}")
    deformations = {part.deformation for part in parts}
    if len(deformations) > 1 or None in deformations:
        recipe.key("test", FILL, '"tension" or "shear": the export does not say it')
    else:
        recipe.option(f'test = "{deformations.pop()}"', "by the export")
    if one:
        _state_reference(recipe, levels)
    return levels


def _levels_of_parts(parts: Sequence[Part]) -> list[float] | None:
    """The temperatures in degC of steps, as their readings or their names state them; None if a step has none."""
    found = []
    for part in parts:
        rows = part.filled("temperature") if "temperature" in part.columns else np.zeros(0, dtype=bool)
        numbers = part.only(rows).column("temperature") if rows.any() else np.zeros(0)
        in_step = part.temperature_in_step()
        if numbers.size:
            is_one = float(np.ptp(numbers)) <= WIDEST * TOLERANCE
            found.append(np.array([round(float(np.mean(numbers)), 6)]) if is_one else numbers)
        elif in_step is not None:
            found.append(np.array([in_step]))
        else:
            return None
    return levels_of(np.concatenate(found)) or None
