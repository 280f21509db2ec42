"""Run the recipes of this folder into build/, as `make` does and without it: python build.py [NAME...]

Only what changed is run again. A NAME is that of a recipe, or a pattern such as "fig13*" (quoted); what it needs is run before it.

    python build.py --dry-run    print the commands that would run
    python build.py --jobs 4     as many at a time
    python build.py --check      run every recipe anew, on fewer points, and print each cell that differs from golden/
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tomllib
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from fnmatch import fnmatch
from graphlib import TopologicalSorter
from pathlib import Path

import dielast

HERE = Path(__file__).parent
BUILD, GOLDEN = HERE / "build", HERE / "golden"
TABLES = {"table1": ("fig6", "table1-case2", "table1-case3", "table1-case4", "table1-case5")}
"""Scripts that put the results of several recipes side by side."""
COARSE = dict.fromkeys(("relax", "creep", "actuate"), ("--set", "output.points_per_decade=4"))
STATED_ELSEWHERE = re.compile(r'"build/([^/"]+)')


@dataclass(frozen=True)
class Task:
    """A recipe, or a script that makes a table, and the names of those whose results it reads."""

    name: str
    kind: str | None
    needs: tuple[str, ...]

    @property
    def source(self) -> Path:
        return HERE / f"{self.name}{'.py' if self.kind is None else '.toml'}"

    @property
    def rule(self) -> Path:
        """The dependency file, which names all results and every file that was read."""
        return BUILD / f"{self.name}.d"

    @property
    def command(self) -> list[str]:
        if self.kind is None:
            return [self.source.name, "-o", f"build/{self.name}", *(f"build/{need}" for need in self.needs)]
        return ["-m", "dielast", self.kind, self.source.name, "-o", f"build/{self.name}", "--depfile", f"build/{self.name}.d"]

    @property
    def check(self) -> list[str]:
        """The command that compares the recipe with its golden files."""
        assert self.kind is not None
        files = ["-o", f"build/check/{self.name}", "--golden", f"golden/{self.name}"]
        return ["-m", "dielast", self.kind, self.source.name, "--plot", "none", "--quiet", *COARSE.get(self.kind, ()), *files]

    def is_done(self) -> bool:
        """Whether all results are there, and none is older than a file that it depends on."""
        summary, inputs = BUILD / self.name / "summary.toml", [self.source]
        if self.kind is None:
            results, inputs = [summary], [self.source, *(BUILD / need / "summary.toml" for need in self.needs)]
        elif self.rule.is_file():
            results, inputs = (([HERE / name for name in names]) for names in read_rule(self.rule))
        else:
            return False
        code = Path(dielast.__file__).parent.rglob("*.py")
        if not all(path.is_file() for path in (summary, *results)):
            return False
        made = summary.stat().st_mtime_ns
        return all(path.is_file() and path.stat().st_mtime_ns <= made for path in (*inputs, *code))


def read_rule(path: Path) -> tuple[list[str], list[str]]:
    """The targets and the dependencies of a dependency file."""
    text = path.read_text(encoding="utf-8", errors="surrogateescape").split("\n\n")[0].replace("\\\n", " ")
    targets, _, needed = text.partition(": ")
    names = (re.findall(r"(?:\\.|[^\s\\])+", part) for part in (targets, needed))
    first, second = ([re.sub(r"\\(.)", r"\1", name).replace("$$", "$") for name in part] for part in names)
    return first, second


def all_tasks() -> dict[str, Task]:
    """Every recipe of this folder, and every table, by name."""
    tasks = {name: Task(name, None, needs) for name, needs in TABLES.items() if (HERE / f"{name}.py").is_file()}
    for path in sorted(HERE.glob("*.toml")):
        text = path.read_text(encoding="utf-8")
        if kind := tomllib.loads(text).get("kind"):
            needs = dict.fromkeys(STATED_ELSEWHERE.findall(text))
            tasks[path.stem] = Task(path.stem, kind, tuple(needs))
    return tasks


def wanted(tasks: dict[str, Task], names: list[str]) -> dict[str, Task]:
    """The tasks that the names and patterns ask for, after all that they need."""
    patterns = [name.removesuffix(".toml") for name in names] or ["*"]
    unknown = [pattern for pattern in patterns if not any(fnmatch(name, pattern) for name in tasks)]
    if unknown:
        raise SystemExit(f"{', '.join(unknown)}: no such recipe; there are {', '.join(tasks)}")
    chosen: dict[str, Task] = {}

    def choose(name: str) -> None:
        if name not in chosen:
            for need in tasks[name].needs:
                choose(need)
            chosen[name] = tasks[name]

    for name in tasks:
        if any(fnmatch(name, pattern) for pattern in patterns):
            choose(name)
    return chosen


def run(command: list[str]) -> int:
    """Print a command, and run it by this Python."""
    print(" ".join(command).removeprefix("-m "), flush=True)
    return subprocess.run([sys.executable, *command], cwd=HERE, check=False).returncode


def build(tasks: dict[str, Task], jobs: int, dry: bool) -> int:
    """Run what is not done, in order, until something fails; returns its exit code, or 0."""
    graph = TopologicalSorter({name: task.needs for name, task in tasks.items()})
    graph.prepare()
    redone: set[str] = set()
    running: dict[Future[int], str] = {}
    with ThreadPoolExecutor(jobs) as pool:
        while graph.is_active():
            for name in graph.get_ready():
                task = tasks[name]
                if redone.isdisjoint(task.needs) and task.is_done():
                    graph.done(name)
                elif dry:
                    print(" ".join(task.command).removeprefix("-m "))
                    redone.add(name)
                    graph.done(name)
                else:
                    task.rule.unlink(missing_ok=True)  # until the run is over, its result is not a whole one
                    redone.add(name)
                    running[pool.submit(run, task.command)] = name
            if running:
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    name = running.pop(future)
                    if code := future.result():
                        return code
                    graph.done(name)
    return 0


def check(tasks: dict[str, Task], jobs: int) -> int:
    """Compare every recipe with its golden files; returns the exit code of the first that differs, or 0."""
    with ThreadPoolExecutor(jobs) as pool:
        codes = list(pool.map(run, [task.check for task in tasks.values() if task.kind is not None]))
    return next(filter(None, codes), 0)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--dry-run", action="store_true")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    tasks = wanted(all_tasks(), options.names)
    BUILD.mkdir(exist_ok=True)
    return build(tasks, options.jobs, options.dry_run) or (check(tasks, options.jobs) if options.check else 0)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except BrokenPipeError:  # as head leaves it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
