"""No public function or class raises anything but `InputError` for arguments of a wrong type, and it names the argument."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import dielast
from dielast import DielastError, InputError
from dielast.handover.material_draws import draw_columns
from dielast.io.files import resolve
from dielast.io.table import to_csv

# made by functions of dielast: a user who makes one of them is alone with its types
RESULTS = {
    "Camera",
    "Outline",
    "Stretches",
    "ActuationHistory",
    "Calibration",
    "Comparison",
    "ContinuousSpectrum",
    "Design",
    "FailureMap",
    "LifeElasticities",
    "LifeShares",
    "Limits",
    "MasterCurve",
    "MasterCurveDraws",
    "MembraneHistory",
    "Reduction",
    "SpectrumFit",
}
WRONG: tuple[Any, ...] = (None, "x", [], {}, float("nan"), [object()], pd.DataFrame({"time": [1.0, 2.0], "stress": [3.0, 4.0]}))
TIME = np.geomspace(1.0, 1e3, 12)
FILM, HELD, FEW_ROWS = dielast.Film(5e-4, 1.9), dielast.HeldVoltages(4e3, 10.0), dielast.Output(points_per_decade=1)


def names() -> list[str]:
    """All public functions, and all classes that users make."""
    public = {name: getattr(dielast, name) for name in dielast.__all__}
    errors = {name for name, thing in public.items() if isinstance(thing, type) and issubclass(thing, Exception | Warning)}
    return [name for name, thing in public.items() if callable(thing) and name not in RESULTS | errors]


@cache
def vhb() -> dielast.Material:
    return dielast.read_material(resolve(Path(), "example:vhb4905.toml"))


@cache
def curves() -> tuple[dielast.RelaxationCurve, ...]:
    law, material = dielast.WLF(20.0, 13.7, 187.1), vhb()
    factors = {celsius: 10 ** float(law.log10_shift_factor(celsius)) for celsius in (0.0, 20.0, 40.0)}
    moduli = {
        celsius: 3 * material.spectrum.relaxation_modulus(TIME / factor, material.equilibrium_modulus)
        for celsius, factor in factors.items()
    }
    return tuple(dielast.RelaxationCurve(celsius, TIME, modulus) for celsius, modulus in moduli.items())


@cache
def master() -> dielast.MasterCurve:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return dielast.build_master_curve(curves(), reference_temperature=20.0)


@cache
def fitted() -> dielast.SpectrumFit:
    return dielast.fit_spectrum(TIME, curves()[1].modulus, branches=5, polynomial_degree=3)


@cache
def disc() -> np.ndarray:
    y, x = np.mgrid[:64, :64]
    return 0.8 - 0.6 / (1 + np.exp(np.hypot(x - 31.3, y - 32.1) - 20.2))


@cache
def sensitive() -> dielast.LifeElasticities:
    result = dielast.life_sensitivity(simple(), FILM, HELD)
    assert isinstance(result, dielast.LifeElasticities)
    return result


@cache
def planned() -> Any:
    return dielast.plan_failure_map(simple(), FILM, HELD)


@cache
def mapped() -> dielast.FailureMap:
    return dielast.solve_map(planned())[0]


@cache
def pulled() -> dielast.MeasuredTest:
    time = np.arange(1.0, 9.0)
    stress = dielast.relax(simple(), [dielast.Step(stretch=2.0, duration=9.0)], output=dielast.Output(time)).nominal_stress_1[0]
    return dielast.MeasuredTest("test", time, 1 + time / 9, stress, 20.0)


def drawn_material(folder: Path) -> Path:
    """The path of a material file with draws."""
    (folder / "material.toml").write_bytes(dielast.write_material(simple(), "draws.csv"))
    (folder / "draws.csv").write_bytes(to_csv(draw_columns(np.arange(2), [simple(), simple()])))
    return folder / "material.toml"


def simple() -> dielast.Material:
    return dielast.Material(
        "simple",
        2e4,
        dielast.Spectrum([10.0], [1e4]),
        dielast.NoShift(20.0),
        permittivity=4e-11,
        breakdown=dielast.PowerBreakdown(4e7),
    )


def arguments_of(name: str, folder: Path) -> dict[str, Any]:
    """Arguments with which a function or a class works."""
    step, spectrum = dielast.Step(stretch=1.5, duration=1.0), dielast.Spectrum([10.0, 1.0], [1e4, 1e4])
    valid: dict[str, Callable[[], dict[str, Any]]] = {
        "Arrhenius": lambda: {"reference_temperature": 20.0, "activation_energy": 1e5},
        "ArrudaBoyce": lambda: {"locking_stretch": 5.0},
        "Breakdown": lambda: {"prestretch": (1.0, 2.0), "field": (4e7, 5e7)},
        "CardOptions": dict,
        "ChargeStep": lambda: {"charge": 1e-3, "rate": 1e-3, "duration": None},
        "CreepCurve": lambda: {"temperature": 20.0, "time": TIME, "compliance": TIME * 1e-9},
        "FilmScatter": dict,
        "Free": dict,
        "FilmStep": lambda: {"stretch": 2.0, "voltage": 1e3, "duration": 1.0},
        "FrequencySweep": lambda: {"temperature": 20.0, "angular_frequency": TIME, "storage_modulus": TIME, "loss_modulus": TIME},
        "Gent": lambda: {"J_lim": 50.0},
        "GentI2": lambda: {"J_lim": 50.0, "I2_share": 0.3, "I2_exponent": 0.5},
        "InversePower": lambda: {"field": 4e7, "time": 1e3, "exponent": 9.0},
        "Leakage": dict,
        "Material": lambda: {
            "name": "simple",
            "equilibrium_modulus": 2e4,
            "spectrum": spectrum,
            "shift": dielast.NoShift(20.0),
        },
        "MeasuredTest": lambda: {
            "name": "test",
            "time": [1.0, 2.0, 3.0],
            "stretch": [1.1, 1.2, 1.3],
            "stress": [1e3, 2e3, 3e3],
            "temperature": 20.0,
        },
        "MooneyRivlin": lambda: {"C10": 1e4},
        "NeoHookean": dict,
        "NoShift": lambda: {"reference_temperature": 20.0},
        "NormalScatter": lambda: {"relative": 0.1},
        "Ogden": lambda: {"mu": (1e4,), "alpha": (2.0,)},
        "Plateaus": lambda: {"equilibrium_modulus": 2e4, "glassy_modulus": 1e6},
        "PowerBreakdown": lambda: {"field": 4e7},
        "Programme": lambda: {"steps": [dielast.VoltageStep(1e3)]},
        "RelaxationCurve": lambda: {"temperature": 20.0, "time": TIME, "modulus": TIME},
        "Repeat": lambda: {"times": 3},
        "RetardationSpectrum": lambda: {"retardation_time": [10.0], "compliance": [1e-5], "glassy_compliance": 1e-5},
        "Sample": lambda: {"materials": (vhb(),), "breakdown_factor": np.ones(1), "thickness_factor": np.ones(1)},
        "ShiftTable": lambda: {"reference_temperature": 20.0, "temperature": (0.0, 20.0), "log10_shift": (1.0, 0.0)},
        "Spectrum": lambda: {"relaxation_time": [10.0], "shear_modulus": [1e4]},
        "Step": lambda: {"stretch": 1.5, "duration": 1.0},
        "TimeScale": dict,
        "Track": lambda: {"time": [1.0, 2.0], "value": [1.1, 1.2]},
        "VogelFulcherTammann": lambda: {"reference_temperature": 20.0, "B": 1500.0, "T_V": -90.0},
        "VoltageStep": lambda: {"voltage": 1e3, "duration": 1.0},
        "VoltageTest": lambda: {
            "name": "film",
            "voltage": [1e3, 2e3, 3e3],
            "stretch": [1.95, 2.0, 2.1],
            "film": FILM,
            "ramp": 100.0,
            "temperature": 20.0,
        },
        "WLF": lambda: {"reference_temperature": 20.0, "C1": 13.7, "C2": 187.1},
        "Waveform": lambda: {"low": 0.0, "high": 1.0, "period": 1.0},
        "WeibullScatter": lambda: {"shape": 9.0},
        "Yeoh": lambda: {"C10": 1e4},
        "actuate": lambda: {
            "material": simple(),
            "steps": [dielast.VoltageStep(1e3), dielast.VoltageStep(duration=1.0)],
            "film": FILM,
            "output": FEW_ROWS,
        },
        "bootstrap_master_curve": lambda: {"curves": curves(), "master": master(), "draws": 2},
        "build_master_curve": lambda: {"curves": curves(), "reference_temperature": 20.0},
        "calibrate": lambda: {
            "tests": [pulled()],
            "material": simple(),
            "free": {"equilibrium.shear_modulus": dielast.Free()},
            "starts": 1,
            "intervals": dielast.Intervals(draws=0),
        },
        "continuous_spectrum": lambda: {"fit": fitted()},
        "Circuit": lambda: {"resistance": 1e6, "leakage": dielast.Leakage(1e-13), "electrode_area": 1e-4},
        "Failure": lambda: {"breakdown_field": 4e7, "stop_at": "end"},
        "Film": lambda: {"thickness": 5e-4, "prestretch": 1.9, "relax": 60.0},
        "Goal": lambda: {"at": 1.0, "horizon": 2.0, "relative_stretch": 1.05},
        "HeldVoltages": lambda: {"values": 4e3, "horizon": 10.0},
        "Intervals": lambda: {"level": 0.8, "draws": 0},
        "Output": lambda: {"times": [1.0], "points_per_decade": 3},
        "Solver": lambda: {"rtol": 1e-6},
        "creep": lambda: {"material": simple(), "steps": [dielast.Step(stress=1e4, duration=1.0)], "output": FEW_ROWS},
        "design": lambda: {"material": simple(), "film": FILM, "goal": dielast.Goal(1.0, 2.0, 1.05)},
        "draw_sample": lambda: {"members": [vhb()], "draws": 2},
        "export_card": lambda: {"material": simple(), "form": "abaqus"},
        "failure_map": lambda: {"material": simple(), "film": FILM, "voltages": HELD},
        "film_limits": lambda: {"material": simple(), "stretch": [1.5, 2.0], "thickness": 5e-4},
        "find_outline": lambda: {"grey": disc()},
        "fit_creep": lambda: {"reduced_time": TIME, "creep_compliance": 1e-6 * (2 - np.exp(-TIME / 50)), "branches": 5},
        "fit_lifetime": lambda: {"result": mapped()},
        "fit_oscillation": lambda: {
            "reduced_angular_frequency": TIME,
            "storage_modulus": 3 * spectrum.storage_modulus(TIME, 1e4),
            "loss_modulus": 3 * spectrum.loss_modulus(TIME),
            "branches": 5,
        },
        "fit_spectrum": lambda: {"reduced_time": TIME, "modulus": curves()[1].modulus, "branches": 5, "polynomial_degree": 3},
        "interval": lambda: {"values": np.arange(30.0), "level": 0.9},
        "life_sensitivity": lambda: {"material": simple(), "film": FILM, "voltages": HELD},
        "measure_electrode": lambda: {"pictures": [disc()], "time": [0.0]},
        "plan_failure_map": lambda: {"material": simple(), "film": FILM, "voltages": HELD},
        "plot_master_curve": lambda: {"result": master(), "curves": curves()},
        "plot_sensitivity": lambda: {"results": sensitive(), "labels": ()},
        "plot_spectrum": lambda: {"result": fitted(), "title": "5 branches"},
        "read_draws": lambda: {"path": drawn_material(folder)},
        "read_material": lambda: {"path": resolve(Path(), "example:vhb4905.toml")},
        "reduce_spectrum": lambda: {
            "spectrum": dielast.Spectrum([3.0, 2.0, 1.0], [1e4, 1e4, 1e4]),
            "equilibrium_modulus": 1e4,
            "shift": dielast.NoShift(20.0),
            "window": (1.0, 10.0),
            "tolerance": 0.1,
        },
        "relax": lambda: {"material": simple(), "steps": [step], "output": FEW_ROWS},
        "relaxation_from_retardation": lambda: {"retardation": dielast.RetardationSpectrum([10.0], [1e-5], 1e-5)},
        "retardation_from_relaxation": lambda: {"spectrum": spectrum, "equilibrium_modulus": 1e4},
        "solve_map": lambda: {"plan": planned()},
        "write_material": lambda: {"material": vhb()},
        "without_ramp": lambda: {"curves": curves(), "ramp": 1.0},
    }
    return valid[name]()


def refusal(name: str, arguments: dict[str, Any]) -> DielastError | None:
    """The error that a function raises, None for none."""
    try:
        getattr(dielast, name)(**arguments)
    except DielastError as error:
        return error
    return None


@pytest.mark.parametrize("name", names())
@pytest.mark.filterwarnings("ignore")
def test_a_wrong_type_is_an_input_error_that_names_the_argument(name: str, tmp_path: Path) -> None:
    valid, signed = arguments_of(name, tmp_path), inspect.signature(getattr(dielast, name)).parameters.values()
    defaults = {one.name: one.default for one in signed}
    assert refusal(name, valid) is None
    for argument in sorted(defaults):
        error = refusal(name, {**valid, argument: object()})
        assert isinstance(error, InputError), argument
        assert error.problems[0].argument == argument, error
        assert "is needed" in str(error)
        for wrong in WRONG:  # some are allowed for some arguments
            if wrong is None and argument not in valid and defaults[argument] is None:
                continue  # the call above, once more
            other = refusal(name, {**valid, argument: wrong})
            assert other is None or "\n" not in str(other.problems[0])
