"""Files of an earlier run that a run does not renew are spoken of, once, on standard error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from processes import Run

import dielast as library
from dielast.commands.registry import COMMANDS
from dielast.handover.export.card import CODES, export_card
from dielast.handover.export.code import CardOptions
from dielast.io.files import resolve
from dielast.material.spectrum import Spectrum
from dielast.report.report import left_over

GOLDEN = Path(__file__).parents[1] / "golden"


def test_a_figure_that_is_not_renewed(dielast: Run, starter: Callable[[str], Path], tmp_path: Path) -> None:
    starter("relax")
    fresh = dielast("relax", "relax.toml", "--plot", "png", "--plot", "svg")
    assert "earlier run" not in fresh.stderr
    summary = (tmp_path / "relax/summary.toml").read_bytes()
    (tmp_path / "relax/notes.txt").write_text("mine")
    again = dielast("relax", "relax.toml", "--plot", "svg", "-q")
    assert again.stderr.splitlines()[-1] == "warning: relax: relax.png is from an earlier run and was not renewed"
    none = dielast("relax", "relax.toml", "--plot", "none")
    assert none.stderr.count("warning: relax: relax.png, relax.svg are from an earlier run and were not renewed") == 1
    assert (tmp_path / "relax/relax.png").exists()
    assert (tmp_path / "relax/notes.txt").read_text() == "mine"
    # what the folder held before is no part of the result
    assert (tmp_path / "relax/summary.toml").read_bytes() == summary


def test_cards_that_are_not_renewed(dielast: Run, starter: Callable[[str], Path], tmp_path: Path) -> None:
    path = starter("spectrum")
    plain = path.read_text()
    path.write_text(plain + '\n[export]\nformats = ["abaqus"]\nhyperelastic = "neo-hookean"\n')
    assert dielast("spectrum", path, "--plot", "none").returncode == 0
    assert (tmp_path / "spectrum/material.inp").exists()
    path.write_text(plain)
    assert "spectrum: material.inp is from an earlier run" in dielast("spectrum", path, "--plot", "none").stderr


@pytest.mark.parametrize("form", CODES.names)
def test_every_card_is_known(form: str) -> None:
    material = library.read_material(resolve(Path(), "example:vhb4905.toml"))
    few = replace(material, spectrum=Spectrum(material.spectrum.relaxation_time[:3], material.spectrum.shear_modulus[:3]))
    names = export_card(few, form, CardOptions(hyperelastic="neo-hookean", temperature=20.0)).keys()
    assert names <= set(COMMANDS["spectrum"].files)


def test_every_golden_file_is_known() -> None:
    known = {kind: {*command.files, "summary.toml", "tolerance.toml", "plot.png"} for kind, command in COMMANDS.items()}
    for folder in GOLDEN.glob("*/expected"):
        recipe = (folder.parent / "recipe.toml").read_text()
        (kind,) = [kind for kind in COMMANDS if f'kind = "{kind}"' in recipe]
        assert {path.name for path in folder.iterdir()} <= known[kind], folder


def test_only_the_kinds_own_files_count(tmp_path: Path) -> None:
    for name in ("draws.csv", "relax.png", "spectrum.pdf", "other.csv", "summary.toml"):
        (tmp_path / name).write_text("")
    (tmp_path / "reduction.csv").mkdir()
    assert left_over(tmp_path, COMMANDS["spectrum"].files, "spectrum", ["summary.toml"]) == ["draws.csv", "spectrum.pdf"]
    assert left_over(tmp_path, COMMANDS["relax"].files, "relax", ["relax.png"]) == []


def test_a_folder_of_another_kind(dielast: Run, starter: Callable[[str], Path], tmp_path: Path) -> None:
    for kind in ("relax", "creep"):
        done = dielast(kind, starter(kind), "--plot", "none", "-q", "-o", "one")
        assert done.returncode == 0
    assert done.stderr == "warning: one: holds results of relax, too: summary.toml is now that of this run\n"
    (tmp_path / "two").mkdir()
    (tmp_path / "two/cases.csv").write_text("case\n0\n")
    assert dielast("relax", tmp_path / "relax.toml", "--plot", "none", "-q", "-o", "two").stderr == ""
