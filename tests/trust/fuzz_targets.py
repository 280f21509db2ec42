"""What is fuzzed: everything that reads, each with valid files to damage."""

from __future__ import annotations

import itertools
import random
import re
import shutil
import signal
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from damage import damage

from dielast.base.errors import DielastError, DielastWarning, InputError
from dielast.base.units import STRESS, TEMPERATURE, TIME
from dielast.commands.registry import COMMANDS, read_cases
from dielast.handover.material_file import parse_material
from dielast.io.files import Inputs
from dielast.io.text_table import read_measured
from dielast.recipe.cases import Case
from dielast.relaxation.spectrum_draws import CurveDraws

SECONDS = 10  # of processor time, which is the same on a busy machine
TOP = Path(__file__).resolve().parents[2]
GOLDEN = TOP / "tests" / "golden"

REPTATE = """T=-10;Mw=33.6;chem=PI;label=PI33K;\nw\tG'\tG"\tTemp\ttan(d)\tTorque
rad/s\tPa\tPa\t°C\t \tN-m
   100   2.54E5   1.29E5   -9.99   0.508   0.0011
    10    77361   1.01E5   -9.99   1.305   0.0005\n""".encode()
WIDE = [
    "time [s] 20 degC,E 20°C [kPa],time [s] 30 degC,E 30°C [kPa]\n1,5,1,4\n2,4,2,3\n4,3,,\n".encode(),
    "20 °C;;30 °C;\ntime;E;time;E\ns;MPa;s;MPa\n1,5;2,5;1,5;2,4\n2,5;2,4;2,5;2,3\n".encode(),
    b"time [s],E -10 C [Pa],E 293.15 K [Pa]\n1,5,4\n2,4,3\n3,3,2\n",
]
MACHINE = b"time [s],u [mm],F [N]\n0.5,4,0.02\n1,8,0.05\n2,8,0.04\n5,8,0.03\n"


class TooLate(BaseException):
    """Raised by the alarm clock; nothing that is fuzzed may take it for an error of its own."""


class Target:
    """Something that reads bytes; `seeds` are valid ones, and `read` writes into no folder but its own."""

    def __init__(self, name: str, seeds: Sequence[bytes], read: Callable[[bytes], object], shown: Sequence[str]) -> None:
        self.name, self.seeds, self.read = name, list(seeds), read
        self.shown = tuple(shown)  # how messages may begin

    def damaged(self, rng: random.Random) -> bytes:
        """A damaged input."""
        return damage(self.seeds, rng)

    def wrong(self, data: bytes) -> str | None:
        """What is wrong with the way in which the target deals with `data`, if anything."""
        begin = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                warnings.simplefilter("ignore", DielastWarning)
                self.read(data)
        except DielastError as error:
            for line in error.messages:
                if "\n" in line or "\r" in line:
                    return f"a message of several lines: {line!r}"
                if not line.startswith(self.shown):
                    return f"a message that names no file: {line!r}"
                if len(line) > 2000:
                    return f"a message of {len(line)} characters: {line[:200]!r}"
        except TooLate:
            return f"no answer within {SECONDS} s"
        except MemoryError:
            return "out of memory"
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            return f"{type(error).__name__}: {str(error)[:200]} ({Path(frame.filename).name}:{frame.lineno})"
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
        took = time.process_time() - begin
        return f"took {took:.1f} s" if took > SECONDS else None


def targets(scratch: Path) -> dict[str, Target]:
    """All targets by name; their files lie in `scratch`."""
    result = _recipes(scratch)
    materials = [path.read_bytes() for path in sorted((GOLDEN / "data").glob("*.toml")) if path.name != "history.toml"]
    result["material"] = Target("material", materials, lambda data: parse_material(data, "material.toml"), ["material.toml"])

    tables = [path.read_bytes() for path in sorted((GOLDEN / "data").glob("*.csv"))]

    def table(data: bytes) -> object:
        found = read_measured(data, "data.csv")
        wrong: list[str] = []
        for index, dimension in itertools.product(range(1, min(4, len(found.names)) + 1), (TEMPERATURE, TIME, STRESS)):
            try:
                found.column(index, "any", dimension)
            except InputError as error:
                wrong += error.messages
        if wrong:
            raise InputError(*wrong)
        return found

    result["csv"] = Target("csv", tables, table, ["data.csv"])
    return result | _runs(scratch) | _folders(scratch) | _draws(scratch) | _kept(scratch)


