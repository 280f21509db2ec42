from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from flat import relax
from readings import relaxation_curves

from dielast import WLF, Gent, Material, Spectrum, build_master_curve
from dielast.base.errors import InputError
from dielast.io.files import Inputs
from dielast.mechanics.load import Step
from dielast.readings.recipe import MeasurementData

TEMPERATURES = [0.0, 10.0, 20.0, 30.0]
LAW = WLF(20.0, 13.7, 187.1)


@pytest.fixture(scope="module")
def test_with_a_ramp(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A relaxation test as a machine records it: 1 % strain within 1 s, then held."""
    tau = np.geomspace(1e-6, 1e4, 31)
    material = Material("any", 26e3, Spectrum(tau, 2e4 * tau**-0.3), LAW, Gent(), Gent())
    times = np.concatenate([[0.5], np.geomspace(1.05, 1000, 60)])
    history = relax(material, [Step(stretch=1.01, rate=0.01), Step.hold(999.0)], temperature=TEMPERATURES, times=times)
    rows = ["T [degC],t [s],strain [%],stress [kPa]"]
    for case, temperature in enumerate(TEMPERATURES):
        strain, stress = 100 * (history.stretch_1[case] - 1), history.nominal_stress_1[case] / 1e3
        rows += [
            f"{temperature},{t!r},{e!r},{s!r}" for t, e, s in zip(times.tolist(), strain.tolist(), stress.tolist(), strict=True)
        ]
    path = tmp_path_factory.mktemp("ramp") / "dma.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def curves(path: Path, **options: str) -> list:
    columns = {"temperature": "T", "time": "t", "strain": "strain", "stress": "stress"}
    data = MeasurementData.model_validate({"file": path.name, "columns": columns, **options}, context={"folder": path.parent})
    return relaxation_curves(data, Inputs(path.parent))


def worst_shift_error(found: list) -> float:
    master = build_master_curve(found, reference_temperature=20.0, temperature_stderr=0.0)
    return float(np.max(np.abs(master.log10_shift_factor - LAW.log10_shift_factor(master.temperature))))


@pytest.mark.filterwarnings("ignore:the master curve has no plateau")
def test_times_counted_from_the_middle_of_the_ramp_give_the_true_shift(test_with_a_ramp: Path) -> None:
    # nearly a power law, along which a curve slides by 0.01 decade for an offset of 0.7 %, which is allowed for
    assert worst_shift_error(curves(test_with_a_ramp, ramp="1 s")) < 0.012


def test_points_before_twice_the_ramp_are_dropped(test_with_a_ramp: Path) -> None:
    (first, *_) = curves(test_with_a_ramp, ramp="1 s")
    assert first.time.min() == pytest.approx(1.5, abs=0.2)
    (first, *_) = curves(test_with_a_ramp, ramp="1 s", discard_before="10 s")
    assert first.time.min() >= 9.5
    with pytest.raises(InputError, match="no points are left from 5000 s on"):
        curves(test_with_a_ramp, discard_before="5000 s")


def test_stress_over_strain_is_youngs_modulus(test_with_a_ramp: Path) -> None:
    tau = np.geomspace(1e-6, 1e4, 31)
    reference = curves(test_with_a_ramp, ramp="1 s")[2]
    exact = 3 * Spectrum(tau, 2e4 * tau**-0.3).relaxation_modulus(reference.time, 26e3)
    # at 1 % strain a neo-Hookean strip is 1 % softer than its small-strain limit
    np.testing.assert_allclose(reference.modulus, exact, rtol=0.015)
