"""A table that dielast wrote, `relax.csv` or `creep.csv` of one case, as the load of another run."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from dielast.base.errors import DielastWarning, InputError
from dielast.cli.run import compute
from dielast.commands.registry import read_cases
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.io.files import Inputs
from dielast.io.table import number_columns
from dielast.mechanics.load import Track
from dielast.sharing.execution import Execution

MATERIAL = """
name = "two branches"
reference_temperature = "20 degC"
equilibrium = { shear_modulus = "26 kPa", J_lim = 110.0 }
nonequilibrium = { J_lim = 55.0, relaxation_time_s = [40.0, 2.0], shear_modulus_Pa = [1e4, 4e4] }
shift = { law = "none" }
"""
STRETCHED = '[[step]]\nstretch = 1.5\nrate = "5 %/s"\n[[step]]\nhold = "1 min"\n[[step]]\nstretch = 1.2\n[[step]]\nhold = "10 s"\n'
LOADED = '[[step]]\nstress = "20 kPa"\n[[step]]\nhold = "1 min"\n[[step]]\nstress = "5 kPa"\n[[step]]\nhold = "10 s"\n'
COARSE = "[output]\npoints_per_decade = 20\n"
FOLLOWED = f'[[step]]\ntable = "first.csv"\n{COARSE}'


def write(folder: Path, kind: str, text: str) -> Path:
    (folder / "material.toml").write_text(MATERIAL)
    path = folder / f"{kind}.toml"
    path.write_text(f'kind = "{kind}"\nmaterial = "material.toml"\n{text}')
    return path


def run(folder: Path, kind: str, text: str) -> bytes:
    """The table of a run."""
    path = write(folder, kind, text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        return compute(kind, read_cases(path), path, (), Execution())[0][f"{kind}.csv"]


def once(content: bytes, header: str) -> dict[float, float]:
    """The values over time, without the two at a jump."""
    time, values = number_columns(content, "result", ["time [s]", header])
    found, count = np.unique(time, return_counts=True)
    known = dict(zip(time.tolist(), values.tolist(), strict=True))
    return {each: known[each] for each in found[count == 1].tolist()}


@pytest.mark.parametrize(
    ("kind", "steps", "measured", "digits"),
    [
        ("relax", f'slack = "pushes"\n{STRETCHED}', "nominal_stress_1 [Pa]", 2e-3),
        # straight lines between the lengths of the slack specimen
        pytest.param("relax", STRETCHED, "nominal_stress_1 [Pa]", 20.0, marks=pytest.mark.trust),
        ("creep", LOADED, "stretch_1 [1]", 0.0),
    ],
)
def test_a_result_drives_the_same_run_again(tmp_path: Path, kind: str, steps: str, measured: str, digits: float) -> None:
    (tmp_path / "first.csv").write_bytes(run(tmp_path, kind, steps + COARSE))
    slack = steps[: steps.index("[[step]]")]
    first = once((tmp_path / "first.csv").read_bytes(), measured)
    again = once(run(tmp_path, kind, slack + FOLLOWED), measured)
    assert len(first) > 200
    # `digits` is what the last one of the load's stands for
    np.testing.assert_allclose([again[time] for time in first], list(first.values()), rtol=1e-6, atol=digits)


def test_the_stretch_of_creep_asks_for_its_stress(tmp_path: Path) -> None:
    (tmp_path / "first.csv").write_bytes(run(tmp_path, "creep", f"{LOADED}{COARSE}"))
    stress = once(run(tmp_path, "relax", FOLLOWED), "nominal_stress_1 [Pa]")
    held = [value for time, value in stress.items() if 1 < time < 60]
    assert len(held) > 20
    np.testing.assert_allclose(held, 20e3, rtol=2e-3)  # straight lines between the points


@pytest.mark.parametrize("kind", ["relax", "creep"])
def test_the_simple_name_goes_first(tmp_path: Path, kind: str) -> None:
    own, simple = ("stretch_1 [1]", "stretch [1]") if kind == "relax" else ("nominal_stress_1 [Pa]", "stress [Pa]")
    path = write(tmp_path, kind, FOLLOWED)
    targets = {}
    for header in (f"{own},{simple}", own, simple):
        rows = "1,1.5,1.25\n2,2,3\n" if "," in header else "1,1.5\n2,2\n"
        (tmp_path / "first.csv").write_text(f"time [s],{header}\n{rows}")
        (entry,) = solver_steps(read_cases(path)[0].recipe, Inputs(tmp_path))
        assert isinstance(entry.step.target, Track)
        targets[header] = list(entry.step.target.value)
    assert list(targets.values()) == [[1.25, 3.0], [1.5, 2.0], [1.5, 2.0]]


def test_several_cases_are_no_load(tmp_path: Path) -> None:
    sweep = '[sweep]\ntemperature = ["20 degC", "30 degC"]\n[output]\ntimes = ["1 s", "2 s"]\n'
    (tmp_path / "first.csv").write_bytes(run(tmp_path, "relax", STRETCHED + sweep))
    said = r"^step\[0\].table: first.csv: line 4: case 0 ends and case 1 begins, so that times do not ascend: a load is one case"
    with pytest.raises(InputError, match=said):
        solver_steps(read_cases(write(tmp_path, "relax", FOLLOWED))[0].recipe, Inputs(tmp_path))


def test_a_voltage_that_jumps_is_followed(tmp_path: Path) -> None:
    film = 'material = "example:vhb4905.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.9\nrelax = "10 min"\n'
    hold = '[[step]]\nhold = "20 s"\n'
    steps = f'[[step]]\nvoltage = "2 kV"\nduration = "5 s"\n{hold}[[step]]\nvoltage = "1 kV"\n{hold}'
    path = tmp_path / "actuate.toml"

    def films(text: str) -> bytes:
        path.write_text(f'kind = "actuate"\n{film}{text}')
        return compute("actuate", read_cases(path), path, (), Execution())[0]["actuate.csv"]

    (tmp_path / "first.csv").write_bytes(films(f"{steps}[output]\npoints_per_decade = 5\n"))
    first, again = (once(content, "stretch_1 [1]") for content in ((tmp_path / "first.csv").read_bytes(), films(FOLLOWED)))
    assert len(first) > 60
    np.testing.assert_allclose([again[time] for time in first], list(first.values()), rtol=1e-6)
    (tmp_path / "first.csv").write_text("time [s],voltage [V]\n1,100\n1,200\n")
    with pytest.raises(InputError, match=r"first\.csv: line 3: time 1 s does not come after 1 s"):
        films(FOLLOWED)
