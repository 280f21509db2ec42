"""What voltage tests give: `python tests/bench/bench_voltage_tests.py speed | uniaxial | films [--laboratories N] [--first K]`.

A laboratory has a material whose springs are gent-i2, and six uniaxial tests of it; with "films", two films under voltage, too. The
voltage for a relative stretch of 1.2 at prestretch 3 is predicted from draws of all laws that the tests cannot tell apart. The
laboratories are calibrated side by side, with one start, 12 points of a curve, and at most 48 moves of a chain.

Measured, `uniaxial --first 3001 --laboratories 60`: 53 of 60 bands hold the truth, their width is 1.06 to 2.13 times that from
the truth to the laws (1.37 in the middle), and the best law is off by 49 %. The draws of gent-i2 take 40 s of the processor for a
laboratory; with `--folder`, a bench that was stopped goes on. `films --first 2001 --laboratories 36`: 36 of 36 bands hold the
truth, the draws of all laws together 34; the truth has 2 to 96 % of the draws below it (58 in the middle), bands are 21 % of it
wide in the middle, and the best law is off by 3 %.
`speed`: 23 s of the processor for the fit, 55 s with profiles and 200 draws.
"""

from __future__ import annotations

import argparse
import os
import pickle
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from parts import add, arguments, read
from together import Together

from dielast import Free, Gent, GentI2, Material, MeasuredTest, NoShift, Spectrum, VoltageTest
from dielast.calibration import posterior
from dielast.calibration.experiment import Experiment
from dielast.calibration.fit import Fit, fit_material
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.laws import ALIKE, CrossValidation, cross_validation, law_weights, mixed_draws, pieces_of
from dielast.calibration.result import Intervals, assessed, calibrate
from dielast.calibration.spring_pairs import reach_of, trial
from dielast.material.intervals import interval
from dielast.material.material import VACUUM_PERMITTIVITY
from dielast.material.scatter import draw_sample
from dielast.numerics.arrays import Floats, Index
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
MOVES = 48  # of the chains, at most


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
        voltage = voltage * (1 + NOISE * random.standard_normal(RELATIVE.size))
        ramp = (10.0, 1000.0) if unknown else 100.0
        tests.append(VoltageTest(f"film {prestretch:g}", voltage, RELATIVE, film, ramp, 20.0, measure="relative_stretch"))
    return tests


def wanted(materials: Sequence[Material]) -> np.ndarray:
    """The voltage of each material for a relative stretch of 1.2 at prestretch 3, in a film 1 mm thick under dead load."""
    film = Film(1e-3, 3.0, relax=1800.0)
    test = VoltageTest("film", np.full(3, 2e4), np.array([1.05, 1.1, 1.2]), film, 100.0, 20.0, measure="relative_stretch")
    return Laboratory([test]).answers(materials)[0][:, -1]


@dataclass(frozen=True)
class Band:
    """Draws of all laws that the tests of a laboratory cannot tell apart, with the `weight` of each law: the `volts` (draws,) of
    the draws, the number of the law of each (`law`), and that of its law and part of the range of undetermined constants (`part`).
    """

    weight: dict[str, float]
    volts: Floats
    law: Index
    part: Index


@dataclass(frozen=True)
class Drawn:
    """The `materials` of the draws of one law, as `calibrate` writes them."""

    materials: tuple[Material, ...]


@dataclass(frozen=True)
class Kept:
    """Steps of laboratories, which are taken side by side and, with a `folder`, kept there: a bench that was stopped goes on."""

    folder: Path | None

    def __call__(self, name: str, tasks: Mapping[int, Callable[[], Any]]) -> dict[int, Any]:
        """The result of each laboratory's task, by its number; `name` is that of the step."""
        found = {number: pickle.loads(path.read_bytes()) for number in tasks if (path := self._path(name, number)).is_file()}
        left = [number for number in tasks if number not in found]
        for number, made in zip(left, Together()([tasks[number] for number in left]) if left else [], strict=True):
            found[number] = made
            if self.folder is not None:
                self._path(name, number).write_bytes(pickle.dumps(made))
        print(f"{name}: {len(tasks)} laboratories, {time.process_time():.0f} s of the processor so far", flush=True)
        return found

    def _path(self, name: str, number: int) -> Path:
        return (self.folder or Path(os.devnull)) / f"{name} {number}.pickle"


def bands(laboratories: Mapping[int, Sequence[Experiment]], draws: int, kept: Kept, what: str) -> dict[int, Band]:
    """The band of each laboratory, of draws as `calibrate` writes them."""

    def tried(tests: Sequence[Experiment], law: str) -> tuple[Fit, CrossValidation | None]:
        material, free = trial(START, (law, law), FREE, reach_of(tests, START))
        fit = fit_material(material, tests, free, starts=1)
        return fit, cross_validation(fit)

    def drawn(fit: Fit) -> Drawn:
        return Drawn(assessed(fit, intervals=Intervals(draws=draws)).materials)

    found = {law: kept(f"{what} {law} fit", {k: partial(tried, tests, law) for k, tests in laboratories.items()}) for law in LAWS}
    weights = {
        k: dict(zip(LAWS, law_weights([found[law][k][1] for law in LAWS], pieces_of(found[LAWS[0]][k][0])).tolist(), strict=True))
        for k in laboratories
    }
    results: dict[int, dict[str, Drawn]] = {k: {} for k in laboratories}
    for law in LAWS:
        alike = {k: partial(drawn, found[law][k][0]) for k in laboratories if weights[k][law] >= ALIKE}
        for k, each in kept(f"{what} {law} draws", alike).items():
            results[k][law] = each
    return {k: _band(own, {law: weights[k][law] for law in own}) for k, own in results.items()}


