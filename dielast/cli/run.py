"""Run a recipe: check, compute, write, compare, report."""

import gc
import json
import math
import os
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dielast import __version__
from dielast.base.errors import DielastError, DielastWarning, InputError, listed, messages_of
from dielast.cli.terminal import Bar, leave, working
from dielast.commands.registry import COMMANDS, others_in, read_cases
from dielast.io.files import STORE, Inputs, as_text, check_folder, check_targets, depfile, read_file, write_files
from dielast.io.manifest import SUMMARY
from dielast.io.spool import Content
from dielast.recipe.cases import Case, settings
from dielast.report.report import RecipeSource, drawn, left_over, summarise, with_warnings, written
from dielast.report.summary import print_summary
from dielast.sharing.execution import EARLIER, NOTHING_KEPT, Execution

UNFINISHED = 3
GOLDEN_MISMATCH = 4
WRITTEN = "the results are written"
MIXED = "{} holds files of this run beside those of an earlier one: run it again"


@dataclass(frozen=True, slots=True)
class Options:
    """The options of a run, as the command line gives them."""

    out: Path | None = None
    plots: Sequence[str] = ("png",)
    overrides: Sequence[str] = ()
    golden: Path | None = None
    rtol: float = 1e-6
    depfile: Path | None = None
    jobs: int = 1
    json: bool = False
    quiet: bool = False
    scheduler: str | None = None


def run(kind: str, path: Path, options: Options) -> int:
    """Run the recipe in `path`, write its results, and return the exit code; raises `InputError` and `NumericsError`."""
    _check_scheduler(kind, options)
    content = read_file(path, str(path))
    cases = read_cases(path, kind, options.overrides, content)
    out = options.out or Path(path.stem)
    check_folder(out, "for the results is needed (see --out)")
    check_targets([out / STORE], [])
    if options.depfile is not None:
        check_folder(options.depfile.parent, "is needed (see --depfile)")
        check_targets([options.depfile], [path])
        depfile([out / STORE], [path])  # names that make cannot hold are refused before the computation
    if options.golden is not None:
        _check_golden(options.golden, out, options.rtol)
    bar = Bar(options.quiet, options.jobs)
    execution = Execution(options.jobs, out, bar, options.scheduler, None if options.quiet else _print_note, leave.keep)
    source = RecipeSource(as_text(path.name), content, settings(options.overrides, type(cases[0].recipe)))
    leave.keep(EARLIER if (out / STORE).is_file() else NOTHING_KEPT)
    try:
        files, summary, inputs, caught = compute(kind, cases, path, options.plots, execution, source)
    finally:
        bar.stop()
    _write(out, files, path, inputs, options.depfile)
    if options.json:
        print(json.dumps(summary, indent=2, allow_nan=False))
    elif not options.quiet:
        print_summary(summary, out)
    sys.stdout.flush()
    for message in caught:
        print(f"warning: {message}", file=sys.stderr)
    if old := left_over(out, COMMANDS[kind].files, kind, files):
        verbs = "is from an earlier run and was" if len(old) == 1 else "are from an earlier run and were"
        print(f"warning: {out}: {', '.join(old)} {verbs} not renewed", file=sys.stderr)
    if others := others_in(out, kind):
        print(
            f"warning: {out}: holds results of {' and '.join(others)}, too: summary.toml is now that of this run", file=sys.stderr
        )
    for line in summary.get("unfinished", ()):
        print(f"{path}: {line}", file=sys.stderr)
    mismatch = _compare(files, options) if options.golden is not None else 0
    if "interrupted" in summary:
        return leave.code
    return UNFINISHED if "unfinished" in summary else mismatch


def foretell(kind: str, path: Path, overrides: Sequence[str], jobs: int) -> int:
    """Print what the recipe in `path` amounts to and how long it takes here, measured without writing anything."""
    from dielast.commands.plan import extent, measured

    cases = read_cases(path, kind, overrides)
    with working():
        try:
            parts = [extent(cases), measured(kind, cases, path, jobs)]
        except DielastError as error:
            raise error.at(file=path) from None
    print(f"{path}: {'; '.join(filter(None, parts))}")
    return 0


