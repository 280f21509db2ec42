"""What voltage tests give: `python tests/bench/bench_voltage_tests.py speed | laboratories [COUNT [FIRST]]`.

A laboratory has a material whose springs are gent-i2, and six uniaxial tests of it; in the second part, two films under voltage,
too. The voltage for a relative stretch of 1.2 at prestretch 3 is predicted from draws of all laws that the tests cannot tell apart.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dielast import Free, Gent, GentI2, Material, MeasuredTest, NoShift, Spectrum, VoltageTest
from dielast.calibration.experiment import Experiment
from dielast.calibration.fit import fit_material
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.laws import cross_validation, law_weights, mixed_draws, pieces_of
from dielast.calibration.result import Intervals, assessed, calibrate
from dielast.calibration.spring_pairs import reach_of, trial
from dielast.commands.calibrate.run import ALIKE
from dielast.material.material import VACUUM_PERMITTIVITY
from dielast.simulate.film_setup import Film

PERMITTIVITY = 4.2 * VACUUM_PERMITTIVITY
TRUTH = Material(
    "truth", 18e3, Spectrum([300.0, 30.0, 2.0], [8e3, 15e3, 40e3]), NoShift(20.0), Gent(90.0), Gent(55.0), permittivity=PERMITTIVITY
)
HIDDEN = replace(TRUTH, equilibrium_law=GentI2(90.0, 0.35, 0.9), nonequilibrium_law=GentI2(60.0, 0.35, 0.9))
START = replace(TRUTH, equilibrium_modulus=30e3, spectrum=Spectrum([200.0, 20.0, 1.0], [2e4, 2e4, 2e4]))
FREE = {f"{section}.shear_modulus": Free() for section in ("equilibrium", "nonequilibrium")} | {
    "nonequilibrium.relaxation_time": Free()
}
LAWS = ("gent", "mooney-rivlin", "yeoh", "ogden", "gent-i2")
RELATIVE = 1 + np.array([0.005, 0.01, 0.02, 0.035, 0.05, 0.075, 0.1, 0.13, 0.16, 0.2])
PROGRAMMES = ((2.0, 0.1, 0.0), (3.0, 0.03, 0.0), (4.0, 0.1, 0.0), (4.0, 0.01, 0.0), (2.0, 0.1, 1800.0), (3.5, 0.1, 1800.0))
SPECIMEN, MODEL, NOISE = 0.05, 0.02, 0.005


def specimen(material: Material, random: np.random.Generator) -> Material:
    """A specimen, whose moduli differ by a factor from those of the material."""
    factor = np.exp(SPECIMEN * random.standard_normal())
    spectrum = Spectrum(material.spectrum.relaxation_time, factor * np.array(material.spectrum.shear_modulus))
    return replace(material, equilibrium_modulus=factor * material.equilibrium_modulus, spectrum=spectrum)


def pulls(truth: Material, random: np.random.Generator, points: int = 40) -> list[Experiment]:
    """Six uniaxial tests: loading and unloading, and holds."""
    tests: list[Experiment] = []
    for number, (top, rate, hold) in enumerate(PROGRAMMES):
        up = (top - 1) / rate
        later = np.geomspace(up / 20, hold, points) if hold else np.linspace(0, 0.5 * up, points + 1)[1:]
        at = np.append(np.linspace(0, up, points + 1)[1:], up + later)
        stretch = np.interp(at, [0, up, up + (hold or up)], [1, top, top if hold else 1])
        blank = MeasuredTest("blank", at, stretch, np.ones(at.size), 20.0)
        distance = np.sqrt(3) * np.abs(blank.place[:, None] - blank.place) / 0.3
        along = np.linalg.cholesky((1 + distance) * np.exp(-distance) + 1e-9 * np.eye(at.size)) @ random.standard_normal(at.size)
        clean = Laboratory([blank]).answers([specimen(truth, random)])[0][0]
        off = 1 + MODEL * along + NOISE * random.standard_normal(at.size)
        tests.append(replace(blank, name=f"pull {number}", specimen=f"pull {number}", stress=clean * off))
    return tests


def films(truth: Material, random: np.random.Generator, unknown: bool = False) -> list[Experiment]:
    """Films in a frame at prestretch 2 and 3, whose stretch is measured at voltages; with an `unknown` ramp between two rates."""
    tests: list[Experiment] = []
    for prestretch in (2.0, 3.0):
        film = Film(1e-3, prestretch, relax=1800.0, boundary="frame", electrode_share=0.25)
        blank = VoltageTest("blank", np.full(RELATIVE.size, 2e4), RELATIVE, film, 100.0, 20.0, measure="relative_stretch")
        voltage = Laboratory([blank]).answers([specimen(truth, random)])[0][0]
        seen = RELATIVE + NOISE * (RELATIVE[-1] - 1) * random.standard_normal(RELATIVE.size)
        ramp = (10.0, 1000.0) if unknown else 100.0
        tests.append(VoltageTest(f"film {prestretch:g}", voltage, seen, film, ramp, 20.0, measure="relative_stretch"))
    return tests


def wanted(materials: Sequence[Material]) -> np.ndarray:
    """The voltage of each material for a relative stretch of 1.2 at prestretch 3, in a film 1 mm thick under dead load."""
    film = Film(1e-3, 3.0, relax=1800.0)
    test = VoltageTest("film", np.full(3, 2e4), np.array([1.05, 1.1, 1.2]), film, 100.0, 20.0, measure="relative_stretch")
    return Laboratory([test]).answers(materials)[0][:, -1]


def band(tests: Sequence[Experiment], laws: Sequence[str] = LAWS, draws: int = 100) -> tuple[np.ndarray, list[str]]:
    """The voltages of the draws of all laws that the tests cannot tell apart, and what these laws are."""
    found = []
    for law in laws:
        tried = trial(START, (law, law), FREE, reach_of(tests, START))
        fit = fit_material(tried.material, tests, tried.free, starts=2)
        found.append((law, fit, cross_validation(fit)))
    weights = law_weights([each for _, _, each in found if each is not None], pieces_of(found[0][1]))
    kept = [(law, fit, weight) for (law, fit, _), weight in zip(found, weights, strict=True) if weight >= ALIKE]
    results = [assessed(fit, intervals=Intervals(draws=draws)) for _, fit, _ in kept]
    members = mixed_draws(results, [weight for _, _, weight in kept])
    return wanted(members), [f"{law} {weight:.2f} ({fit.misfit:.1%})" for law, fit, weight in kept]


def bench_laboratories(count: int = 12, first: int = 0) -> None:
    """How often the band of 90 % holds the voltage of the truth, from uniaxial tests alone and with two films."""
    truth = float(wanted([HIDDEN])[0])
    for what in ("uniaxial", "with films"):
        inside, width, off = [], [], []
        for number in range(first, first + count):
            random = np.random.default_rng([number, 32])
            tests = pulls(HIDDEN, random)
            tests += films(HIDDEN, random) if what == "with films" else []
            volts, laws = band(tests)
            low, middle, high = np.nanquantile(volts, (0.05, 0.5, 0.95))
            inside.append(low <= truth <= high)
            width.append(high / low)
            off.append(middle / truth - 1)
            print(f"{what} {number}: {low:.0f} to {high:.0f} V, truth {truth:.0f} V; {', '.join(laws)}", flush=True)
        far = np.sqrt(np.mean(np.square(off)))
        print(f"{what}: {np.mean(inside):.0%} of {count} hold the truth, high/low {np.median(width):.2f}, {far:.1%} off")


def bench_speed() -> None:
    """Six uniaxial tests and two films in frames, 10 parameters, 8 starts."""
    random = np.random.default_rng([0, 32])
    free = FREE | {f"{section}.J_lim": Free(min=12, max=1e4) for section in ("equilibrium", "nonequilibrium")}
    free["dielectric.permittivity"] = Free()
    tests = pulls(TRUTH, random) + films(TRUTH, random)
    for what, run in (("fit", fit_material), ("calibrate, with profiles and 200 draws", calibrate)):
        begin, busy = time.perf_counter(), time.process_time()
        if run is fit_material:
            fit = fit_material(START, tests, free)
            print(f"{len(fit.space)} parameters, {fit.same_share:.0%} of 8 starts in the best")
        else:
            calibrate(tests, START, free)
        print(f"{what}: {time.perf_counter() - begin:.1f} s, {time.process_time() - busy:.1f} s of the processor", flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "speed":
        bench_speed()
    else:
        bench_laboratories(*map(int, sys.argv[2:]))