def _recipes(scratch: Path) -> dict[str, Target]:
    """Recipes of every kind, and what `--set` changes in one."""
    starters = {kind: command.starter().encode() for kind, command in COMMANDS.items()}
    # sections that a starter only mentions, stated
    stated = {kind: re.sub(rb"(?m)^# \[(?!data|truncate)\w+\].*\n(# .*\n)*", _uncommented, text) for kind, text in starters.items()}
    golden = {kind: [path.read_bytes() for path in sorted(GOLDEN.glob(f"{kind}-*/recipe.toml"))] for kind in COMMANDS}
    for folder in (GOLDEN / "data", *GOLDEN.glob("mastercurve-*")):
        if not (scratch / folder.name).exists():
            (scratch / folder.name).symlink_to(folder)
    (scratch / "recipes").mkdir(exist_ok=True)
    recipe = scratch / "recipes" / "recipe.toml"
    result = {}

    def reads(kind: str) -> Callable[[bytes], object]:
        def read(data: bytes) -> object:
            recipe.write_bytes(data)
            return read_cases(recipe, kind, ())

        return read

    for kind in COMMANDS:
        result[f"recipe-{kind}"] = Target(
            f"recipe-{kind}", [starters[kind], stated[kind], *golden[kind]], reads(kind), [str(recipe), "example:", "../", "/"]
        )

    kept = scratch / "recipes" / "kept.toml"
    kept.write_bytes(starters["actuate"])
    overrides = [
        b"step.0.voltage=3 kV",
        b"film.prestretch=[3.0, 1.0]",
        b"step.1.hold='2 min'",
        b'breakdown.field="40 MV/m"',
        b"pull_in.timescale=0 s",
        b"sweep={'film.thickness'=['1 mm', '2 mm']}",
        b"stop={at='end'}",
        b"solver.rtol=1e-8",
        b"material=example:vhb4905.toml",
    ]
    result["set"] = Target(
        "set",
        overrides,
        lambda data: read_cases(kept, "actuate", [data.decode("utf-8", "replace")]),
        [str(kept), "--set"],
    )
    return result


def _uncommented(block: re.Match[bytes]) -> bytes:
    return re.sub(rb"(?m)^# ", b"", block[0])


def _runs(scratch: Path) -> dict[str, Target]:
    """Targets that read damaged data through a sound recipe, as far as the numbers that are computed with."""
    from dielast.commands.mastercurve.recipe import MasterCurveRecipe
    from dielast.commands.membrane.recipe import RelaxRecipe
    from dielast.commands.simulation.solver_steps import solver_steps
    from dielast.readings.read import read_all

    folder = scratch / "inputs"
    folder.mkdir(exist_ok=True)
    result = {}
    data_file, load_file = folder / "data.csv", folder / "load.csv"
    for path in (data_file, load_file):
        path.write_text("time [s],stretch [1]\n")

    def model(name: str, text: str, kind: str | None = None) -> object:
        recipe = folder / f"{name}.toml"
        recipe.write_text(text)
        return read_cases(recipe, kind or name, ())[0].recipe

    mastercurve = model(
        "mastercurve",
        'kind = "mastercurve"\n[data]\nfile = "data.csv"\n'
        'columns = { temperature = "temperature", time = "time", modulus = "modulus" }\n'
        '[shift]\nreference_temperature = "20 degC"\n',
    )
    assert isinstance(mastercurve, MasterCurveRecipe)

    def curves(data: bytes) -> object:
        data_file.write_bytes(data)
        return read_all(mastercurve.data, Inputs(folder)).measurements

    result["measurement"] = Target(
        "measurement", [(GOLDEN / "data" / "relaxation.csv").read_bytes()], curves, ["data.csv", "temperature", "-", *"0123456789"]
    )

    export_file = folder / "export.txt"
    exports = [path.read_bytes() for path in sorted((TOP / "tests" / "instruments").iterdir()) if path.is_file()]
    exports.append(REPTATE)
    export_file.write_bytes(exports[0])
    export = model(
        "export", 'kind = "mastercurve"\n[data]\nfile = "export.txt"\n[shift]\nreference_temperature = "20 degC"\n', "mastercurve"
    )
    assert isinstance(export, MasterCurveRecipe)

    def exported(data: bytes) -> object:
        export_file.write_bytes(data)
        return read_all(export.data, Inputs(folder)).measurements

    result["export"] = Target("export", exports, exported, ["export.txt", "there are "])

    relax = model("relax", 'kind = "relax"\nmaterial = "example:vhb4905.toml"\nmode = "uniaxial"\n[[step]]\ntable = "load.csv"\n')
    assert isinstance(relax, RelaxRecipe)

    def history(data: bytes) -> object:
        load_file.write_bytes(data)
        return solver_steps(relax, Inputs(folder))

    result["load-table"] = Target("load-table", [(GOLDEN / "data" / "stretch.csv").read_bytes()], history, ["load.csv", "step[0]"])
    return result | _machines(folder, model)


