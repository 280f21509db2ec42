"""Results in their folders: what a folder holds, which results were made from which, and in which order to show them."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePath
from typing import Any

from dielast.base.errors import InputError, Mistakes, as_toml
from dielast.io.files import as_text, read_file, sha256
from dielast.io.manifest import CHANGED, FIGURES, SUMMARY, changed_on_purpose, check_whole, is_of_run, unlisted
from dielast.io.toml import parse_toml

SHOWN_FORMS = ("svg", "png")
"""Formats of figures that a page can show, in order of preference."""
_NEEDED = "a folder that a run of dielast wrote is needed"


@dataclass(frozen=True, slots=True)
class StoredResult:
    """The result of a run, read from its folder.

    `tables` are CSV by file name; `figures` are by file name, in one format. `files` holds the SHA-256 of every file of the result,
    `inputs` the name in the recipe and the SHA-256 of every file that the run read. `home` is the name of the folder in the file
    system, `folder` its path as stated. `warnings` include what the run could not finish. `apart` has a line for each file of
    another run, which is left out, and for each that was changed on purpose.
    """

    folder: str
    home: str
    kind: str
    summary: Mapping[str, Any]
    tables: Mapping[str, bytes]
    figures: Mapping[str, bytes]
    files: Mapping[str, str]
    paths: tuple[Path, ...]
    inputs: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]
    apart: tuple[str, ...]
    settings: tuple[str, ...]


def read_results(folders: Iterable[Path], names: Mapping[str, Sequence[str]]) -> list[StoredResult]:
    """The results in the `folders`, each result before those that were made from it; a folder that is stated twice counts once.

    `names` are the files that each kind of run may write, besides its figures and its summary. Raises `InputError` with a line for
    each folder that holds no result, or files that are not those of its run.
    """
    results: dict[str, StoredResult] = {}
    wrong = Mistakes()
    for folder in folders:
        place = os.path.realpath(folder)
        if place not in results and (result := wrong.tried(partial(_read, folder, names))):
            results[place] = result
    wrong.refuse()
    return _in_order(list(results.values()))


def makers(results: Sequence[StoredResult]) -> dict[str, list[tuple[int, str]]]:
    """SHA-256 -> the results that hold such a file, by their number in `results`, and its name there."""
    results_by_digest: dict[str, list[tuple[int, str]]] = {}
    for index, result in enumerate(results):
        for name, digest in result.files.items():
            results_by_digest.setdefault(digest, []).append((index, name))
    return results_by_digest


def outdated(results: Sequence[StoredResult]) -> list[tuple[int, str]]:
    """(number of a result, message) for files that are not of its run or were changed, and for each input that has the name of
    another result's file, but other content.
    """
    holders = makers(results)
    messages = [(index, line) for index, result in enumerate(results) for line in result.apart]
    for index, result in enumerate(results):
        for stated, digest in result.inputs:
            path = PurePath(stated)
            for other in results:
                if digest not in holders and path.parent.name == other.home and path.name in other.files and other is not result:
                    text = f"was made from another {path.name} than the one in {other.folder} now: run it again"
                    messages.append((index, text))
    return messages


def _in_order(results: list[StoredResult]) -> list[StoredResult]:
    """The results, each after those that made its inputs, otherwise in their order."""
    holders = makers(results)
    needs = [
        {index for _, digest in result.inputs for index, _ in holders.get(digest, ()) if index != number}
        for number, result in enumerate(results)
    ]
    order: list[int] = []
    while len(order) < len(results):
        rest = [index for index in range(len(results)) if index not in order]
        # two copies of a folder may each hold the inputs of the other: the first one listed then comes first
        order.append(next((index for index in rest if needs[index] <= set(order)), rest[0]))
    return [results[index] for index in order]


def _read(folder: Path, names: Mapping[str, Sequence[str]]) -> StoredResult:
    if not os.path.isdir(folder):
        raise InputError(f"{'is a file' if os.path.exists(folder) else 'no such folder'}: {_NEEDED}", file=folder)
    source = folder / SUMMARY
    if not os.path.isfile(source):
        raise InputError(f"the folder has no {SUMMARY}: {_NEEDED}", file=folder)
    content = read_file(source, str(source))
    summary = parse_toml(content, str(source))
    kind = summary.get("kind")
    if not isinstance(kind, str) or kind not in names:
        raise InputError(f"unknown kind of result; {_NEEDED}", file=source, key="kind")
    present = [name for name in names[kind] if os.path.isfile(folder / name) and not name.endswith(FIGURES)]
    strange = unlisted(summary, present)
    figures, others = _figures(folder, kind, names[kind], summary)
    own = {name: read_file(folder / name, str(folder / name)) for name in present if name not in strange}
    check_whole(folder, summary, own)
    held = figures | own
    unmarked = f"is left out, as it lacks the mark of the run of {SUMMARY}: run it again, or write {CHANGED} = "
    left_out = [f"{name} {unmarked}{as_toml([name])} at the top of {SUMMARY}" for name in others]
    left_out += [f"{name} is left out, as the run of {SUMMARY} did not write it" for name in strange]
    changed = [f"{name} was changed after the run, as {SUMMARY} states" for name in changed_on_purpose(summary) if name in held]
    digests = {SUMMARY: sha256(content), **{name: sha256(text) for name, text in held.items()}}
    return StoredResult(
        folder=as_text(str(folder)),
        home=os.path.basename(os.path.realpath(folder)),
        kind=kind,
        summary=summary,
        tables={name: text for name, text in held.items() if name.endswith(".csv")},
        figures=figures,
        files=digests,
        paths=(source, *(folder / name for name in held)),
        inputs=_inputs(summary, source),
        warnings=_lines(summary, "unfinished", source) + _lines(summary, "warnings", source),
        apart=(*left_out, *changed),
        settings=_lines(summary, "set", source),
    )


def _figures(folder: Path, kind: str, names: Sequence[str], summary: Mapping[str, Any]) -> tuple[dict[str, bytes], list[str]]:
    """The figures of the run by name, that of the `kind` first, each in its preferred format, and names of those of other runs."""
    own: dict[str, bytes] = {}
    others: list[str] = []
    for stem in dict.fromkeys([kind, *(PurePath(name).stem for name in names if name.endswith(SHOWN_FORMS))]):
        for path in (folder / f"{stem}.{form}" for form in SHOWN_FORMS):
            if not os.path.isfile(path):
                continue
            content = read_file(path, str(path))
            if is_of_run(summary, path.name, content):
                own[path.name] = content
                break
            others.append(path.name)
    return own, others


def _lines(summary: Mapping[str, Any], key: str, source: Path) -> tuple[str, ...]:
    lines = summary.get(key, [])
    if not isinstance(lines, list) or not all(isinstance(line, str) for line in lines):
        raise InputError(f"a list of text is needed; {_NEEDED}", file=source, key=key)
    return tuple(lines)


def _inputs(summary: Mapping[str, Any], source: Path) -> tuple[tuple[str, str], ...]:
    stated = summary.get("inputs", [])
    tables = stated if isinstance(stated, list) else [stated]
    pairs = [(table.get("file"), table.get("sha256")) if isinstance(table, Mapping) else (None, None) for table in tables]
    if not all(isinstance(name, str) and isinstance(digest, str) for name, digest in pairs):
        raise InputError(f"every entry needs a file and its sha256; {_NEEDED}", file=source, key="inputs")
    return tuple((str(name), str(digest)) for name, digest in pairs)
