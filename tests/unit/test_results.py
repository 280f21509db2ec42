"""Results in a notebook: three lines at most, and tables whose columns are those of the files."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import dielast
from dielast import FilmScatter, NormalScatter, RelaxationCurve, ShiftTable, Step, VoltageStep
from dielast.io.result import Result, TabularResult
from dielast.io.table import parse_csv, to_csv

GOLDEN = Path(__file__).parents[1] / "golden"


@cache
def results() -> dict[str, Any]:
    """A result of every sort."""
    time = np.geomspace(1, 1000, 40)
    curves = [RelaxationCurve(T, time, 1e6 * (1 + time * 10 ** (T / 20)) ** -0.8 + 1e5) for T in (0.0, 20.0, 40.0)]
    master = dielast.build_master_curve(curves, reference_temperature=20.0, law="table")
    fit = dielast.fit_spectrum(master.reduced_time, master.relaxation_modulus, method="nnls", branches=8)
    vhb = dielast.read_material("example:vhb4905")
    film_of_few = dielast.read_material("example:tensile/start.toml")
    history = dielast.relax(vhb, [Step(stretch=2.0, rate=0.1), Step(duration=60.0)], temperature=[0.0, 20.0])
    film = dielast.actuate(
        vhb,
        dielast.Film(5e-4, 1.9, relax=60.0),
        [VoltageStep(4e3), VoltageStep.hold(600.0)],
        failure=dielast.Failure(stop_at="end"),
    )
    chart = dielast.failure_map(vhb, dielast.Film(5e-4, [1.7, 1.9]), dielast.HeldVoltages([3.5e3, 4e3], 3600.0))
    sample = dielast.draw_sample([film_of_few], 30, scatter=FilmScatter(thickness=NormalScatter(0.02)))
    aged = dielast.Film(5e-4, 1.9), dielast.HeldVoltages(4e3, 1e9)
    time = np.linspace(1.0, 20.0, 12)
    test = dielast.MeasuredTest("test", time, 1 + 0.1 * time, 3e4 * time**0.5, 20.0)
    retardation = dielast.retardation_from_relaxation(fit.spectrum, fit.equilibrium_shear_modulus)
    calibration = dielast.calibrate(
        [test], film_of_few, {"nonequilibrium.scale": dielast.Free()}, starts=1, intervals=dielast.Intervals(draws=0)
    )
    y, x = np.mgrid[:80, :90]
    photographs = [np.where(np.hypot((x - 45) / (1 + 0.1 * k), y - 40) < 25, 0.1, 0.8) for k in range(3)]
    return {
        "curve": curves[0],
        "test": test,
        "calibration": calibration,
        "comparison": calibration.comparisons[0],
        "master": master,
        "draws": dielast.bootstrap_master_curve(curves, master, draws=4, law="table"),
        "fit": fit,
        "spectrum": fit.spectrum,
        "continuous": dielast.continuous_spectrum(fit),
        "reduction": dielast.reduce_spectrum(vhb.spectrum, vhb.equilibrium_modulus, vhb.shift, window=(1.0, 100.0), tolerance=0.1),
        "retardation": retardation,
        "material": vhb,
        "table law": ShiftTable(20.0, tuple(range(0, 60, 2)), tuple(np.linspace(3, -2, 30))),
        "limits": dielast.film_limits(film_of_few, [1.5, 2.0], thickness=5e-4),
        "sample": sample,
        "shares": dielast.life_sensitivity(film_of_few, *aged, sample),
        "elasticities": dielast.life_sensitivity(film_of_few, *aged),
        "history": history,
        "film": film,
        "map": chart,
        "plan": dielast.plan_failure_map(vhb, dielast.Film(5e-4, [1.7]), dielast.HeldVoltages([3.5e3, 4e3], 3600.0)),
        "design": dielast.design(film_of_few, dielast.Film(5e-4, [1.7, 1.9]), dielast.Goal(60.0, 3600.0, 1.1)),
        "lines": dielast.fit_lifetime(chart),
        "line": dielast.fit_lifetime(chart)[0],
        "breakdown": dielast.Breakdown(tuple(np.linspace(1, 3, 30)), (4e7,) * 30),
        "stretches": dielast.measure_electrode(photographs, [0.0, 8.0, 16.0]),
        "step": Step(stretch=np.linspace(1, 2, 50), rate=0.1),
    }


def test_a_result_is_described_in_three_lines() -> None:
    for name, result in results().items():
        text = repr(result)
        assert text.count("\n") < 3, name
        assert max(map(len, text.splitlines())) <= 100, name
        assert "array(" not in text, name


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("master", "mastercurve-table/expected/mastercurve.csv"),
        ("fit", "spectrum-nnls/expected/fit.csv"),
        ("spectrum", "spectrum-nnls/expected/spectrum.csv"),
        ("reduction", "spectrum-reduced/expected/reduction.csv"),
        ("history", "relax-uniaxial/expected/relax.csv"),
        ("film", "actuate-pull-in/expected/actuate.csv"),
        ("map", "failure-map-grid/expected/failure-map.csv"),
        ("lines", "failure-map-grid/expected/fit.csv"),
    ],
)
def test_the_columns_of_a_frame_are_those_of_the_file(name: str, file: str) -> None:
    frame = results()[name].to_frame()
    assert isinstance(frame, pd.DataFrame)
    assert list(frame) == list(parse_csv((GOLDEN / file).read_bytes(), file))
    assert len(frame) > 0
    # and what it holds is what the file would hold
    cells = parse_csv(to_csv(results()[name].columns()), name)
    for header, column in cells.items():
        if frame[header].dtype.kind == "f":
            np.testing.assert_allclose(frame[header], [float(cell or "nan") for cell in column], rtol=1e-8)
        else:
            assert frame[header].astype(str).tolist() == column


def test_what_is_not_one_table_has_more() -> None:
    shift = results()["master"].shift_to_frame()
    assert list(shift) == list(parse_csv((GOLDEN / "mastercurve-table/expected/shift-factors.csv").read_bytes(), "shift"))
    events = results()["film"].events_to_frame()
    assert list(events) == list(parse_csv((GOLDEN / "actuate-pull-in/expected/events.csv").read_bytes(), "events"))
    assert "breakdown" in events["event"].tolist()


def test_every_public_result_is_one_of_them() -> None:
    made = {type(result).__name__ for result in results().values()}
    for name in dielast.__all__:
        thing = getattr(dielast, name)
        if isinstance(thing, type) and issubclass(thing, TabularResult):
            assert name in made
            assert isinstance(results_of(thing).to_frame(), pd.DataFrame)
    assert {"MasterCurve", "SpectrumFit", "MembraneHistory", "ActuationHistory", "FailureMap", "Reduction"} <= made
    assert issubclass(dielast.Material, Result)


def results_of(kind: type[TabularResult]) -> TabularResult:
    return next(result for result in results().values() if type(result) is kind)


def test_materials_that_ship_are_read_by_their_names() -> None:
    vhb = dielast.read_material("example:vhb4905")
    assert vhb.name == dielast.read_material("example:vhb4905.toml").name == "VHB 4905 (reconstruction)"
    with pytest.raises(dielast.InputError, match=r"^example:vhb: no such example; there are example:freq"):
        dielast.read_material("example:vhb")
    with pytest.raises(dielast.InputError, match="the material has no draws"):
        dielast.read_draws("example:vhb4905")
