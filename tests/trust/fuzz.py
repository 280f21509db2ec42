"""Throw malformed input at everything that reads: `python tests/trust/fuzz.py --inputs 100000` (per target; `--help` for more).

Each input is a valid file that was damaged at random: bytes flipped, lines moved, numbers and words made absurd, structure nested
or repeated. Whatever comes, a target may succeed or raise `InputError` or `NumericsError` with one-line messages that name a file
first; within 10 s, within 1 GiB, and without a file left behind. Inputs that break this are kept and shown.

With `--atheris` the damage is guided by coverage instead (package atheris, on request only).
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

from dielast.errors import DielastError, DielastWarning
from dielast.files import Inputs
from dielast.measured import read_measured
from dielast.recipe.cases import read_cases
from dielast.recipe.material import parse_material
from dielast.units import STRESS, TEMPERATURE, TIME

SECONDS = 10
MEMORY = 1 << 30
TOP = Path(__file__).resolve().parents[2]
GOLDEN = TOP / "tests" / "golden"
KINDS = ("mastercurve", "spectrum", "relax", "creep", "actuate", "failure-map")

NUMBERS, WORDS = ((Path(__file__).parent / name).read_text("utf-8").splitlines() for name in ("numbers.txt", "words.txt"))
BYTES = (b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\r\n", b"\t", *(bytes([mark]) for mark in b";,\"'[]{}#=.\xb5\\"))


def damage(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """One of the seeds, damaged in one to four places."""
    data = rng.choice(seeds)
    for _ in range(rng.randint(1, 4)):
        data = rng.choice(DAMAGES)(data, seeds, rng)
        if len(data) > 200_000:
            data = data[:200_000]
    return data


def _span(data: bytes, rng: random.Random) -> tuple[int, int]:
    first = rng.randrange(len(data) + 1)
    return first, min(len(data), first + rng.choice((1, 2, 5, 20, 100)))


def _flip(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    if not data:
        return b"\x80"
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]


def _insert(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(BYTES) * rng.choice((1, 1, 2, 3)) + data[at:]


def _cut(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    first, end = _span(data, rng)
    return data[:first] + data[end:]


def _double(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    first, end = _span(data, rng)
    return data[:end] + data[first:end] * rng.choice((1, 1, 2, 3000)) + data[end:]


def _truncate(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _lines(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    choice = rng.randrange(4)
    if choice == 0:
        lines[i], lines[j] = lines[j], lines[i]
    elif choice == 1:
        lines.insert(i, lines[j])
    elif choice == 2:
        del lines[i]
    else:
        other = rng.choice(seeds).split(b"\n")
        lines[i:i] = other[rng.randrange(len(other)) :][: rng.randint(1, 6)]
    return b"\n".join(lines)


def _token(pattern: bytes, substitutes: Sequence[str]) -> Callable[[bytes, Sequence[bytes], random.Random], bytes]:
    found_by = re.compile(pattern)

    def change(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
        found = list(found_by.finditer(data))
        if not found:
            return data
        match = rng.choice(found)
        return data[: match.start()] + rng.choice(substitutes).encode() + data[match.end() :]

    return change


def _nest(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    at, depth = rng.randrange(len(data) + 1), rng.choice((5, 200, 3000))
    opening, closing = rng.choice(((b"[", b"]"), (b"{a=", b"}"), (b"a.", b""), (b"(", b")"), (b'"', b'"')))
    return data[:at] + opening * depth + closing * rng.choice((0, depth)) + data[at:]


def _encode(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    return data.decode("utf-8", "replace").encode(rng.choice(("utf-16", "utf-16-le", "utf-8-sig", "cp1252", "utf-32")), "replace")


def _marks(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    return data.replace(
        *rng.choice(((b".", b","), (b",", b";"), (b",", b"\t"), (b"[", b"("), (b"=", b"=="), (b"\n", b"\r"), (b" ", b"")))
    )


DAMAGES = (
    _flip,
    _insert,
    _cut,
    _double,
    _truncate,
    _lines,
    _lines,
    _token(rb"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?", NUMBERS),
    _token(rb"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?", NUMBERS),
    _token(rb'"[^"\n]*"', WORDS),
    _token(rb'"[^"\n]*"', WORDS),
    _token(rb"[A-Za-z_]{3,}", ("", "kind", "step", "data", "file", "s", "MPa", "nan", "time", "temperature", "__class__")),
    _nest,
    _encode,
    _marks,
)


class Target:
    """Something that reads bytes; `seeds` are valid ones, and `read` writes into no folder but its own."""

    def __init__(self, name: str, seeds: Sequence[bytes], read: Callable[[bytes], object], shown: Sequence[str]) -> None:
        self.name, self.seeds, self.read = name, list(seeds), read
        self.shown = tuple(shown)  # how messages may begin

    def wrong(self, data: bytes) -> str | None:
        """What is wrong with the way in which the target deals with `data`, if anything."""
        begin = time.perf_counter()
        signal.alarm(SECONDS)
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
        except TimeoutError:
            return f"no answer within {SECONDS} s"
        except MemoryError:
            return "out of memory"
        except BaseException as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            return f"{type(error).__name__}: {str(error)[:200]} ({Path(frame.filename).name}:{frame.lineno})"
        finally:
            signal.alarm(0)
        took = time.perf_counter() - begin
        return f"took {took:.1f} s" if took > SECONDS else None


def targets(scratch: Path) -> dict[str, Target]:
    """All targets by name; their files lie in `scratch`."""
    starters = {kind: (TOP / "dielast" / "starters" / f"{kind}.toml").read_bytes() for kind in KINDS}
    golden = {kind: [path.read_bytes() for path in sorted(GOLDEN.glob(f"{kind}-*/recipe.toml"))] for kind in KINDS}
    for folder in ("data", "mastercurve-wlf"):
        if not (scratch / folder).exists():
            (scratch / folder).symlink_to(GOLDEN / folder)
    (scratch / "recipes").mkdir(exist_ok=True)
    recipe = scratch / "recipes" / "recipe.toml"
    result = {}

    def reads(kind: str) -> Callable[[bytes], object]:
        def read(data: bytes) -> object:
            recipe.write_bytes(data)
            return read_cases(recipe, kind, ())

        return read

    for kind in KINDS:
        result[f"recipe-{kind}"] = Target(
            f"recipe-{kind}", [starters[kind], *golden[kind]], reads(kind), [str(recipe), "example:", "../", "/"]
        )

    kept = scratch / "recipes" / "kept.toml"
    kept.write_bytes(starters["actuate"])
    overrides = [
        b"step.0.voltage=3 kV",
        b"film.prestretch=[3.0, 1.0]",
        b"step.1.hold='2 min'",
        b'breakdown.field="40 MV/m"',
        b"pull_in.timescale=0 s",
        b"sweep.'film.thickness'=['1 mm']",
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
    materials = [path.read_bytes() for path in sorted((GOLDEN / "data").glob("*.toml")) if path.name != "history.toml"]
    result["material"] = Target("material", materials, lambda data: parse_material(data, "material.toml"), ["material.toml"])

    tables = [path.read_bytes() for path in sorted((GOLDEN / "data").glob("*.csv"))]

    def table(data: bytes) -> object:
        found = read_measured(data, "data.csv")
        for index, dimension in enumerate((TEMPERATURE, TIME, STRESS)[: len(found.names)], start=1):
            found.column(index, "any", dimension)
        return found

    result["csv"] = Target("csv", tables, table, ["data.csv"])
    result.update(_runs(scratch))
    return result


def _runs(scratch: Path) -> dict[str, Target]:
    """Targets that read damaged data through a sound recipe, as far as the numbers that are computed with."""
    from dielast.recipe.mastercurve import MasterCurveRecipe
    from dielast.recipe.simulation import RelaxRecipe
    from dielast.workflow.history import solver_steps
    from dielast.workflow.measurements import read_curves, read_measurements
    from dielast.workflow.spectrum import read_master_curve

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
        return read_curves(mastercurve.data, Inputs(folder))

    result["measurement"] = Target(
        "measurement", [(GOLDEN / "data" / "relaxation.csv").read_bytes()], curves, ["data.csv", "temperature", "-", *"0123456789"]
    )

    export_file = folder / "export.txt"
    exports = [path.read_bytes() for path in sorted((TOP / "tests" / "instruments").iterdir()) if path.is_file()]
    export_file.write_bytes(exports[0])
    export = model(
        "export", 'kind = "mastercurve"\n[data]\nfile = "export.txt"\n[shift]\nreference_temperature = "20 degC"\n', "mastercurve"
    )
    assert isinstance(export, MasterCurveRecipe)

    def exported(data: bytes) -> object:
        export_file.write_bytes(data)
        return read_measurements(export.data, Inputs(folder))

    result["export"] = Target("export", exports, exported, ["export.txt", "there are "])

    relax = model("relax", 'kind = "relax"\nmaterial = "example:vhb4905.toml"\nmode = "uniaxial"\n[[step]]\ntable = "load.csv"\n')
    assert isinstance(relax, RelaxRecipe)

    def history(data: bytes) -> object:
        load_file.write_bytes(data)
        return solver_steps(relax, Inputs(folder))

    result["load-table"] = Target("load-table", [(GOLDEN / "data" / "stretch.csv").read_bytes()], history, ["load.csv", "step[0]"])

    shown = folder / "shown"
    shown.mkdir(exist_ok=True)
    expected = GOLDEN / "mastercurve-wlf" / "expected"
    whole = {name: (expected / name).read_bytes() for name in ("summary.toml", "mastercurve.csv", "shift-factors.csv")}

    for own, content in whole.items():
        (shown / own).write_bytes(content)

    def master(name: str) -> Callable[[bytes], object]:
        def read(data: bytes) -> object:
            for own, content in whole.items():
                (shown / own).write_bytes(data if own == name else content)
            return read_master_curve("shown", Inputs(folder))

        return read

    for name in ("summary.toml", "mastercurve.csv"):
        result[f"folder-{name.split('.')[0]}"] = Target(f"folder-{name}", [whole[name]], master(name), ["shown/"])
    return result


def _alarm(*_: object) -> None:
    raise TimeoutError


def prepare() -> None:
    """The limits of time and memory that hold for every input."""
    signal.signal(signal.SIGALRM, _alarm)
    soft = resource.getrlimit(resource.RLIMIT_DATA)[1]
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, soft))


def litter(scratch: Path, before: set[Path]) -> list[str]:
    """Files that the target left behind."""
    return sorted(str(path.relative_to(scratch)) for path in set(scratch.rglob("*")) - before)


def fuzz(target: Target, inputs: int, seed: int, show: int, keep: Path | None) -> int:
    """Try `inputs` damaged inputs; returns how many were dealt with wrongly."""
    rng = random.Random(f"{seed} {target.name}")
    faults: Counter[str] = Counter()
    begin = time.perf_counter()
    for _ in range(inputs):
        data = damage(target.seeds, rng)
        wrong = target.wrong(data)
        if wrong is None:
            continue
        kind = re.sub(r"\d+|'.*?'|\".*?\"", "#", wrong)
        faults[kind] += 1
        if faults[kind] == 1 and len(faults) <= show:
            print(f"  {target.name}: {wrong}\n    {data[:160]!r}", flush=True)
            if keep is not None:
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{target.name}-{len(faults)}").write_bytes(data)
    took = time.perf_counter() - begin
    print(
        f"{target.name:24} {inputs:8} inputs {took:7.0f} s   {sum(faults.values()):6} dealt with wrongly, {len(faults)} kinds",
        flush=True,
    )
    return sum(faults.values())


def guided(target: Target, inputs: int) -> None:
    """The same with atheris, which ends the process at the first fault."""
    import atheris  # type: ignore[import-not-found, unused-ignore]

    def once(data: bytes) -> None:
        wrong = target.wrong(data)
        if wrong is not None:
            raise RuntimeError(wrong)

    with tempfile.TemporaryDirectory() as corpus:
        for index, seed in enumerate(target.seeds):
            (Path(corpus) / str(index)).write_bytes(seed)
        atheris.instrument_all()
        atheris.Setup([sys.argv[0], f"-runs={inputs}", "-max_len=20000", "-timeout=30", corpus], once)
        atheris.Fuzz()


def main() -> None:
    """Run the targets that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", nargs="*", help="all if none is named")
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--show", type=int, default=20, help="kinds of faults to show for each target")
    parser.add_argument("--keep", type=Path, help="folder for the inputs that were dealt with wrongly")
    parser.add_argument("--atheris", action="store_true", help="guided by coverage, one target")
    parser.add_argument("--list", action="store_true", help="list the targets")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        known = targets(scratch)
        if options.list:
            print(json.dumps(list(known)))
            return
        before = set(scratch.rglob("*"))
        prepare()
        total = 0
        for name in options.target or known:
            if options.atheris:
                guided(known[name], options.inputs)
            else:
                total += fuzz(known[name], options.inputs, options.seed, options.show, options.keep)
        left = [name for name in litter(scratch, before) if name != "recipes/recipe.toml"]
        print(f"files left behind: {', '.join(left) or 'none'}")
        sys.exit(1 if total or left else 0)


if __name__ == "__main__":
    main()