def compute(
    kind: str,
    cases: Sequence[Case[Any]],
    path: Path,
    plots: Sequence[str],
    execution: Execution,
    source: RecipeSource | None = None,
) -> tuple[dict[str, Content], Mapping[str, Any], Inputs, list[str]]:
    """Every file of the result (name -> bytes), its summary with the `source`, the inputs, and the warnings."""
    import tomli_w

    inputs = Inputs(path.parent)
    run_cases = COMMANDS[kind].run
    gc.enable()
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", DielastWarning)
        try:
            with working():
                report = run_cases(cases, inputs, execution)
        except DielastError as error:
            located = error.at(file=path)
            for message in messages_of(record):  # a warning may state the cause
                located.add_note(f"warning: {message}")
            raise located from None
        if plots:
            import logging  # imported here, as runs without figures do not need it

            logging.getLogger("matplotlib").setLevel(logging.ERROR)  # no messages about the folder of its cache
            _import_matplotlib()
        files = written(report)
        plain = summarise(kind, report, files, inputs, source or RecipeSource(as_text(path.name)), __version__)
        figures = drawn(kind, report, plots, plain)
    caught = messages_of(record)
    summary = with_warnings(plain, caught)
    # the summary is written last: a folder with a summary holds a complete result
    return files | {**figures, SUMMARY: tomli_w.dumps(summary).encode()}, summary, inputs, caught


def _import_matplotlib() -> None:
    """Import matplotlib without the docstrings that it writes for its classes: a fifth of the time, and nobody reads them here."""
    from matplotlib import artist

    written = (artist.Artist, "_update_set_signature_and_docstring"), (artist, "kwdoc")
    if "matplotlib.figure" in sys.modules or not all(hasattr(*place) for place in written):
        return
    before = [vars(thing)[name] for thing, name in written]
    for (thing, name), instead in zip(written, (classmethod(lambda cls: None), lambda _: ""), strict=True):
        setattr(thing, name, instead)
    try:
        import matplotlib.figure  # noqa: F401
    finally:
        for (thing, name), original in zip(written, before, strict=True):
            setattr(thing, name, original)


def _write(out: Path, files: Mapping[str, Content], recipe: Path, inputs: Inputs, rule: Path | None) -> None:
    """Write the result into the folder `out`, and the make `rule` if there is to be one; raises `InputError`."""
    results, read = [out / name for name in files], [recipe, *inputs.paths]
    check_targets(results + ([rule] if rule is not None else []), read)
    content = depfile(results, read).encode("utf-8", "surrogateescape") if rule is not None else b""
    with working():
        write_files(out, files, lambda whole: leave.keep(WRITTEN if whole else MIXED.format(out)))
        (out / STORE).unlink(missing_ok=True)
        if rule is not None:
            write_files(rule.parent, {rule.name: content})


def _check_scheduler(kind: str, options: Options) -> None:
    """Raise `InputError` for a scheduler that the run cannot use."""
    if options.scheduler is None:
        return
    if not COMMANDS[kind].can_share:
        kinds = listed((name for name, command in COMMANDS.items() if command.can_share), "and")
        raise InputError(f"--scheduler: only {kinds} can run on a cluster: leave the option out for {kind}")
    if options.jobs != 1:
        raise InputError("--jobs and --scheduler exclude each other: the cluster sets the number of processes")


def _check_golden(golden: Path, out: Path, rtol: float) -> None:
    """Raise `InputError` before anything is computed if there is nothing to compare with, or the result would overwrite it."""
    from dielast.report.golden import golden_files

    golden_files(golden)
    if math.isnan(rtol):
        raise InputError("--rtol: nan: a number of at least 0 is needed")
    if os.path.realpath(golden) == os.path.realpath(out):
        raise InputError("the result would overwrite the golden files; write it to another folder (see --out)", file=golden)


def _print_note(line: str) -> None:
    """Print a line about the run, which is not a part of its result."""
    print(f"note: {line}", file=sys.stderr)


def _compare(files: Mapping[str, Content], options: Options) -> int:
    from dielast.report.golden import differences, foreign

    assert options.golden is not None
    lines = differences(files, options.golden, options.rtol)
    for line in lines:
        print(line, file=sys.stderr)
    if lines:
        count = "1 difference" if len(lines) == 1 else f"{len(lines)} differences"
        print(f"{count} from {options.golden} beyond a relative {options.rtol:g}", file=sys.stderr)
    if mixed := foreign(options.golden):
        print(f"warning: {options.golden}: {mixed}", file=sys.stderr)
    return GOLDEN_MISMATCH if lines else 0
