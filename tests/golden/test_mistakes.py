"""Every mistake in the tables is refused with its messages; `pytest --update-golden` writes down what they are now."""

from __future__ import annotations

from pathlib import Path

import pytest
from mistakes import Mistake, found, kept, parse, written

TABLES = sorted((Path(__file__).parent / "mistakes").glob("*.txt"))
assert TABLES


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.stem)
def test_a_mistake_is_refused_with_what_to_write_instead(table: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    files, mistakes = parse(table.read_text(encoding="utf-8"))
    assert mistakes
    assert not found(files, Mistake(), tmp_path / "in order", runs=False)
    for number, mistake in enumerate(mistakes):
        first, *others = found(files, mistake, tmp_path / f"{number}")
        messages = kept(mistake.messages, first)
        if request.config.getoption("--update-golden"):
            mistake.messages = messages
        assert messages == mistake.messages, mistake.changes
        # the run refuses the same, though it may not say which key leads there; settings are those of a run alone
        assert len(others) == ("r.toml" in files and not mistake.overrides)
        assert all(len(run) == len(first) for run in others)
        assert all(line.endswith(said.removeprefix("r.toml: ")) for run in others for line, said in zip(first, run, strict=True))
        for line in first:
            assert "\n" not in line
            assert len(line) < 1000
            assert not any(words in line for words in ("Input should", "validation", "Traceback")), line
    if request.config.getoption("--update-golden"):
        table.write_text(written(files, mistakes), encoding="utf-8")
