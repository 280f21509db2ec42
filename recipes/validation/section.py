"""What a section of the page is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from matplotlib.figure import Figure


@dataclass(frozen=True)
class Section:
    """A section of the page: its text in Markdown, and its figures by the name of their file, without `validation-`."""

    text: str
    figures: dict[str, Figure] = field(default_factory=dict)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def picture(name: str, alt: str, caption: str) -> str:
    """The line that shows a figure, and the one below it."""
    return f"![{alt}](gallery/validation-{name}.png)\n\n*{caption}*"
