"""Results as one page of HTML that needs no other file: figures, headline numbers, tables, warnings, origins."""

import math
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from pathlib import Path, PurePath

from dielast.io.table import as_number, parse_csv
from dielast.report.chain import StoredResult, makers, outdated
from dielast.report.summary import rows, summary_sections

MOST_ROWS, FIRST_ROWS, LAST_ROWS = 30, 15, 5  # rows: a longer table is shortened to its first and last rows
MOST_COLUMNS = 12
TYPES = {"png": "image/png", "svg": "image/svg+xml"}
# the browser loads nothing from elsewhere, whatever the page holds
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def html_page(results: Sequence[StoredResult], descriptions: Mapping[str, str]) -> bytes:
    """The page of the `results`, in their order; `descriptions` say what figures and tables show, by kind.

    The same results make the same bytes. Raises `InputError` for a table that dielast did not write.
    """
    style = Path(__file__).with_name("page.css").read_text(encoding="utf-8")
    title = " → ".join(dict.fromkeys(result.kind for result in results))
    warnings = [list(result.warnings) for result in results]
    for number, text in reversed(outdated(results)):
        warnings[number].insert(0, text)
    parts = [
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n',
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n',
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n',
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n",
        f"<h1>{escape(title)}</h1>\n",
        *_contents(results, warnings),
    ]
    holders = makers(results)
    for index, result in enumerate(results):
        parts += _section(index, results, warnings[index], holders, descriptions.get(result.kind, ""))
    parts.append("</main>\n</body>\n</html>\n")
    return "".join(parts).encode("utf-8", "backslashreplace")


def _contents(results: Sequence[StoredResult], warnings: Sequence[Sequence[str]]) -> Iterator[str]:
    yield '<nav aria-label="Results">\n<ol>\n'
    for index, result in enumerate(results):
        count = len(warnings[index])
        more = f", {count} {'warning' if count == 1 else 'warnings'}" if count else ""
        yield f'<li><a href="#result-{index + 1}">{escape(_name(result))}</a>{more}</li>\n'
    yield "</ol>\n</nav>\n"


def _name(result: StoredResult) -> str:
    return f"{result.kind} in {result.folder}"


def _section(
    index: int,
    results: Sequence[StoredResult],
    warnings: Sequence[str],
    holders: Mapping[str, Sequence[tuple[int, str]]],
    description: str,
) -> Iterator[str]:
    result = results[index]
    summary = result.summary
    yield f'<section id="result-{index + 1}" aria-labelledby="name-{index + 1}">\n'
    yield f'<h2 id="name-{index + 1}">{index + 1}. {escape(_name(result))}</h2>\n'
    recipe, version = (_text(summary.get(key, "unknown")) for key in ("recipe", "version"))
    yield f"<p>Recipe <code>{recipe}</code>, dielast {version}.</p>\n"
    if result.settings:
        yield f"<p>Set on the command line: {', '.join(f'<code>{_text(line)}</code>' for line in result.settings)}.</p>\n"
    if warnings:
        yield '<div class="warnings">\n<h3>Warnings</h3>\n<ul>\n'
        yield from (f"<li>{_text(line)}</li>\n" for line in warnings)
        yield "</ul>\n</div>\n"
    for name, content in result.figures.items():
        form = PurePath(name).suffix[1:]
        shows = f"{PurePath(name).stem}: {description}"
        yield f'<figure>\n<img src="data:{TYPES[form]};base64,{b64encode(content).decode()}" alt="Figure of {escape(shows)}">\n'
        yield f"<figcaption>{escape(name)}</figcaption>\n</figure>\n"
    if not result.figures:
        yield '<p class="note">No figure in PNG or SVG is in the folder.</p>\n'
    yield '<h3>Summary</h3>\n<div class="summary">\n'
    for section, values in summary_sections(summary):
        yield f"<table>\n<caption>{_text(section)}</caption>\n<tbody>\n"
        lines = dict(rows(values)).items()
        yield from (f'<tr><th scope="row">{_text(name)}</th><td>{_text(value)}</td></tr>\n' for name, value in lines)
        yield "</tbody>\n</table>\n"
    yield "</div>\n"
    if result.tables:
        yield "<h3>Tables</h3>\n"
    for name, content in result.tables.items():
        yield from _table(name, parse_csv(content, f"{result.folder}/{name}"))
    yield "<h3>Inputs</h3>\n"
    yield from _files("What the run read", ("input", "SHA-256", "made by"), _origins(result, index, results, holders))
    yield "<h3>Files</h3>\n"
    files = ((f"<code>{_text(name)}</code>", f"<code>{digest}</code>") for name, digest in result.files.items())
    yield from _files(f"What the report found in {result.folder}", ("file", "SHA-256"), files)
    yield "</section>\n"