def _machines(folder: Path, model: Callable[..., Any]) -> dict[str, Target]:
    """Wide tables, a test at one temperature, and tables of a testing machine as loads and in comparisons."""
    from dielast.commands.simulation.compare import read_points
    from dielast.commands.simulation.solver_steps import solver_steps
    from dielast.commands.spectrum.sources import read_curve
    from dielast.readings.read import read_all

    wide_file, curve_file, machine_file = (folder / name for name in ("wide.csv", "curve.csv", "machine.csv"))
    for path in (wide_file, curve_file, machine_file):
        path.write_text("time [s],stretch [1]\n")
    specimen = 'specimen = { gauge_length = "80 mm", width = "6 mm", thickness = "0.5 mm" }\n'
    wide = model(
        "wide",
        'kind = "mastercurve"\n[data]\nfile = "wide.csv"\ncolumns = { time = "time", modulus = "E" }\n'
        '[shift]\nreference_temperature = "20 degC"\n',
        "mastercurve",
    )
    columns = 'columns = { time = "time", extension = "u", force = "F" }\n'
    curve = model(
        "curve",
        f'kind = "spectrum"\n[data]\nfile = "curve.csv"\nreference_temperature = "20 degC"\n{columns}{specimen}',
        "spectrum",
    )
    compare = f'[[compare]]\nfile = "machine.csv"\nx = "stretch_1 [1]"\ny = "nominal_stress_1 [Pa]"\n{columns}'
    machine = model(
        "machine",
        f'kind = "relax"\nmaterial = "example:vhb4905.toml"\n{specimen}[[step]]\ntable = "machine.csv"\n{columns}{compare}',
        "relax",
    )

    def read_wide(data: bytes) -> object:
        wide_file.write_bytes(data)
        return read_all(wide.data, Inputs(folder)).measurements

    def read_one(data: bytes) -> object:
        curve_file.write_bytes(data)
        return read_curve(curve.data, Inputs(folder))

    def read_machine(data: bytes) -> object:
        machine_file.write_bytes(data)
        return solver_steps(machine, Inputs(folder)), read_points(machine.compare[0], Inputs(folder), machine.specimen)

    return {
        "wide": Target("wide", WIDE, read_wide, ["wide.csv", "temperature", "-", *"0123456789"]),
        "curve": Target("curve", [MACHINE], read_one, ["curve.csv", "temperature", "-", *"0123456789"]),
        "machine": Target("machine", [MACHINE], read_machine, ["machine.csv", "step[0]"]),
    }


def _folders(scratch: Path) -> dict[str, Target]:
    """A folder that `mastercurve` wrote, with draws, one of whose files is damaged."""
    from dielast.handover.mastercurve_folder import CURVES, LAWS, read_master_curve

    expected = GOLDEN / "mastercurve-wlf" / "expected"
    whole = {name: (expected / name).read_bytes() for name in ("summary.toml", "mastercurve.csv", "shift-factors.csv")}
    drawn = dict(whole)
    drawn["summary.toml"] += b"\n[uncertainty]\ndraws = 3\nseed = 1\n"
    drawn[LAWS] = b"draw,C1 [1],C2 [K]\n0,13.7,187.1\n1,13.9,190.2\n4,13.2,183\n"
    drawn[CURVES] = (
        b"reduced_time [s],relaxation_modulus_0 [Pa],relaxation_modulus_1 [Pa],relaxation_modulus_4 [Pa]\n"
        b"1e-06,2.1e+07,2.2e+07,1.9e+07\n0.01,1.3e+06,1.31e+06,1.28e+06\n1,312000,309000,311000\n1e+06,81200,80900,81500\n"
    )

    def with_damaged(name: str, folder: Path) -> Callable[[bytes], object]:
        def read(data: bytes) -> object:
            (folder / name).write_bytes(data)
            draws = read_master_curve(folder.name, Inputs(folder.parent)).draws
            return draws and CurveDraws(draws.abscissa, draws.ordinates).deviations(draws.abscissa)

        return read

    result = {}
    for file in ("summary.toml", "mastercurve.csv", LAWS, CURVES):
        name = f"folder-{file.split('.')[0]}"
        folder = scratch / name / "shown"
        folder.mkdir(parents=True, exist_ok=True)
        for own, content in drawn.items():
            (folder / own).write_bytes(content)
        seeds = [drawn[file], whole[file]] if file == "summary.toml" else [drawn[file]]
        result[name] = Target(name, seeds, with_damaged(file, folder), ["shown/"])

    # whose law is a table
    folder, expected = scratch / "folder-shift-factors" / "shown", GOLDEN / "mastercurve-table" / "expected"
    shutil.copytree(expected, folder, dirs_exist_ok=True)
    name, factors = "folder-shift-factors", "shift-factors.csv"
    result[name] = Target(name, [(expected / factors).read_bytes()], with_damaged(factors, folder), ["shown/"])
    return result


