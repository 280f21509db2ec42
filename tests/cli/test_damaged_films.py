"""Films with `[damage]` in recipes: events, maps that go on, figures, draws, and what may be wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from processes import Run
from tables import rows

from dielast.handover.material_file import parse_material, write_material
from dielast.material.damage import InversePower

MATERIAL = """\
name = "film"
reference_temperature = "20 degC"
[equilibrium]
shear_modulus = "26 kPa"
J_lim = 110.0
[nonequilibrium]
J_lim = 55.0
relaxation_time_s = [1e4, 0.1]
shear_modulus_Pa = [1e4, 9e4]
[shift]
law = "none"
[dielectric]
permittivity = "4e-11 F/m"
"""
DAMAGE = '[damage]\nfield = "30 MV/m"\ntime = "10 min"\nexponent = 18.5\n'
FILM = 'material = "film.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.9\nrelax = "10 min"\n'
ACTUATE = f'kind = "actuate"\n{FILM}[[step]]\nvoltage = "3.2 kV"\nduration = "1 s"\n[[step]]\nhold = "1 h"\n[stop]\nat = "damage"\n'
PRESTRETCHES = FILM.replace("= 1.9", "= [1.7, 1.75, 1.8, 1.85, 1.9]")
MAP = f'kind = "failure-map"\nhorizon = "1 h"\n{PRESTRETCHES}[voltage]\nfrom = "2.4 kV"\nto = "4 kV"\npoints = 5\n'
DRAWS_INLINE = '{ draws = 19, breakdown_field = { law = "weibull", shape = 20 } }'
DRAWS = '[uncertainty]\ndraws = 19\nbreakdown_field = { law = "weibull", shape = 20 }\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "film.toml").write_text(MATERIAL + DAMAGE)
    (tmp_path / "map.toml").write_text(MAP)
    (tmp_path / "actuate.toml").write_text(ACTUATE)
    return tmp_path


def test_a_run_stops_at_the_damage_and_its_draws_have_bounds(folder: Path, dielast: Run) -> None:
    done = dielast("actuate", "actuate.toml", "-o", "one", "--plot", "svg")
    assert done.returncode == 0, done.stderr
    (event,) = rows(folder / "one/events.csv")
    assert event["event"] == "damage"
    end = rows(folder / "one/actuate.csv")[-1]
    assert end["time [s]"] == event["time [s]"]
    assert float(end["damage [1]"]) == pytest.approx(1.0, rel=1e-7)
    assert "damage" in (folder / "one/actuate.svg").read_text()
    (folder / "actuate.toml").write_text(ACTUATE + DRAWS)
    done = dielast("actuate", "actuate.toml", "-o", "many", "--plot", "none")
    assert done.returncode == 0, done.stderr
    (bounded,) = rows(folder / "many/events.csv")
    low, time, high = (float(bounded[f"time{which} [s]"]) for which in ("_lower", "", "_upper"))
    assert low < time == float(event["time [s]"]) < high


def test_the_damage_at_failure_scatters_with_shape_and_area(folder: Path, dielast: Run) -> None:
    times = []
    for area in ("", ', area = "400 mm^2", reference_area = "1 cm^2"'):
        (folder / "actuate.toml").write_text(ACTUATE + f"[uncertainty]\ndraws = 19\ndamage = {{ shape = 2{area} }}\n")
        done = dielast("actuate", "actuate.toml", "-o", "out", "--plot", "none")
        assert (done.returncode, done.stderr) == (0, "")
        (event,) = rows(folder / "out/events.csv")
        times.append([float(event[f"time{which} [s]"]) for which in ("_lower", "", "_upper")])
    assert all(low < time < high for low, time, high in times)
    assert all(larger < smaller for larger, smaller in zip(times[1], times[0], strict=True))
    # when 63.2 % of the larger films have failed, the film of the reference area has D = 4^(-1/2)
    (folder / "actuate.toml").write_text(ACTUATE + f'[output]\ntimes = ["{times[1][1]!r} s"]\n')
    done = dielast("actuate", "actuate.toml", "-o", "out", "--plot", "none")
    assert done.returncode == 0, done.stderr
    assert float(rows(folder / "out/actuate.csv")[0]["damage [1]"]) == pytest.approx(0.5, rel=1e-6)
    (folder / "actuate.toml").write_text(ACTUATE + f"[uncertainty]\ndraws = 19\ndamage = {{ shape = 2{area} }}\n")
    for text, message in (
        ('{ shape = 2, area = "4 cm^2" }', "uncertainty.damage: area and reference_area belong together: state both or none"),
        ("{ shape = 0 }", "uncertainty.damage.shape: 0: a number above 0 is needed"),
        ('{ shape = 2, area = "4 cm", reference_area = "1 cm^2" }', 'uncertainty.damage.area: "4 cm": an area is needed'),
    ):
        done = dielast("actuate", "actuate.toml", "--set", f"uncertainty.damage={text}")
        assert done.returncode == 2
        assert message in done.stderr
    (folder / "film.toml").write_text(MATERIAL + '[breakdown]\nfield = "40 MV/m"\n')
    done = dielast("actuate", "actuate.toml", "--set", "stop.at=breakdown")
    assert (done.returncode, "uncertainty.damage: film.toml has no [damage] that could scatter" in done.stderr) == (2, True)


def test_films_that_only_pull_in(folder: Path, dielast: Run) -> None:
    (folder / "film.toml").write_text(MATERIAL)
    design = f'kind = "design"\n{FILM}[goal]\nrelative_stretch = 1.1\nat = "1 min"\nhorizon = "1 h"\n'
    (folder / "design.toml").write_text(design)
    (folder / "actuate.toml").write_text(ACTUATE.partition("[stop]")[0].replace("3.2 kV", "8 kV"))
    line = "warning: no breakdown field is known, so that pull-in alone ends a film: state [breakdown] field\n"
    for kind in ("actuate", "failure-map", "design"):
        done = dielast(kind, f"{kind.removeprefix('failure-')}.toml", "-o", kind, "--plot", "png")
        assert (done.returncode, done.stderr.count(line)) == (0, 1), done.stderr
    assert [event["event"] for event in rows(folder / "actuate/events.csv")] == ["pull-in"]
    assert {cell["failure_mode"] for cell in rows(folder / "failure-map/failure-map.csv")} == {"pull-in", "none"}
    for recipe, key in (("actuate", "stop.at"), ("map", "uncertainty.breakdown_field")):
        asked = ["--set", "stop.at=breakdown"] if recipe == "actuate" else ["--set", f"uncertainty={DRAWS_INLINE}"]
        kind = recipe if recipe == "actuate" else "failure-map"
        done = dielast(kind, f"{recipe}.toml", *asked, "-o", "none")
        assert (done.returncode, (folder / "none").exists()) == (2, False)
        assert done.stderr.startswith(f"{recipe}.toml: {key}: ")
        assert "[breakdown] field" in done.stderr


def test_a_map_without_a_breakdown_field_is_about_damage(folder: Path, dielast: Run) -> None:
    (folder / "map.toml").write_text(MAP + DRAWS)
    done = dielast("failure-map", "map.toml", "-o", "out", "--plot", "svg")
    assert (done.returncode, done.stderr) == (0, "")
    cells = rows(folder / "out/failure-map.csv")
    assert {cell["failure_mode"] for cell in cells} == {"damage", "none"}
    assert all(cell["time_to_damage [s]"] == cell["time_to_failure [s]"] and not cell["time_to_breakdown [s]"] for cell in cells)
    assert {"time_to_damage_lower [s]", "time_to_damage_upper [s]", "failure_probability [1]"} <= cells[0].keys()
    assert "damage first" in (folder / "out/failure-map.svg").read_text()
    assert "\ndamage = " in (folder / "out/summary.toml").read_text()


@pytest.mark.trust
def test_a_disc_in_a_frame_ages_and_breaks_down_by_a_power_law(folder: Path, dielast: Run) -> None:
    framed = FILM + 'boundary = "frame"\nelectrode_share = "5 %"\n'
    power = '{ law = "power", field = "25 MV/m", stretch_exponent = 1.2, thickness_exponent = 0.1, reference_thickness = "0.1 mm" }'
    steps = '[[step]]\nvoltage = "5.5 kV"\n[[step]]\nhold = "2 min"\n[output]\npoints_per_decade = 60\n[stop]\nat = "end"\n'
    (folder / "film.toml").write_text(f"breakdown = {power}\n{MATERIAL}{DAMAGE.replace('30 MV/m', '48 MV/m')}")
    (folder / "actuate.toml").write_text(f'kind = "actuate"\n{framed}{steps}')
    done = dielast("actuate", "actuate.toml", "-o", "one", "--plot", "none")
    assert (done.returncode, done.stderr) == (0, "")
    events = {row["event"]: row for row in rows(folder / "one/events.csv")}
    assert list(events) == ["damage", "breakdown", "loss-of-tension"]
    stretch, field = (float(events["breakdown"][name]) for name in ("stretch_1 [1]", "true_field [V/m]"))
    assert field == pytest.approx(25e6 * stretch**1.2 * (0.5e-3 / stretch**2 / 0.1e-3) ** -0.1, rel=1e-6)
    table = rows(folder / "one/actuate.csv")
    time, fields = (np.array([float(row[name]) for row in table]) for name in ("time [s]", "true_field [V/m]"))
    aged = float(events["damage"]["time [s]"])
    here = time <= aged
    rate = np.append(fields[here], float(events["damage"]["true_field [V/m]"])) / 48e6
    assert np.trapezoid(rate**18.5, np.append(time[here], aged)) / 600 == pytest.approx(1.0, rel=0.02)
    (folder / "map.toml").write_text(f'kind = "failure-map"\nhorizon = "2 min"\n{framed}[voltage]\nvalues = "5.5 kV"\n')
    done = dielast("failure-map", "map.toml", "-o", "out", "--set", 'film.electrode_share=["5 %", 0.5]', "--plot", "none")
    assert (done.returncode, done.stderr) == (0, "")
    near, far = rows(folder / "out/failure-map.csv")
    for name, event in events.items():
        assert float(near[f"time_to_{name.replace('-', '_')} [s]"]) == pytest.approx(float(event["time [s]"]), rel=1e-4)
    assert float(far["time_to_failure [s]"]) > aged  # a frame next to the disc holds it back
    (folder / "actuate.toml").write_text(f'kind = "actuate"\n{framed}{steps.replace("end", "damage")}{DRAWS}')
    done = dielast("actuate", "actuate.toml", "-o", "many", "--plot", "none")
    assert done.returncode == 0, done.stderr
    (bounded,) = [row for row in rows(folder / "many/events.csv") if row["event"] == "damage"]
    low, time, high = (float(bounded[f"time{which} [s]"]) for which in ("_lower", "", "_upper"))
    assert low < time == aged < high


def test_the_law_is_read_and_written() -> None:
    material = parse_material((MATERIAL + DAMAGE).encode(), "film.toml")
    assert material.damage == InversePower(30e6, 600.0, 18.5)
    assert parse_material(write_material(material), "again.toml").damage == material.damage
    assert b"damage" not in write_material(parse_material(MATERIAL.encode(), "film.toml"))
