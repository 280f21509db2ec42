"""The files of a result as its summary lists them: whether a folder still holds what one run wrote.

The summary is moved into a folder after all other files. So the summary of a folder whose run was killed in the middle is that of
an earlier run, and lists other digests than those of the files that the killed run had moved. Figures are not listed, as a summary
does not depend on the formats that were asked for; they hold the mark of their run.
"""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from dielast.base.errors import InputError, and_more, as_toml
from dielast.io.files import sha256
from dielast.io.spool import Content

SUMMARY = "summary.toml"
LISTED = "outputs"
"""The key of a summary with the name and the SHA-256 of every other file of the result but its figures."""
CHANGED = "changed"
"""The key of a summary by which a user says which of its files were changed on purpose."""
FIGURES = ("png", "svg", "pdf")


def listing(files: Mapping[str, Content]) -> list[dict[str, str]]:
    """What a summary lists of the files (name -> content) of a result."""
    return [{"file": name, "sha256": sha256(content)} for name, content in files.items()]


def mark(summary: Mapping[str, Any]) -> str:
    """The mark of a run in its figures: a SHA-256 over the settings, inputs and files in its summary."""
    return sha256(repr([summary.get(key) for key in ("set", "inputs", LISTED)]).encode("utf-8", "backslashreplace"))


def is_of_run(summary: Mapping[str, Any], name: str, figure: bytes) -> bool:
    """Whether a figure has the mark of the run, or was changed on purpose; true where the summary lists no files."""
    return LISTED not in summary or name in changed_on_purpose(summary) or mark(summary).encode() in figure


def changed_on_purpose(summary: Mapping[str, Any]) -> list[str]:
    """The names of the files that the user states as changed."""
    stated = summary.get(CHANGED, [])
    stated = [stated] if isinstance(stated, str) else stated
    return [name for name in stated if isinstance(name, str)] if isinstance(stated, list) else []


def altered(summary: Mapping[str, Any], contents: Mapping[str, bytes]) -> list[str]:
    """Which of the files (name -> content) beside a summary it lists with other content, but for those changed on purpose.

    None for the summary of an earlier version of dielast, which lists no files. Lines may end in CRLF, as after a version control.
    """
    digests, known = _listed(summary), changed_on_purpose(summary)
    return [
        name
        for name, content in contents.items()
        if name in digests and name not in known and digests[name] not in (sha256(content), sha256(content.replace(b"\r\n", b"\n")))
    ]


def unlisted(summary: Mapping[str, Any], names: Collection[str]) -> list[str]:
    """Which of the names beside a summary are not of its run, but of another one; figures are not looked at."""
    known = {SUMMARY, *_listed(summary)}
    return [name for name in names if name not in known and not name.endswith(FIGURES)] if LISTED in summary else []


def check_whole(folder: str | Path, summary: Mapping[str, Any], contents: Mapping[str, bytes]) -> None:
    """Raise `InputError` if files (name -> content) of the `folder` are not those of the run that wrote its `summary`."""
    if others := altered(summary, contents):
        raise InputError(
            f"{not_of_the_run(others)}: run it again; where that was on purpose, write {CHANGED} = {as_toml(others)} at the top of "
            f"this {SUMMARY}",
            file=Path(folder) / SUMMARY,
        )


def not_of_the_run(names: Collection[str]) -> str:
    """What is said of files that a summary lists with other content."""
    named = f"{', '.join([*names][:3])}{and_more(len(names) - 3)}"
    verb = "is not the file" if len(names) == 1 else "are not the files"
    return f"{named} {verb} that its run wrote (changed since, or another run was ended while it wrote)"


def _listed(summary: Mapping[str, Any]) -> dict[str, str]:
    stated = summary.get(LISTED)
    entries = [entry for entry in stated if isinstance(entry, Mapping)] if isinstance(stated, list) else []
    return {str(entry.get("file")): str(entry.get("sha256")) for entry in entries}
