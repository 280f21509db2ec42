"""The commands and their options."""

import sys
from collections.abc import Callable
from enum import StrEnum
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from dielast.base.errors import InputError, NumericsError, Problem, listed, nearest, shown
from dielast.base.registry import blame
from dielast.cli.help import EXIT_CODES, START, PlainUsage, RecipeCommand
from dielast.cli.terminal import give_up_output, is_unread, leave, report_refusal
from dielast.commands.registry import COMMANDS


class PlotFormat(StrEnum):
    """Formats a plot can be written in."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"
    NONE = "none"


def _path(text: str) -> Path:
    """The path; empty text, as from an unset shell variable, is refused, as it would mean the current folder."""
    if not text:
        raise typer.BadParameter("is empty, a name is needed")
    return Path(text)


Recipe = Annotated[Path, typer.Argument(metavar="RECIPE.toml", help="The recipe to run.", hidden=True)]
Out = Annotated[
    Path | None,
    typer.Option("-o", "--out", metavar="DIR", parser=_path, help="Folder for the results; by default the recipe's name."),
]
Plot = Annotated[
    list[PlotFormat] | None, typer.Option("--plot", metavar="FORMAT", help="png (default), svg, pdf or none; repeatable.")
]
Set = Annotated[
    list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Set a key of the recipe, such as step.0.rate; repeatable.")
]
Golden = Annotated[
    Path | None, typer.Option("--golden", metavar="DIR", parser=_path, help="Compare every number with an earlier result.")
]
Rtol = Annotated[float, typer.Option("--rtol", metavar="NUMBER", help="Relative tolerance of --golden.", min=0.0)]
Depfile = Annotated[Path | None, typer.Option("--depfile", metavar="FILE", parser=_path, help="Write a make dependency file.")]
Jobs = Annotated[
    int,
    typer.Option(
        "--jobs",
        metavar="N",
        help="Processes that share the cells of a map or the cases of a sweep; the result is the same.",
        min=1,
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Address of a Dask scheduler, or its .json file, that shares the work; the result is the same.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]
Plan = Annotated[bool, typer.Option("--plan", help="Print how much there is to do and how long it takes here; write nothing.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No summary, no progress.")]


def _exits(command: Callable[..., int]) -> Callable[..., None]:
    """The `command`, ending with the exit code that it returns; every error is one line on standard error."""

    @wraps(command)
    def run(*arguments: Any, **options: Any) -> None:
        try:
            code = command(*arguments, **options)
            sys.stdout.flush()
        except (InputError, NumericsError) as error:
            for line in (*getattr(error, "__notes__", ()), *error.messages):
                print(line, file=sys.stderr)
            code = 3 if isinstance(error, NumericsError) else 2
        except KeyboardInterrupt:
            print(leave.message(), file=sys.stderr)
            code = leave.code
        except MemoryError:
            from dielast.sharing.memory import OUT_OF_MEMORY

            print(OUT_OF_MEMORY, file=sys.stderr)
            code = 3
        except UnicodeEncodeError as error:
            about = error.object[max(0, error.start - 40) : error.end + 40]
            print(f"a path or a value has a character that this locale cannot write: {about!a}", file=sys.stderr)
            code = 2
        except OSError as error:
            if is_unread(error):
                give_up_output()  # the reader of standard output has gone
                code = 0
            else:
                code = report_refusal(error)
        except (Exception, SystemExit) as error:
            if not (line := blame(error)):
                raise
            print(line, file=sys.stderr)
            code = 2
        raise typer.Exit(code)

    return run


@_exits
def _run(
    context: typer.Context,
    recipe: Recipe,
    out: Out = None,
    plot: Plot = None,
    set_: Set = None,
    golden: Golden = None,
    rtol: Rtol = 1e-6,
    depfile: Depfile = None,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    plan: Plan = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    from dielast.cli.run import Options, foretell, run

    if plan:
        return foretell(str(context.info_name), recipe, set_ or (), jobs)

    formats = tuple(dict.fromkeys(form.value for form in plot or [PlotFormat.PNG] if form is not PlotFormat.NONE))
    options = Options(out, formats, tuple(set_ or ()), golden, rtol, depfile, jobs, json, quiet, scheduler)
    return run(str(context.info_name), recipe, options)


def _kinds(incomplete: str) -> list[str]:
    """The kinds that begin with `incomplete`, for completion in a shell."""
    return [kind for kind in COMMANDS if kind.startswith(incomplete)]


@_exits
def _new(
    words: Annotated[list[str] | None, typer.Argument(metavar="KIND", autocompletion=_kinds, hidden=True)] = None,
    data: Annotated[
        list[str] | None,
        typer.Option(
            "--data",
            metavar="FILE...",
            help="The recipe for these files: tables, exports of instruments, photographs; without KIND, what they hold.",
        ),
    ] = None,
) -> int:
    first, *others = words or [""]
    kind, names = (first, others) if first in COMMANDS else ("", words or [])
    if data is None:
        if not first:
            raise InputError(f"dielast new: a kind is needed: {', '.join(COMMANDS)}; or --data FILE (see dielast new --help)")
        if not kind or others:
            wrong = others[0] if kind else first
            if wrong in COMMANDS:
                raise InputError(f"{' and '.join(words or [])} are stated: one kind is needed")
            raise InputError(f"{shown(wrong)} is no kind of recipe: {nearest(wrong, COMMANDS)}")
        sys.stdout.write(COMMANDS[kind].starter())
        return 0
    from dielast.commands.new import described, given, started

    files = given([*data, *names])
    text, doubts = started(kind, files) if kind else described(files)
    sys.stdout.write(text)
    sys.stdout.flush()
    for doubt in doubts:
        print(f"warning: {doubt}", file=sys.stderr)
    return 0


@_exits
def _validate(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", hidden=True)],
    plan: Annotated[bool, typer.Option("--plan", help="Say how much each recipe has to do and how long it takes here.")] = False,
) -> int:
    """Check recipes and the files they name.

    Nothing is simulated or written; spectrum recipes are fitted to check them.
    Load files and material files can be checked by themselves.
    """
    from dielast.commands.plan import amount_of, warnings_of

    mistakes: list[Problem] = []
    for path in files:
        try:
            caught = warnings_of(path)
        except InputError as error:
            mistakes += error.problems
            continue
        amount = amount_of(path, plan) if plan or sys.stderr.isatty() else ""
        print(f"{path}: ok", flush=True)
        if amount:
            print(f"note: {path}: {amount}", file=sys.stderr)
        for message in caught:
            print(f"warning: {path}: {message}", file=sys.stderr)
    if mistakes:
        # a load file may be stated by itself and by a recipe
        raise InputError(*{str(problem): problem for problem in mistakes}.values())
    return 0


@_exits
def _report(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER...", parser=_path, hidden=True)],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="FILE", parser=_path, show_default="report.html", help="The page.")
    ] = Path("report.html"),
) -> int:
    """Put results on one HTML page that needs no other file.

    Figures, headline numbers, tables, warnings and inputs of each folder; a
    folder follows those it was made from. Long tables are shortened.
    """
    from dielast.io.files import check_folder, check_targets, write_files
    from dielast.report.chain import outdated, read_results
    from dielast.report.page import html_page

    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError("a report is HTML: a name such as report.html is needed (see --out)", file=out)
    check_folder(out.parent, "for the report is needed (see --out)")
    results = read_results(folders, {kind: command.files for kind, command in COMMANDS.items()})
    check_targets([out], [path for result in results for path in result.paths])
    page = html_page(results, {kind: COMMANDS[kind].help for kind in {result.kind for result in results}})
    write_files(out.parent, {out.name: page})
    print(f"report: {', '.join(result.folder for result in results)} in {out}", flush=True)
    for index, text in outdated(results):
        print(f"warning: {results[index].folder}: {text}", file=sys.stderr)
    return 0


@_exits
def _schema() -> int:
    """Print the JSON Schema of recipes, for editors."""
    import json

    from dielast.recipe.schema import recipe_schema

    print(json.dumps(recipe_schema(COMMANDS), indent=2))
    return 0


def _print_version(stated: bool) -> None:
    if stated:
        from dielast.cli.version import version

        typer.echo(version())
        raise typer.Exit


def _main(
    version: Annotated[bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")] = False,
) -> None:
    pass


def application(only: str | None = None) -> typer.Typer:
    """The command line; with `only` one command, if it is known, because typer takes long to build all of them."""
    app = typer.Typer(
        name="dielast",
        help="Dielectric elastomers: from relaxation measurements to a prediction of motion and failure.",
        # \b keeps the line breaks
        epilog="\n\n".join(f"\b\n{text}" for text in (START, EXIT_CODES)),
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        no_args_is_help=True,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_main)
    starters = f"Print a commented starter recipe that runs as it is.\n\nKIND is {listed(COMMANDS)}."
    starters += "\nWith --data it is the recipe for measured files, with what they do not say marked FILL IN."
    helpers: dict[str, tuple[Callable[..., None], str | None]] = {
        "new": (_new, starters),
        "validate": (_validate, None),
        "report": (_report, None),
        "schema": (_schema, None),
    }
    names = [*COMMANDS, *helpers]
    # an option is no command, also not of a package
    for name in [only] if only and not only.startswith("-") and (only in names or only in COMMANDS) else names:
        if name in helpers:
            function, text = helpers[name]
            app.command(name, help=text, cls=PlainUsage)(function)
        else:
            command = COMMANDS[name]
            app.command(name, help=command.help, short_help=command.short_help, cls=RecipeCommand)(_run)
    return app
