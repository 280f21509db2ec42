"""recipes/validation.md says what `python recipes/validation` finds in the measured data beside the checkout."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from processes import ENDS

RECIPES = Path(__file__).parents[2] / "recipes"


@pytest.mark.trust
@pytest.mark.parametrize("section", ["shifts", "other-tests"])
def test_the_quick_sections_are_what_the_command_finds(section: str, shared_data: Callable[[str], Path]) -> None:
    """The others are by the same command, in minutes."""
    data = shared_data("polystyrene/creep_ps160_data.csv").parents[1]
    command = [sys.executable, str(RECIPES / "validation"), "--data", str(data), "--only", section, "--compare"]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=ENDS, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_every_section_is_on_the_page_and_every_figure_there_and_small() -> None:
    text = (RECIPES / "validation.md").read_text(encoding="utf-8")
    code = (RECIPES / "validation" / "__main__.py").read_text(encoding="utf-8")
    (sections,) = re.findall(r"^SECTIONS = \{(.*?)\}", code, re.MULTILINE | re.DOTALL)
    named = re.findall(r'"([\w-]+)":', sections)
    assert re.findall(r"^<!-- (\S+) -->", text, re.MULTILINE) == named
    figures = re.findall(r"\]\((gallery/\S+)\)", text)
    assert figures
    assert all((RECIPES / figure).stat().st_size < 100_000 for figure in figures)
    drawn = {path.name for path in (RECIPES / "gallery").glob("validation-*.png")}
    assert drawn == {Path(figure).name for figure in figures}
