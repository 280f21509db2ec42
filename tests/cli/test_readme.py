"""What the README shows is what happens: its commands, their output, its tables, its Python, its links."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import readme

from dielast.commands.registry import COMMANDS
from dielast.handover.material_file import material_file
from dielast.readings.instruments import FORMATS

TEXT = readme.README.read_text()
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


def test_the_walk_runs_as_shown(tmp_path: Path) -> None:
    terminal = readme.Terminal(tmp_path)
    walked = 0
    for command, shown in readme.session():
        if command.startswith("make"):
            continue
        real = terminal.run(command)
        assert len(real) == len(shown), f"{command}: {real}"
        wrong = [(a, b) for a, b in zip(shown, real, strict=True) if not same(a, b)]
        assert not wrong, f"{command}: {wrong}"
        walked += 1
    assert walked >= 19


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
    assert readme.tables(TEXT) == TEXT, "run python tests/cli/readme.py --write"
    assert readme.KEYS.read_text() == readme.keys_page(), "run python tests/cli/readme.py --write"


def test_the_python_prints_what_is_shown() -> None:
    ((code, shown),) = re.findall(r"```python\n(.*?)```.*?```text\n(.*?)```", TEXT, re.DOTALL)
    real = readme.printed(code)
    assert real.count("\n") == shown.count("\n")
    assert all(same(a, b) for a, b in zip(shown.splitlines(), real.splitlines(), strict=True))


def test_the_recipes_are_recipes() -> None:
    blocks = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)
    assert blocks
    for block in blocks:
        values = tomllib.loads(block)
        # without a folder, files need not be there
        if "kind" in values:
            COMMANDS[values["kind"]].model.model_validate(values)
        else:  # tables of a material file
            rest = {"name": "any", "reference_temperature": "20 degC", "shift": {"law": "none"}}
            branch = {"relaxation_time_s": [1.0], "shear_modulus_Pa": [1e4]}
            stated = {"equilibrium": {"shear_modulus": "26 kPa"}, "nonequilibrium": {}, **rest, **values}
            material_file().model_validate({**stated, "nonequilibrium": {**branch, **stated["nonequilibrium"]}})


def test_every_instrument_is_named() -> None:
    section = TEXT.split("## Bring your own export")[1].split("\n## ")[0]
    assert all(word in section for known in FORMATS for word in known.NAME.split())


def test_pictures_and_files_are_there() -> None:
    targets = [target for target in re.findall(r"\]\(([^)]+)\)", TEXT) if not target.startswith("http")]
    assert targets
    headings = {
        "#" + re.sub(r"[^\w -]", "", line).lower().replace(" ", "-") for line in re.findall(r"^#+ (.*)$", TEXT, re.MULTILINE)
    }
    assert all(target in headings if target.startswith("#") else (readme.ROOT / target).exists() for target in targets)


def test_the_two_commands_are_the_makefiles() -> None:
    commands = [command for command, _ in readme.session()]
    assert commands[:2] == ["make -C recipes", "make -C tests"]
    assert (readme.ROOT / "recipes/Makefile").is_file()
    assert (readme.ROOT / "tests/Makefile").is_file()
