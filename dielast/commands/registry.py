"""The registry of the subcommands that run recipes: an entry for each subcommand."""

from __future__ import annotations

from collections import UserDict
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dielast.base.registry import adopt, opened
from dielast.commands.command import Command

if TYPE_CHECKING:
    from dielast.recipe.cases import Case


class Commands(UserDict[str, Command]):
    """The commands by name, in the order of a workflow; installed packages add theirs."""

    def __init__(self, *commands: Command) -> None:
        super().__init__({command.name: command for command in commands})
        opened("dielast.commands", Command, self.register)

    def register(self, command: Command) -> None:
        """Add a command."""
        self[command.name] = command

    def __contains__(self, name: object) -> bool:
        return name in self.data or adopt(name, "dielast.commands")


def _forms(*names: str) -> tuple[str, ...]:
    """The files of further figures."""
    return tuple(f"{name}.{form}" for name in names for form in ("png", "svg", "pdf"))


COMMANDS = Commands(
    Command(
        "mastercurve",
        "dielast.commands.mastercurve",
        "Relaxation tests, creep tests or frequency sweeps at several temperatures -> shift factors, shift law, master curve.",
        "Tests at several temperatures -> shift factors, master curve.",
        ("shift-factors.csv", "mastercurve.csv", "draws.csv", "draw-laws.csv", "draw-curves.csv"),
    ),
    Command(
        "measure",
        "dielast.commands.measure",
        "Photographs of an electrode -> stretches over time with standard errors.",
        "Photographs of an electrode -> stretches over time.",
        ("electrode.csv", *_forms("photographs")),
        can_share=True,
    ),
    Command(
        "spectrum",
        "dielast.commands.spectrum",
        "Master curve -> discrete relaxation spectrum and material file.",
        "Master curve -> spectrum, material file.",
        (
            *("spectrum.csv", "fit.csv", "continuous-spectrum.csv", "reduction.csv", "material.toml", "draws.csv"),
            *("material.inp", "material.mac", "material.feb", "material.mfront"),
            *(f"material-comsol-{name}.txt" for name in ("parameters", "branches-energy-factor", "branches-shear-modulus")),
            *("material-comsol-shift.txt", "material-comsol-notes.txt"),
        ),
    ),
    Command(
        "calibrate",
        "dielast.commands.calibrate",
        "Tests of a testing machine -> the material's constants with intervals and verdicts, and a material file with draws.",
        "Tests of any kind -> material file with intervals.",
        (
            *("parameters.csv", "tests.csv", "correlations.csv", "residuals.csv", "profiles.csv", "laws.csv", "next_tests.csv"),
            *("material.toml", "draws.csv"),
        ),
    ),
    *(
        Command(name, "dielast.commands.membrane", text, short, (f"{name}.csv", "events.csv", "cycles.csv", "cases.csv"), True)
        for name, text, short in (
            ("relax", "Prescribed stretch -> stress.", "Prescribed stretch -> stress."),
            ("creep", "Prescribed force or nominal stress -> stretch.", "Prescribed force or stress -> stretch."),
        )
    ),
    Command(
        "actuate",
        "dielast.commands.actuate",
        "Voltage history -> stretch of a prestretched film; breakdown, pull-in, loss of tension.",
        "Voltage history -> stretch of a film, and its failure.",
        (
            *("actuate.csv", "events.csv", "cycles.csv", "cases.csv", "profile.csv", "limits.csv", "sensitivity.csv"),
            *_forms("profile", "limits", "sensitivity"),
        ),
        can_share=True,
    ),
    Command(
        "failure-map",
        "dielast.commands.grids",
        "Time to breakdown and to pull-in over voltage, prestretch and temperature.",
        "Voltages, prestretches -> time to failure.",
        ("failure-map.csv", "fit.csv", "sensitivity.csv", *_forms("operating-map", "sensitivity")),
        can_share=True,
        module="failure_map",
    ),
    Command(
        "lifetime",
        "dielast.commands.lifetime",
        "Measured failures, and what has not failed yet -> the breakdown field or damage of a material, with scatter and draws.",
        "Measured failures -> breakdown or damage, with scatter.",
        ("parameters.csv", "specimens.csv", "life.csv", "laws.csv", "lines.csv", "plan.csv", "material.toml", "draws.csv"),
    ),
    Command(
        "design",
        "dielast.commands.grids",
        "Films -> the voltage that takes each film to a goal at a time, and the life of the film under it.",
        "Films, a goal -> voltage, life, the best film first.",
        ("design.csv",),
        can_share=True,
        module="design",
    ),
)


def read_cases(
    path: Path, kind: str | None = None, overrides: Sequence[str] = (), content: bytes | None = None
) -> tuple[Case[Any], ...]:
    """The cases of the recipe in the file `path`, see `dielast.recipe.cases.read_cases`."""
    from dielast.recipe import cases

    return cases.read_cases(COMMANDS, path, kind, overrides, content)


def others_in(folder: Path, kind: str) -> list[str]:
    """Other commands with results in the `folder`, whose summary a run of this `kind` replaces."""
    files = {path.name for path in folder.iterdir() if path.suffix and path.is_file()}
    foreign = {name for name in files if not name.startswith((f"{kind}.", "summary.")) and name not in COMMANDS[kind].files}
    if not foreign:  # usually: avoid importing other commands
        return []
    others = {other: command for other, command in COMMANDS.items() if other != kind}
    makers = [[other for other, command in others.items() if name in command.files] for name in foreign]
    return [other for other in others if [other] in makers]