def _band(results: dict[str, Drawn], weight: dict[str, float]) -> Band:
    known = [each.materials[0].calibrated for each in results.values()]
    paths = tuple(dict.fromkeys(path for each in known if each is not None for path in each.undetermined))
    members = [
        replace(member, calibrated=replace(member.calibrated, undetermined=paths))  # type: ignore[type-var]
        for member in mixed_draws(list(results.values()), list(weight.values()))  # type: ignore[arg-type]
    ]
    law = np.array([list(results).index(member.equilibrium_law.name) for member in members])
    part = draw_sample(members, len(members), specimens=False).laws
    return Band(weight, wanted(members), law, law if part is None else part)


@dataclass(frozen=True)
class Outcome:
    """The band of 90 % of a laboratory from `low` to `high`, in V; the voltage that the best law gives (`best`), the share of draws
    `below` the truth, and the 5 and 95 % quantiles of each law with its weight; `needed` is the logarithm of the ratio from the
    least to the largest of the truth and the laws.
    """

    low: float
    high: float
    best: float
    below: float
    needed: float
    laws: dict[str, tuple[float, float, float]]

    @property
    def width(self) -> float:
        """The width of the band over what is needed, in logarithms."""
        return float(np.log(self.high / self.low)) / self.needed

    def holds(self, true: float) -> bool:
        """Whether the band holds the `true` voltage, in V."""
        return self.low <= true <= self.high

    @property
    def holds_by_all_draws(self) -> bool:
        """Whether the middle 90 % of the draws of all laws together hold it."""
        return 0.05 <= self.below <= 0.95


def truth() -> float:
    """The voltage of the material of all laboratories."""
    return float(wanted([HIDDEN])[0])


def outcomes(what: str, count: int, first: int, folder: Path | None = None, draws: int = 200) -> list[Outcome]:
    """Laboratories with uniaxial tests alone ("uniaxial") or with two films as well ("films"), from the number `first` on; with a
    `folder`, the steps that it has are not taken again.
    """
    posterior.MOST_MOVES = MOVES
    true, found = truth(), []
    laboratories: dict[int, list[Experiment]] = {}
    for number in range(first, first + count):
        random = np.random.default_rng([number, 32])
        tests = pulls(HIDDEN, random, 12)
        laboratories[number] = tests + (films(HIDDEN, random) if what == "films" else [])
    for band in bands(laboratories, draws, Kept(folder), what).values():
        low, high = interval(band.volts, 0.9, band.part)
        below = float(np.mean(band.volts[~np.isnan(band.volts)] < true))
        own = {law: band.volts[band.law == k] for k, law in enumerate(band.weight)}
        middle = [float(np.nanmedian(values)) for values in own.values()]
        best = middle[int(np.argmax(list(band.weight.values())))]
        needed = float(np.log(max(*middle, true) / min(*middle, true)))
        laws = {
            law: (band.weight[law], float(np.nanquantile(values, 0.05)), float(np.nanquantile(values, 0.95)))
            for law, values in own.items()
        }
        found.append(Outcome(float(low), float(high), best, below, needed, laws))
    return found


def bench_laboratories(what: str, count: int = 12, first: int = 0, file: Path | None = None, folder: Path | None = None) -> None:
    """How often the band of 90 % holds the voltage of the truth, from uniaxial tests alone or with two films; with a `file`, over
    all laboratories that it has.
    """
    true = truth()
    every = outcomes_of(file, what)
    made = outcomes(what, count, first, folder) if count else []
    for number, each in enumerate(made, first):
        add(file, what, number, asdict(each))
        laws = ", ".join(f"{law} {weight:.2f} ({low:.0f} to {high:.0f})" for law, (weight, low, high) in each.laws.items())
        band = f"{each.low:.0f} to {each.high:.0f} V, {each.below:.0%} below the truth of {true:.0f} V"
        print(f"{what} {number}: {band}; width {each.width:.2f}; {laws}", flush=True)
    found = list((every | dict(enumerate(made, first))).values())
    inside, mixed = sum(each.holds(true) for each in found), sum(each.holds_by_all_draws for each in found)
    off = np.sqrt(np.mean([(each.best / true - 1) ** 2 for each in found]))
    print(f"{what}: {inside} of {len(found)} hold the truth, {mixed} by the draws of all laws together; the width is")
    print(f"{np.median([each.width for each in found]):.2f} times that from the truth to the laws, in logarithms; the best law is")
    print(f"off by {off:.1%}; the ends of bands differ by a factor of {np.median([each.high / each.low for each in found]):.2f}")


def outcomes_of(file: Path | None, what: str) -> dict[int, Outcome]:
    """The outcomes that a file has, by the numbers of their laboratories."""
    names = [field.name for field in fields(Outcome)]
    return (
        {}
        if file is None
        else {number: Outcome(**{name: line[name] for name in names}) for number, line in read(file, what).items()}
    )


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


def main() -> None:
    """Run a part of the bench."""
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=("speed", "uniaxial", "films"))
    arguments(parser, 12)
    parser.add_argument("--folder", type=Path, help="keep the steps of each laboratory here, and go on from those that it has")
    options = parser.parse_args()
    if options.what == "speed":
        bench_speed()
    else:
        bench_laboratories(options.what, options.laboratories, options.first, options.file, options.folder)


if __name__ == "__main__":
    main()
