"""Read the table of specimens of a recipe."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dielast.commands.lifetime.recipe import QUANTITIES, FailureData, LifetimeRecipe
from dielast.commands.registry import read_cases
from dielast.commands.simulation.compare import rows_where
from dielast.commands.simulation.solver_steps import order_of, solver_steps
from dielast.errors import InputError, Mistakes, located, shown
from dielast.failures.likelihood import Seen
from dielast.failures.specimens import Specimens
from dielast.io.files import Inputs, resolve
from dielast.io.text_table import MeasuredTable, read_measured
from dielast.material.material import Material
from dielast.mechanics.load import VoltageStep
from dielast.numerics.arrays import Floats

YES = ("yes", "y", "true", "1", "running", "suspended", "survived", "x")
NO = ("no", "n", "false", "0", "failed", "")


def read_specimens(recipe: LifetimeRecipe, material: Material, inputs: Inputs) -> Specimens:
    """The specimens of a recipe; raises `InputError` with a line for every mistake, naming the specimen."""
    data, film = recipe.data, recipe.film
    table = read_measured(inputs.read(data.file), data.file, data.text_format(), data.units, with_texts=True)
    rows = rows_where(table, data.where)
    table = table.only(rows)
    n = table.lines.size
    if not n:
        raise InputError("no specimen in these rows", file=data.file, key="data.where")
    numbers = {role: _numbers(table, data, role) for role in QUANTITIES}
    texts = {role: _texts(table, data, role) for role in ("suspended", "specimen", "batch", "mode", "recipe")}
    names = [text or str(k + 1) for k, text in enumerate(texts["specimen"] or [""] * n)]
    wrong = Mistakes()

    def refuse(row: int, text: str) -> None:
        wrong.append(table.error(f"specimen {names[row]}: {text}", row).problems[0])

    suspended = np.array([_is_yes(text, refuse, row) for row, text in enumerate(texts["suspended"] or [""] * n)])
    recipes, of_recipe = texts["recipe"] or [""] * n, np.full(n, -1)
    programmes = list[Sequence[VoltageStep]]()
    for name in dict.fromkeys(filter(None, recipes)):
        steps = wrong.tried(lambda name=name: _programme(name, inputs))  # type: ignore[misc]
        of_recipe[[row for row, text in enumerate(recipes) if text == name]] = len(programmes)
        programmes.append(steps or ())
    voltage, ramp, time = (numbers[role] for role in ("voltage", "ramp", "time"))
    if voltage is None and not programmes:
        raise table.error("a column of voltages is needed: state columns.voltage")
    voltage = np.full(n, np.nan) if voltage is None else np.abs(voltage)
    ramp = np.full(n, np.inf) if ramp is None else np.where(np.isnan(ramp), np.inf, ramp)
    time = np.full(n, np.nan) if time is None else time
    given = of_recipe >= 0
    for row in np.flatnonzero(~given & ~(voltage > 0)).tolist():
        refuse(row, "a voltage above 0 is needed")
    for row in np.flatnonzero(~(ramp > 0)).tolist():
        refuse(row, "a ramp above 0 is needed, or an empty cell for a voltage that comes at once")
    at_end = np.isnan(time) & np.isfinite(ramp) & ~given
    time = np.where(at_end, voltage / np.where(ramp > 0, ramp, 1.0), time)
    for row in np.flatnonzero(np.isnan(time)).tolist():
        refuse(row, "a time is needed (only a ramp to failure has none)")
    for row in np.flatnonzero(time < 0).tolist():
        refuse(row, f"{time[row]:g} s: a time must not be negative")
    for row in np.flatnonzero(suspended & (time == 0)).tolist():
        refuse(row, "it is suspended at 0 s, so that nothing is known of it: delete the row")
    intact = numbers["intact"]
    intact = np.full(n, np.nan) if intact is None else np.where(suspended, np.nan, intact)
    for row in np.flatnonzero(intact >= time).tolist():
        refuse(row, f"it was last seen intact at {intact[row]:g} s, not before it was found failed at {time[row]:g} s")
    seen = np.where(suspended, Seen.SUSPENDED, np.where(np.isfinite(intact) & (intact > 0), Seen.BETWEEN, Seen.FAILED))
    seen = np.where((seen == Seen.FAILED) & ((time == 0) | (intact == 0)), Seen.DEAD, seen)
    first, second = numbers["prestretch"], numbers["prestretch_2"]
    if first is None and film.prestretch is None:
        raise InputError("is needed, as no column holds the prestretch", key="film.prestretch")
    prestretch = np.tile(np.array(film.prestretch or (np.nan, np.nan)), (n, 1))
    if first is not None:
        given_here = np.isfinite(first)
        prestretch[given_here] = np.stack((first, first), axis=1)[given_here]
        if second is not None:
            prestretch[np.isfinite(second), 1] = second[np.isfinite(second)]
    for row in np.flatnonzero(~np.all(prestretch >= 1, axis=1)).tolist():
        refuse(row, f"prestretch {prestretch[row, 0]:g}: at least 1 is needed (1 is undeformed)")

    def filled(role: str, default: float) -> Floats:
        values = numbers[role]
        return np.full(n, default) if values is None else np.where(np.isnan(values), default, values)

    thickness, area = filled("thickness", film.thickness), filled("area", np.nan)
    humidity = filled("humidity", np.nan)
    for role, values in (("thickness", thickness), ("area", area), ("humidity", humidity)):
        for row in np.flatnonzero(values <= 0).tolist():
            refuse(row, f"{role} {values[row]:g}: a positive number is needed")
    if np.any(np.isfinite(area)):
        for row in np.flatnonzero(np.isnan(area)).tolist():
            refuse(row, "its area is not stated, but that of others is")
    for name in dict.fromkeys(name for name in names if names.count(name) > 1):
        refuse(names.index(name), f"{names.count(name)} rows have this name: each row is a specimen of its own")
    wrong.refuse()
    default = material.reference_temperature if recipe.temperature is None else recipe.temperature
    return Specimens(
        tuple(names),
        seen.astype(np.intp),
        time,
        np.where(given, np.nan, voltage),
        ramp,
        prestretch,
        thickness,
        filled("temperature", default),
        intact,
        area,
        humidity,
        tuple(texts["batch"] or [""] * n),
        tuple(texts["mode"] or [""] * n),
        of_recipe,
        tuple(programmes),
        tuple({"file": data.file, "line": int(line)} for line in table.lines),
    )


def _column(table: MeasuredTable, data: FailureData, role: str) -> str | int | None:
    """The column of a role: the stated one, or the one that is called so."""
    stated = data.columns.by_role.get(role)
    return stated if stated is not None else role if table.has(role) else None


def _numbers(table: MeasuredTable, data: FailureData, role: str) -> Floats | None:
    """The numbers in SI of a column (n,), NaN for empty cells; None if there is no such column."""
    column = _column(table, data, role)
    if column is None:
        return None
    filled = np.array([bool(cell.strip()) for cell in table.cells[table.find(column, role)]])
    values = np.full(filled.size, np.nan)
    table.check(column, role, QUANTITIES[role])
    if filled.any():
        values[filled] = table.column(column, role, QUANTITIES[role], filled)
    return values


def _texts(table: MeasuredTable, data: FailureData, role: str) -> list[str] | None:
    """The cells of a column; None if there is no such column."""
    column = _column(table, data, role)
    return None if column is None else [cell.strip() for cell in table.cells[table.find(column, role)]]


def _is_yes(text: str, refuse: Any, row: int) -> bool:
    plain = text.casefold()
    if plain not in (*YES, *NO):
        refuse(row, f"suspended {shown(text)}: yes or no is needed")
    return plain in YES


def _programme(name: str, inputs: Inputs) -> Sequence[VoltageStep]:
    """The steps of voltage of a recipe of actuate."""
    content, path = inputs.read(name), resolve(inputs.folder, name)
    cases = read_cases(path, content=content)
    recipe = cases[0].recipe
    if recipe.kind != "actuate" or len(cases) > 1 or recipe.control != "voltage":
        raise InputError("a recipe of actuate with steps of voltage and without [sweep] is needed", file=name)
    if any(step.moves or step.charge is not None for step in recipe.step):
        raise InputError("steps of voltage alone are needed: edges stay as they are in a test to failure", file=name)
    with located(file=name):
        timed = solver_steps(recipe, Inputs(path.parent))
    steps = [VoltageStep(one.driven, rate=one.step.rate, duration=one.step.duration) for one in timed]
    return [steps[number] for number, _ in order_of(recipe, timed)]
