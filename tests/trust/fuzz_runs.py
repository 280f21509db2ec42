"""What is fuzzed as a whole: runs of every command, with the recipe, its material and its data all at risk, up to the last byte.

An input is a bundle of files. Of their numbers one to three are made extreme and units are mistaken; no result may then hold NaN or
infinity, no figure may be lost, and every error is one that dielast raises on purpose.
"""

from __future__ import annotations

import contextlib
import os
import random
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from fuzz_targets import TOP, Target

from dielast.base.errors import InputError
from dielast.cli.run import compute
from dielast.commands.new import described, given, started
from dielast.commands.registry import COMMANDS, read_cases
from dielast.sharing.execution import Execution

RECIPE = "recipe.toml"
MARK = "#### "
EXAMPLES = TOP / "dielast" / "examples"
FILM = '[film]\nthickness = "0.5 mm"\nprestretch = 1.9\nrelax = "10 min"\n'
COLUMNS = 'columns = { temperature = "temperature", time = "time", modulus = "relaxation_modulus" }\n'
FAST = 'file = "fast.csv"\nspecimen = { gauge_length = "80 mm", width = "22 mm", thickness = "1 mm" }\n'
BODIES = {
    "relax": '[[step]]\nstretch = 2.0\nrate = "12.5 %/s"\n[[step]]\nhold = "2 h"\n',
    "creep": '[[step]]\nstress = "56.7 kPa"\nduration = "17 s"\n[[step]]\nhold = "6 h"\n',
    "actuate": f'{FILM}[[step]]\nvoltage = "4.5 kV"\nduration = "0.1 s"\n[[step]]\nhold = "1 h"\n[breakdown]\nfield = "40 MV/m"\n',
    "failure-map": f'horizon = "24 h"\n{FILM}[voltage]\nfrom = "3 kV"\nto = "5 kV"\npoints = 4\n[breakdown]\nfield = "40 MV/m"\n',
    "design": f'{FILM}[goal]\narea_strain = "20 %"\nat = "1 h"\nhorizon = "1 d"\n[breakdown]\nfield = "40 MV/m"\n',
    "mastercurve": f'[data]\nfile = "data.csv"\n{COLUMNS}ramp = "1 s"\n[shift]\nreference_temperature = "20 degC"\n',
    "spectrum": '[fit]\nmethod = "nnls"\nbranches = 12\n[material]\nJ_lim = { equilibrium = 110, nonequilibrium = 55 }\n',
    "calibrate": f'[[test]]\n{FAST}[free]\n"equilibrium.shear_modulus" = {{}}\n"nonequilibrium.scale" = {{}}\n[fit]\nstarts = 1\n',
    "lifetime": f'{FILM}[data]\nfile = "failures.csv"\n[fit]\nlaw = "inverse-power"\n',
    "measure": 'files = "example:photographs/photo-*.png"\ninterval = "8 s"\n',
}
DRAWS = "[uncertainty]\ndraws = 20\n"
SCATTER = f'{DRAWS}thickness = "2 %"\nbreakdown_field = {{ law = "weibull", shape = 20 }}\n'
MORE = {  # what a further input of the kind ends with
    "mastercurve": (DRAWS,),
    "actuate": (SCATTER, '[sweep]\ntemperature = ["10 degC", "20 degC"]\n'),
    "failure-map": (SCATTER,),
    "design": (SCATTER,),
    "calibrate": (DRAWS,),
    "lifetime": (DRAWS,),
}
SIZES = ("0", "-1", "1e9", "1e-9", "1e15", "1e-15", "1e30", "1e-30", "1e99", "1e-99", "1e200", "1e-320", "inf", "nan")
UNITS = {"mm": ("nm", "km", "m"), "kV": ("V", "GV", "nV"), "MPa": ("Pa", "GPa"), "kPa": ("uPa", "TPa"), "h": ("us", "d", "ns")}
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def bundle(files: Mapping[str, str]) -> bytes:
    """The files (name -> text) as one input."""
    return "".join(f"{MARK}{name}\n{text.rstrip()}\n" for name, text in files.items()).encode()