def _origins(
    result: StoredResult, index: int, results: Sequence[StoredResult], holders: Mapping[str, Sequence[tuple[int, str]]]
) -> Iterator[tuple[str, ...]]:
    for name, digest in result.inputs:
        makers_of = [number for number, _ in holders.get(digest, ()) if number != index]
        links = [f'<a href="#result-{number + 1}">{number + 1}. {_text(_name(results[number]))}</a>' for number in makers_of]
        origin = ", ".join(links) or ("ships with dielast" if name.startswith("example:") else "")
        yield f"<code>{_text(name)}</code>", f"<code>{_text(digest)}</code>", origin


def _files(caption: str, headers: Sequence[str], lines: Iterable[Sequence[str]]) -> Iterator[str]:
    """A table of files; its cells are HTML."""
    heads = "".join(f'<th scope="col">{header}</th>' for header in headers)
    yield from _grid(caption, heads, ("".join(f"<td>{cell}</td>" for cell in line) for line in lines))


def _table(name: str, columns: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """A table of the result, shortened with a note where it is long or wide."""
    shown = list(columns)[:MOST_COLUMNS]
    count = len(next(iter(columns.values()), ()))
    long = count > MOST_ROWS
    kept = [*range(FIRST_ROWS), None, *range(count - LAST_ROWS, count)] if long else list(range(count))
    notes = [f"{FIRST_ROWS + LAST_ROWS} of {count} rows"] if long else []
    notes += [f"{len(shown)} of {len(columns)} columns"] if len(columns) > len(shown) else []
    caption = f"{name}{': ' if notes else ''}{' and '.join(notes)}{', all of them in the file' if notes else ''}"
    numbers = [header for header in shown if not any(math.isnan(as_number(cell or "0")) for cell in columns[header])]
    aligned = {header: ' class="number"' if header in numbers else "" for header in shown}
    heads = "".join(f'<th scope="col"{aligned[header]}>{_text(header)}</th>' for header in shown)
    gap = f'<td colspan="{len(shown)}">… {count - FIRST_ROWS - LAST_ROWS} rows left out …</td>'
    cells = (
        gap if row is None else "".join(f"<td{aligned[header]}>{_text(columns[header][row])}</td>" for header in shown)
        for row in kept
    )
    yield from _grid(caption, heads, cells)


def _grid(caption: str, heads: str, lines: Iterable[str]) -> Iterator[str]:
    """A table of cells in HTML that scrolls, also from the keyboard, if it is wider than the page."""
    text = escape(caption)
    yield f'<div class="wide" role="region" aria-label="{text}" tabindex="0">\n<table>\n<caption>{text}</caption>\n'
    yield f"<thead><tr>{heads}</tr></thead>\n<tbody>\n"
    yield from (f"<tr>{line}</tr>\n" for line in lines)
    yield "</tbody>\n</table>\n</div>\n"


def _text(value: object) -> str:
    """A value as HTML text: markup is escaped, control characters are replaced."""
    text = "".join(mark if mark.isprintable() or mark in " \n\t" else "\N{REPLACEMENT CHARACTER}" for mark in str(value))
    return escape(text)
