"""The files of a result as its summary lists them: whether a folder still holds what one run wrote.

Tables are moved into a folder first, then figures, and the summary last. So the summary of a folder whose run was killed in the
middle is that of an earlier run, and lists other digests than those of the tables that the killed run had moved. Figures are not
listed: a summary does not depend on the formats that were asked for.
"""

from collections.abc import Mapping
from typing import Any

from dielast.errors import and_more
from dielast.io.files import sha256

SUMMARY = "summary.toml"
LISTED = "outputs"
"""The key of a summary with the name and the SHA-256 of every other file of the result but its figures."""
FIGURES = ("png", "svg", "pdf")


def listing(files: Mapping[str, bytes]) -> list[dict[str, str]]:
    """What a summary lists of the files (name -> content) of a result."""
    return [{"file": name, "sha256": sha256(content)} for name, content in files.items()]


def strangers(summary: Mapping[str, Any], digests: Mapping[str, str]) -> str:
    """A message on files (name -> SHA-256) beside a summary that are not those of its run; empty if there are none, and for the
    summary of an earlier version of dielast, which lists none.
    """
    stated = summary.get(LISTED)
    if not isinstance(stated, list):
        return ""
    known = {entry.get("file"): entry.get("sha256") for entry in stated if isinstance(entry, Mapping)}
    own = {name: digest for name, digest in digests.items() if name != SUMMARY and not name.endswith(FIGURES)}
    others = [name for name, digest in own.items() if known.get(name) != digest]
    if not others:
        return ""
    named = f"{', '.join(others[:3])}{and_more(len(others) - 3)}"
    verb = "is not a file" if len(others) == 1 else "are not files"
    return f"{named} {verb} of the run that wrote {SUMMARY}: another run was ended while it wrote, or something was changed since"