def extreme(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """One of the bundles with one to three numbers made extreme, of each file as often as of any other."""
    name, *others = rng.choice(seeds).decode().split(MARK)[1:]
    parts = [name, *others]
    for _ in range(rng.randint(1, 3)):
        place = rng.randrange(len(parts))
        head, _, text = parts[place].partition("\n")
        found = list(_NUMBER.finditer(text))
        if not found:
            continue
        number = rng.choice(found)
        after = text[number.end() :]
        unit = re.match(r" ([A-Za-z]+)", after)
        if unit and unit[1] in UNITS and rng.random() < 0.4:
            after = f" {rng.choice(UNITS[unit[1]])}{after[unit.end() :]}"
            new = number[0]
        elif rng.random() < 0.5:
            new = f"{float(number[0]) * 10.0 ** rng.choice((-30, -12, -6, -3, -1, 1, 3, 6, 12, 30)):.6g}"
        else:
            new = rng.choice(SIZES)
        parts[place] = f"{head}\n{text[: number.start()]}{new}{after}"
    return "".join(MARK + part for part in parts).encode()


class Run(Target):
    """Whole runs of a command in a folder of its own; a run that takes long may: its input may ask for much."""

    def __init__(self, kind: str, folder: Path, seeds: Sequence[bytes]) -> None:
        names = re.findall(rf"(?m)^{MARK}(.*)$", "".join(seed.decode() for seed in seeds))
        super().__init__(f"run-{kind}", seeds, self._run, [str(folder), *names])
        self.kind, self.folder = kind, folder
        self.late = 0

    def damaged(self, rng: random.Random) -> bytes:
        """A damaged input."""
        return extreme(self.seeds, rng)

    def wrong(self, data: bytes) -> str | None:
        """What is wrong with the way in which the run ends, if anything."""
        found = super().wrong(data)
        if found is not None and found.startswith(("no answer", "took")):
            self.late += 1
            return None
        return found

    def _run(self, data: bytes) -> None:
        for part in data.decode().split(MARK)[1:]:
            name, _, text = part.partition("\n")
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        recipe = self.folder / RECIPE
        cases = read_cases(recipe, self.kind, ())
        files, _, _, caught = compute(self.kind, cases, recipe, ("svg",), Execution())
        lost = [line for line in caught if "cannot be drawn" in line]
        if lost:
            raise AssertionError(lost[0])
        for name, content in files.items():
            if name.endswith((".csv", ".toml")) and (word := unsaid(content.decode())):
                raise AssertionError(f"{name} holds {word}")
        if (said := [line for line in caught if unsaid(line)]) and not re.search(r"(?i)\bnan|inf\b", data.decode()):
            raise AssertionError(f"a warning holds {said[0]}")


def unsaid(text: str) -> str:
    """The first number in a text that is not finite, with what is around it; empty if there is none."""
    found = re.search(r"(?<![\w'\"])[-+]?(?:nan|inf)(?![\w'\"-])", text)
    return "" if found is None else repr(text[max(0, found.start() - 40) : found.end() + 5])


def _golden(recipe: Path) -> bytes:
    """A recipe of the golden tests with the files that it names, and those that these name."""
    text, root = recipe.read_text("utf-8").replace('"../', '"'), recipe.parents[1]
    files = {RECIPE: text}
    for name in re.findall(r'"((?:data|mastercurve)[^"]*)"', text):
        found = sorted((root / name).glob("*.[ct]*")) if (root / name).is_dir() else sorted(root.glob(name))
        files |= {path.relative_to(root).as_posix(): path.read_text("utf-8") for path in found}
    if "data/history.toml" in files:
        files["data/voltage.csv"] = (root / "data" / "voltage.csv").read_text("utf-8")
    return bundle(files)


def runs(scratch: Path) -> dict[str, Target]:
    """The targets by name; their files lie in `scratch`."""
    golden = TOP / "tests" / "golden" / "data"
    laws = [path.read_text("utf-8") for path in (EXAMPLES / "vhb4905.toml", golden / "arrhenius.toml", golden / "neo-hookean.toml")]
    tensile, failures = (
        (EXAMPLES / name).read_text("utf-8").splitlines() for name in ("tensile/fast.csv", "lifetime/failures.csv")
    )
    examples = {
        "mastercurve": {"data.csv": (EXAMPLES / "relaxation-test.csv").read_text("utf-8")},
        "calibrate": {"fast.csv": "\n".join(tensile[::5])},  # few rows: a fit takes as long as all other runs
        "lifetime": {"failures.csv": "\n".join([failures[0], *failures[1::3]])},
        "spectrum": {
            f"curve/{name}": (EXAMPLES / "mastercurve" / name).read_text("utf-8")
            for name in ("summary.toml", "mastercurve.csv", "shift-factors.csv")
        },
    }
    result: dict[str, Target] = {}
    for kind in COMMANDS:
        seeds = []
        for law in laws[: 1 if kind == "lifetime" else None] if kind not in ("mastercurve", "spectrum", "measure") else [""]:
            material = 'material = "material.toml"\n' if law else 'mastercurve = "curve"\n' if kind == "spectrum" else ""
            head = f'kind = "{kind}"\n{material}'
            files = {**({"material.toml": law} if law else {}), **examples.get(kind, {})}
            seeds.append(bundle({RECIPE: head + BODIES[kind], **files}))
            seeds += [bundle({RECIPE: head + BODIES[kind] + more, **files}) for more in MORE.get(kind, ())]
        seeds += [_golden(recipe) for recipe in sorted(golden.parent.glob(f"{kind}-*/recipe.toml"))]
        folder = scratch / "runs" / kind
        folder.mkdir(parents=True, exist_ok=True)
        result[f"run-{kind}"] = Run(kind, folder, seeds)
    result["new-data"] = _new(scratch / "runs" / "new")
    return result


def _new(folder: Path) -> Target:
    """`new --data` for damaged files: a recipe of every kind or what they hold, which the commands then take or refuse."""
    folder.mkdir(parents=True, exist_ok=True)
    home = TOP / "tests"
    paths = [*(home / "instruments").glob("*.*"), *(home / "golden" / "data").glob("*.csv"), *EXAMPLES.rglob("*.csv")]
    names = [f"data{ending}" for ending in (".csv", ".txt")]

    def read(data: bytes) -> None:
        path = folder / names[len(data) % 2]
        path.write_bytes(data)
        here = Path.cwd()
        os.chdir(folder)
        try:
            text, doubts = described(given([path.name]))
            for kind in (kind for kind, command in COMMANDS.items() if command.takes_data):
                with contextlib.suppress(InputError):
                    text, further = started(kind, given([path.name]))
                    doubts = [*doubts, *further]
                    tomllib.loads(text)
        finally:
            os.chdir(here)
        if said := [line for line in doubts if unsaid(line)]:
            raise AssertionError(f"a doubt holds {said[0]}")

    return Target("new-data", [path.read_bytes() for path in sorted(paths)], read, [*names, "no "])
