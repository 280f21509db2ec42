"""Throw malformed input at everything that reads: `python tests/trust/fuzz.py --inputs 100000` (per target; `--help` for more).

Each input is a valid file that was damaged at random (`damage.py`). Whatever comes, a target (`fuzz_targets.py`) may succeed or
raise `InputError` or `NumericsError` with one-line messages that name a file first; within 10 s, within 1 GiB, and without a file
left behind. Whole runs (`fuzz_runs.py`) get extreme numbers instead, and may take longer. Inputs that break this are kept and
shown, with the slowest answer and the most memory that the process ever held.

With `--atheris` the damage is guided by coverage instead (package atheris, on request only), until the first fault or `--seconds`.
"""

from __future__ import annotations

import argparse
import gc
import importlib
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
from collections import Counter
from pathlib import Path
from types import FunctionType

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

from damage import damage
from fuzz_runs import runs
from fuzz_targets import Target, TooLate, targets

MEMORY = 1 << 30
GUIDING = ("dielast", "tomllib", "csv")  # modules whose coverage guides atheris: all that are loaded would take minutes
OWN = "recipes/recipe.toml"  # written by the targets themselves


def alarm(*_: object) -> None:
    """Called when a target has had its time."""
    raise TooLate


def prepare() -> None:
    """The limits of time and memory that hold for every input."""
    signal.signal(signal.SIGPROF, alarm)
    soft = resource.getrlimit(resource.RLIMIT_DATA)[1]
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, soft))


def litter(scratch: Path, before: set[Path]) -> list[str]:
    """Files that the target left behind."""
    return sorted(str(path.relative_to(scratch)) for path in set(scratch.rglob("*")) - before)


def _keep(folder: Path | None, name: str, data: bytes) -> None:
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def fuzz(target: Target, inputs: int, seed: int, show: int, keep: Path | None) -> int:
    """Try `inputs` damaged inputs; returns how many were dealt with wrongly."""
    rng = random.Random(f"{seed} {target.name}")
    faults: Counter[str] = Counter()
    slowest = 0.0
    begin = time.perf_counter()
    for _ in range(inputs):
        data = target.damaged(rng)
        thrown = time.perf_counter()
        wrong = target.wrong(data)
        slowest = max(slowest, time.perf_counter() - thrown)
        if wrong is None:
            continue
        kind = re.sub(r"\d+|'.*?'|\".*?\"", "#", wrong)
        faults[kind] += 1
        if faults[kind] == 1 and len(faults) <= show:
            print(f"  {target.name}: {wrong}\n    {data[:160]!r}", flush=True)
            _keep(keep, f"{target.name}-{len(faults)}", data)
    took = time.perf_counter() - begin
    print(
        f"{target.name:24} {inputs:8} inputs {took:7.0f} s   {sum(faults.values()):6} dealt with wrongly, {len(faults)} kinds   "
        f"slowest {slowest:.2f} s, {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10} MiB",
        flush=True,
    )
    return sum(faults.values())


def guided(target: Target, seconds: int, seed: int, keep: Path | None) -> int:
    """The same with atheris, in a process of its own, which ends at the first fault; returns whether there was one."""
    atheris = importlib.import_module("atheris")

    def once(data: bytes) -> None:
        wrong = target.wrong(data)
        if wrong is not None:
            _keep(keep, f"{target.name}-guided", data)
            raise RuntimeError(wrong)

    def mutate(data: bytes, longest: int, number: int) -> bytes:
        rng = random.Random(number)
        return bytes(atheris.Mutate(data, longest)) if rng.random() < 0.3 else damage([data], rng)[:longest]

    with tempfile.TemporaryDirectory() as corpus:
        for index, own in enumerate(target.seeds):
            (Path(corpus) / str(index)).write_bytes(own)
        process = os.fork()
        if process:
            return int(os.waitpid(process, 0)[1] != 0)
        try:
            for each in gc.get_objects():
                if isinstance(each, FunctionType) and str(each.__module__).startswith(GUIDING):
                    atheris.instrument_func(each)
            # atheris' own clock would stop that of the target
            settings = [f"-max_total_time={seconds}", f"-seed={seed}", "-timeout=0", "-max_len=20000"]
            atheris.Setup([sys.argv[0], *settings, f"-artifact_prefix={corpus}/", corpus], once, custom_mutator=mutate)
            atheris.Fuzz()
        except Exception:
            traceback.print_exc()
        finally:
            os._exit(1)  # Fuzz does not return


def main() -> None:
    """Run the targets that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", nargs="*", help="all if none is named")
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--show", type=int, default=20, help="kinds of faults to show for each target")
    parser.add_argument("--keep", type=Path, help="folder for the inputs that were dealt with wrongly")
    parser.add_argument("--atheris", action="store_true", help="guided by coverage")
    parser.add_argument("--seconds", type=int, default=300, help="how long, with --atheris, for each target")
    parser.add_argument("--list", action="store_true", help="list the targets")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        known = targets(scratch) | runs(scratch)
        if options.list:
            print(json.dumps(list(known)))
            return
        before = set(scratch.rglob("*"))
        prepare()
        total = 0
        for name in options.target or known:
            if options.atheris:
                total += guided(known[name], options.seconds, options.seed, options.keep)
            else:
                total += fuzz(known[name], options.inputs, options.seed, options.show, options.keep)
        left = [name for name in litter(scratch, before) if name != OWN and not name.startswith("runs/")]
        print(f"files left behind: {', '.join(left) or 'none'}")
        sys.exit(1 if total or left else 0)


if __name__ == "__main__":
    main()
