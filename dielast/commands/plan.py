"""What is known of a recipe before it is run: its mistakes and warnings, how much there is to do, and how long it takes here."""

import os
import signal
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from types import FrameType
from typing import Any

from dielast.base.errors import DielastWarning, InputError, NumericsError, messages_of
from dielast.commands.registry import COMMANDS, read_cases
from dielast.io.files import Inputs, read_file
from dielast.io.toml import parse_toml
from dielast.recipe.cases import Case
from dielast.sharing.execution import Execution

ENOUGH = 5.0  # s of measuring after which the next finished chunk ends it
LONGEST = 60.0  # s after which it ends without one


def warnings_of(path: Path, content: bytes | None = None) -> list[str]:
    """The warnings about a recipe, a load file or a material file, or about a recipe of this `content` that would be there.

    Raises `InputError` with a line for every mistake.
    """
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always", DielastWarning)
        _inspect(path, content)
    return messages_of(record)


def amount_of(path: Path, timed: bool = False) -> str:
    """What a recipe amounts to, and if it is to be `timed`, how long it takes here; empty for what is no recipe, or one case."""
    if os.path.isfile(path) and "kind" not in parse_toml(read_file(path, str(path)), str(path)):
        return ""
    cases = read_cases(path)
    parts = [extent(cases), measured(cases[0].recipe.kind, cases, path) if timed else ""]
    return "; ".join(filter(None, parts))


def _inspect(path: Path, content: bytes | None) -> None:
    keys = parse_toml(read_file(path, str(path)), str(path)).keys() if content is None and os.path.isfile(path) else set()
    if "kind" not in keys and {"equilibrium", "nonequilibrium"} & keys:
        from dielast.handover.material_file import read_material
        from dielast.material.checks import warn_of_material

        warn_of_material(read_material(path))
    elif keys == {"step"}:
        from dielast.recipe.cases import check_load

        check_load(COMMANDS, path)
    else:
        cases = read_cases(path, content=content)
        try:
            COMMANDS[cases[0].recipe.kind].prepared(cases, Inputs(path.parent))
        except (InputError, NumericsError) as error:
            wrong = (problem.within(file=path) if problem.file else problem.at(file=path) for problem in error.problems)
            raise InputError(*dict.fromkeys(wrong)) from None


class _Enough(KeyboardInterrupt):
    """Ends a run that is only measured, in the way in which Ctrl-C does."""


@dataclass(slots=True)
class _Stage:
    """What is counted at present, how much of it is done, and when it began and last went on, in s of a clock."""

    what: str
    begin: float
    done: int = 0
    total: int = 0
    last: float = 0.0


class _Meter:
    """The progress of a run, which ends the run once it is known how long it takes."""

    def __init__(self) -> None:
        self.begin = time.monotonic()
        self.stages: list[_Stage] = []

    def __call__(self, done: int, total: int, what: str) -> None:
        now, what = time.monotonic(), what.partition(",")[0]
        if not self.stages or self.stages[-1].what != what:
            self.stages.append(_Stage(what, self.stages[-1].last if self.stages else self.begin))
        stage = self.stages[-1]
        stage.done, stage.total, stage.last = done, total, now
        if done < total and now - stage.begin > ENOUGH:
            raise _Enough


def extent(cases: Sequence[Case[Any]]) -> str:
    """What the cases of a recipe amount to, such as "300 cells, 200 draws"; empty for one case and nothing else."""
    recipe = cases[0].recipe
    counts = {"cases": len(cases)}
    film, voltage, goal = (getattr(recipe, name, None) for name in ("film", "voltage", "goal"))
    if film is not None and hasattr(film, "sizes"):
        films = prod(film.sizes) * len(recipe.temperature or (1,))
        if voltage is not None:
            counts["cells"] = films * (len(voltage.values) if voltage.values else voltage.points or 1)
        elif goal is not None:
            counts["films"] = films * len(goal.relative_stretch or goal.area_strain or (1,))
    if recipe.kind == "measure":
        counts["photographs"] = len(recipe.files)
    if recipe.kind == "calibrate":
        counts |= {"tests": len(recipe.test), "starts": recipe.fit.starts}
    if (uncertainty := getattr(recipe, "uncertainty", None)) is not None:
        counts["draws"] = uncertainty.draws
    return ", ".join(f"{count:,} {what}" for what, count in counts.items() if count > 1)


def measured(kind: str, cases: Sequence[Case[Any]], path: Path, jobs: int = 1) -> str:
    """How long a run takes here, as a message. It is run for a while, and nothing is written; raises what the run raises."""
    meter = _Meter()
    can_wake = hasattr(signal, "setitimer")
    before = signal.signal(signal.SIGALRM, _stop) if can_wake else None
    finished = False
    try:
        if can_wake:
            signal.setitimer(signal.ITIMER_REAL, LONGEST)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DielastWarning)
            COMMANDS[kind].run(cases, Inputs(path.parent), Execution(jobs, progress=meter))
        finished = not meter.stages or meter.stages[-1].done >= meter.stages[-1].total
    except _Enough:
        pass
    finally:
        if can_wake:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)
    took = time.monotonic() - meter.begin
    return f"takes {_spoken(took)} here" if finished else _estimate(meter, took, cases[0].recipe)


def _stop(number: int, frame: FrameType | None) -> None:
    raise _Enough


def _estimate(meter: _Meter, took: float, recipe: Any) -> str:
    if not meter.stages or not meter.stages[-1].done:
        return f"takes longer than {_spoken(took)} here"
    stage = meter.stages[-1]
    whole = stage.begin - meter.begin + (stage.last - stage.begin) * stage.total / stage.done
    later = getattr(recipe, "uncertainty", None) is not None and stage.what == "cases"
    more = ", and the draws come after them" if later else ""
    return f"takes about {_spoken(whole)} here, by the first {stage.done:,} of {stage.total:,} {stage.what}{more}"


def _spoken(seconds: float) -> str:
    for size, unit in ((86400, "d"), (3600, "h"), (60, "min")):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.2g} s" if seconds < 100 else f"{seconds:.0f} s"
