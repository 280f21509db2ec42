"""What README.md and the guide show is what happens: their commands, output, recipes, tables, Python, links."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import client
import pytest
import readme

from dielast.commands.registry import COMMANDS
from dielast.handover.material_file import material_file
from dielast.readings.instruments import FORMATS

PAGES = {path.name if path != readme.README else "front": path.read_text() for path in readme.PAGES}
FRONT, INDEX = PAGES["front"], (readme.GUIDE / "README.md").read_text()
LONGEST = 230  # lines of the front page
WITHOUT_RECIPE = {"README.md", "commands.md", "glossary.md", "install.md", "limits.md", "notebook.md", "what-it-computes.md"}
# pages that take long, of commands that other tests run, too: `make -C tests trust`
LONG = {
    *(
        "against-a-spring.md",
        "cards.md",
        "clusters.md",
        "cycles.md",
        "electrode-in-a-frame.md",
        "generator.md",
        "intervals.md",
        "lifetime.md",
        "own-material.md",
        "life-at-a-voltage.md",
        "photographs.md",
        "stretch-over-voltage.md",
        "tensile-data.md",
        "report.md",
    ),
    *(
        "prestretch-and-frame.md",
        "several-materials.md",
        "stretch-sensor.md",
        "voltage-for-a-strain.md",
        "voltage-tests.md",
        "what-drives-the-life.md",
    ),
}
SECTIONS = {"uncertainty", "springs", "project"}  # of recipes, and of a pyproject.toml
NUMBER = re.compile(r"-?\d+(?:\.(\d+))?(?:e([+-]?\d+))?")


def last_digit(number: re.Match[str]) -> float:
    """What the last digit of a printed number is worth."""
    return 10.0 ** (int(number[2] or 0) - len(number[1] or ""))


def same(shown: str, real: str) -> bool:
    """Whether two lines agree: words exactly, blanks in any number, numbers to three digits or as far as they are printed."""
    if NUMBER.sub("#", shown).split() != NUMBER.sub("#", real).split():
        return False
    pairs = zip(NUMBER.finditer(shown), NUMBER.finditer(real), strict=True)
    return all(float(a[0]) == pytest.approx(float(b[0]), rel=1e-3, abs=1.01 * last_digit(a)) for a, b in pairs)


def commands(text: str) -> list[tuple[str, list[str]]]:
    """The commands of a page that are run here, and what they print; the makefiles have tests of their own."""
    return [(command, shown) for command, shown in readme.session(text) if not command.startswith("make")]


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.trust] if name in LONG else []) for name, text in PAGES.items() if commands(text)],
)
def test_the_commands_print_what_is_shown(name: str, tmp_path: Path, server: str) -> None:
    terminal = readme.Terminal(tmp_path, PAGES[name], [sys.executable, "-I", "-S", client.__file__, server])
    for command, shown in commands(PAGES[name]):
        real = terminal.run(command)
        assert len(real) == len(shown), f"{command}: {real}"
        wrong = [(a, b) for a, b in zip(shown, real, strict=True) if not same(a, b)]
        assert not wrong, f"{command}: {wrong}"


def test_every_page_runs_dielast() -> None:
    silent = {name for name, text in PAGES.items() if not any("dielast" in command for command, _ in commands(text))}
    assert silent == WITHOUT_RECIPE


def test_every_recipe_that_is_shown_with_a_name_is_used() -> None:
    for name, text in PAGES.items():
        shown = set(re.findall(r"```toml\n# (\S+\.toml)\n", text))
        assert all(text.count(recipe) >= 2 for recipe in shown), name


@pytest.mark.parametrize(
    ("shown", "real", "agree"),
    [
        ("time 564 s", "time   565 s", True),
        ("time 564 s", "time 567 s", False),
        ("C1 13.61 ± 0.074", "C1 13.61 ± 0.075", True),
        ("C1 13.61 ± 0.074", "C1 13.61 ± 0.078", False),
        ("law wlf", "law arrhenius", False),
        ("5.2e-07 s", "5.3e-07 s", True),
        ("5.2e-07 s", "5.2e-06 s", False),
    ],
)
def test_numbers_are_compared_as_far_as_they_are_printed(shown: str, real: str, agree: bool) -> None:
    assert same(shown, real) == agree


def test_the_tables_say_what_the_commands_and_models_say() -> None:
    assert all(readme.tables(text) == text for text in PAGES.values()), "run python tests/cli/readme.py --write"
    assert {"commands", "options"} <= set(re.findall(r"<!-- (\w+) -->", PAGES["commands.md"]))
    assert readme.KEYS.read_text() == readme.keys_page(), "run python tests/cli/readme.py --write"


def test_the_python_prints_what_is_shown() -> None:
    blocks = [block for text in PAGES.values() for block in readme.python_blocks(text)]
    assert len(blocks) == sum(text.count("```python\n") for text in PAGES.values()) > 0
    for code, shown in blocks:
        real = readme.printed(code)
        assert real.count("\n") == shown.count("\n")
        assert all(same(a, b) for a, b in zip(shown.splitlines(), real.splitlines(), strict=True))


@pytest.mark.parametrize("name", [name for name, text in PAGES.items() if "```toml" in text])
def test_the_recipes_are_recipes(name: str) -> None:
    for block in re.findall(r"```toml\n(.*?)```", PAGES[name], re.DOTALL):
        values = tomllib.loads(block)
        if values.keys() <= SECTIONS:  # without a kind: sections alone
            continue
        # without a folder, files need not be there
        model = COMMANDS[values["kind"]].model if "kind" in values else material_file()
        model.model_validate(values)


def test_every_instrument_is_named() -> None:
    assert all(word in PAGES["own-export.md"] for known in FORMATS for word in known.name.split())


def anchors(path: Path) -> set[str]:
    headings = re.findall(r"^#+ (.*)$", path.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", line).lower().replace(" ", "-") for line in headings}


@pytest.mark.parametrize("path", [*readme.PAGES, readme.ROOT / "recipes/ci.md"], ids=lambda path: f"{path.parent.name}/{path.name}")
def test_links_lead_somewhere(path: Path) -> None:
    for target in re.findall(r"\]\(([^)]+)\)", path.read_text()):
        if not target.startswith("https://"):
            file, _, anchor = target.partition("#")
            place = path.parent / file if file else path
            assert place.exists(), target
            assert not anchor or anchor in anchors(place), target


def test_the_index_lists_every_page() -> None:
    listed = re.findall(r"\]\(([\w-]+\.md)\)", INDEX)
    assert sorted(set(listed)) == sorted(listed)
    assert {*listed, "README.md"} == {path.name for path in readme.GUIDE.glob("*.md")}


def test_the_front_page_is_short_and_names_the_makefiles() -> None:
    assert FRONT.count("\n") <= LONGEST
    commands = [command for command, _ in readme.session(FRONT)]
    assert {"make -C recipes", "make -C tests"} <= set(commands)
    assert (readme.ROOT / "recipes/Makefile").is_file()
    assert (readme.ROOT / "tests/Makefile").is_file()
    assert re.search(r"^CI=true make .*/tests\"$", (readme.ROOT / ".ci/run").read_text(), re.MULTILINE)