def _draws(scratch: Path) -> dict[str, Target]:
    """The table of draws beside a material."""
    from dielast.commands.simulation.uncertainty import sample_of
    from dielast.commands.simulation.uncertainty_recipe import Uncertainty
    from dielast.handover.material_draws import draw_columns
    from dielast.handover.material_file import write_material
    from dielast.io.table import to_csv

    seeds, materials = [], {}
    laws = {"wlf": b"C1 [1]", "arrhenius": b"activation_energy [J/mol]", "table": b"log10_shift_factor"}
    for law in laws:
        material = parse_material((GOLDEN / "data" / f"{law}.toml").read_bytes(), f"{law}.toml")
        softer = replace(material, equilibrium_modulus=0.98 * material.equilibrium_modulus)
        seeds.append(to_csv(draw_columns(np.array([0, 1, 2, 5]), [material, softer, material, softer])))
        folder = scratch / "draws" / law
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "material.toml").write_bytes(write_material(material, draws="draws.csv"))
        (folder / "draws.csv").write_bytes(seeds[-1])
        materials[law] = material
    wanted = Uncertainty(draws=4, level=0.5)

    def read(data: bytes) -> object:
        law = next((law for law, header in laws.items() if header in data), "wlf")
        folder = scratch / "draws" / law
        (folder / "draws.csv").write_bytes(data)
        recipe = SimpleNamespace(material="material.toml", uncertainty=wanted)
        return sample_of(Case(recipe), materials[law], Inputs(folder))  # type: ignore[type-var]

    # too few draws are the recipe's own affair: it may ask for less
    return {"draws": Target("draws", seeds, read, ["uncertainty: draws.csv", "uncertainty.level: the "])}


def _kept(scratch: Path) -> dict[str, Target]:
    """What a run is compared with, and what an interrupted map left, which is taken for nothing if it is damaged."""
    from dielast.io.files import STORE
    from dielast.numerics.integrate import Status
    from dielast.report.golden import TOLERANCES, differences
    from dielast.sharing.kept import Kept, load as load_kept
    from dielast.simulate.map_plan import SolvedCells

    expected = GOLDEN / "failure-map-ramp" / "expected"
    result = {}

    def compared(name: str, folder: Path) -> Callable[[bytes], object]:
        def read(data: bytes) -> object:
            (folder / name).write_bytes(data)
            return differences(contents, folder, 1e-6)

        return read

    contents = {path.name: path.read_bytes() for path in sorted(expected.iterdir())}
    for file in ("failure-map.csv", "summary.toml", TOLERANCES):
        name = f"golden-{file.split('.')[0]}"
        folder = scratch / name
        shutil.copytree(expected, folder, dirs_exist_ok=True)
        result[name] = Target(name, [contents[file]], compared(file, folder), [str(folder)])

    store, key = scratch / "store" / STORE, "0123456789abcdef"
    store.parent.mkdir(exist_ok=True)
    times = {"breakdown": np.full(3, np.nan), "pull-in": np.array([1.0, 2.0, np.nan])}
    mode, status = np.array(["pull-in", "pull-in", "none"]), np.full(3, Status.COMPLETED)
    kept = {(first, first + 3): SolvedCells(times, mode, status) for first in (0, 3)}
    store.write_bytes(b"".join(Kept({"cells": kept}).pieces(key)))

    def load(data: bytes) -> object:
        store.write_bytes(data)
        return load_kept(store, key)[0]

    result["store"] = Target("store", [store.read_bytes()], load, [])
    return result
