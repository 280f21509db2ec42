"""`spectrum`: master curve -> discrete relaxation spectrum and material file."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.base.errors import InputError, Mistakes, Problem, in_keys, located, warn, without_warnings
from dielast.commands.spectrum.recipe import (
    FIT_KEYS,
    REDUCE_KEYS,
    FitSection,
    MaterialConstants,
    Reduce,
    RelaxationTimes,
    SpectrumRecipe,
)
from dielast.commands.spectrum.sources import (
    card_of,
    curve_of,
    exported,
    material_files,
    moduli_headline,
    run_card,
    with_constants,
)
from dielast.handover.mastercurve_folder import DRAWS, ReadDraws, ReducedCurve
from dielast.handover.material_draws import draw_columns
from dielast.io.files import Inputs
from dielast.io.table import Table
from dielast.material.checks import warn_of_material
from dielast.material.material import Material, Window, paths_of
from dielast.material.measurement_kind import CREEP, RELAXATION
from dielast.material.shift import ShiftLaw
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import Case
from dielast.relaxation.beyond import OpenEnd, end_of
from dielast.relaxation.checks import Plateaus
from dielast.relaxation.continuous import ContinuousSpectrum, continuous_spectrum
from dielast.relaxation.creep import fit_creep
from dielast.relaxation.fit import fit_oscillation, fit_spectrum
from dielast.relaxation.reduce import Reduction, reduce_spectrum
from dielast.relaxation.result import SpectrumFit
from dielast.relaxation.spectrum_draws import CurveDraws, draw_spectra
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution

BEYOND = 3.0  # factor beyond the ends of a master curve up to which its processes still act


def run(cases: Sequence[Case[SpectrumRecipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Read the master curve, fit the spectrum, and make the report."""
    recipe = cases[0].recipe
    if recipe.prony is not None:
        return run_card(recipe, inputs)
    curve = curve_of(recipe, inputs)
    result, reduction, material, cards = characterise(recipe, curve)
    continuous = continuous_spectrum(result) if recipe.fit.continuous else None

    def figure() -> Any:
        from dielast.commands.simulation.naming import headed
        from dielast.plots.spectrum import plot_spectrum

        at = curve.shift.reference_temperature
        title = headed(recipe.title, [material.name], f"reference temperature {at:g} degC")
        measured = "measured" if recipe.mastercurve is None else "master curve"
        return plot_spectrum(result, title, continuous=continuous, reduction=reduction, reference_temperature=at, measured=measured)

    drawn = None if curve.draws is None else draw_materials(curve.draws, curve, result, material, recipe.whole_fit)
    written, numbers = tables(result, continuous, reduction), headline(result, continuous, reduction)
    if curve.data is not None:
        numbers["data"] = dict(curve.data)
    if drawn is not None:
        written[DRAWS], numbers["uncertainty"] = drawn
    return RunReport(written, numbers, figure, material_files(material, cards, None if drawn is None else DRAWS))


def prepared(cases: Sequence[Case[SpectrumRecipe]], inputs: Inputs) -> object:
    """The master curve or the test, and its fit: without the fit it is not known what a card or fewer branches can hold."""
    recipe = cases[0].recipe
    if recipe.prony is not None:
        return card_of(recipe, inputs)
    return characterise(recipe, curve_of(recipe, inputs))


def characterise(recipe: SpectrumRecipe, curve: ReducedCurve) -> tuple[SpectrumFit, Reduction | None, Material, dict[str, str]]:
    """The spectrum of the curve, its reduction, its material, and the cards (name -> text) that the recipe requests.

    Raises `InputError` with a line for everything, draws apart, that the recipe asks of the curve and that cannot be had.
    """
    wrong = Mistakes()
    if recipe.fit.continuous and curve.kind is CREEP:
        wrong.append(Problem("a creep curve has no continuous relaxation spectrum, only a discrete one", key="fit.continuous"))
    end = end_of(fit_curve(curve, recipe.whole_fit, recipe.truncate.keep if recipe.truncate else None), recipe.fit.states_the_end)
    result = end.fit if curve.draws is None else end.carried_on()  # as the draws, which need slower branches
    reduce, export = recipe.reduce, recipe.export
    reduction = wrong.tried(lambda: reduced(result, curve.shift, reduce)) if reduce else None
    material, cards = with_origin(make_material(result, curve, recipe.material, reduction, end), recipe.fit), None
    warn_of_material(material)
    if export is not None:
        options = replace(export.options(), notes=_validity(result, recipe, reduction))
        cards = wrong.tried(lambda: exported(material, export, options))
    if reduce is not None and reduction is None:  # the branches are too many because the reduction failed
        wrong = Mistakes(problem for problem in wrong if problem.key != "export.formats")
    wrong.refuse()
    return result, reduction, material, cards or {}


def fit_curve(curve: ReducedCurve, fit: FitSection, keep: int | None = None, flows: bool | None = None) -> SpectrumFit:
    """The spectrum of a master curve of any kind; raises `InputError` if the method is not for this kind.

    `flows` is that of `fit_creep`.
    """
    ends = fit.relaxation_time.min, fit.relaxation_time.max
    with in_keys(FIT_KEYS):
        plateaus = Plateaus(fit.equilibrium_modulus, fit.glassy_modulus, fit.liquid)
        known: dict[str, Any] = {"branches": fit.branches, "plateaus": plateaus, "keep": keep}
        if curve.kind is RELAXATION:
            method, degree = fit.method or "nnls", fit.polynomial_degree
            return fit_spectrum(*curve.columns, method=method, polynomial_degree=degree, relaxation_time=ends, **known)
        if fit.method == "schwarzl-staverman":
            raise InputError(f'"schwarzl-staverman" reads a relaxation modulus; {curve.kind.name} needs "nnls"', argument="method")
        if curve.kind is CREEP:
            return fit_creep(*curve.columns, retardation_time=ends, flows=flows, **known)
        return fit_oscillation(*curve.columns, relaxation_time=ends, **known)


def draw_materials(
    read: ReadDraws, curve: ReducedCurve, result: SpectrumFit, material: Material, fit: FitSection
) -> tuple[Table, dict[str, Any]]:
    """A material for each draw of the master curve: their table, and their section of the summary."""
    with without_warnings():  # the fit itself has issued them
        whole = fit_curve(curve, fit)
    times = whole.spectrum.relaxation_time if whole.retardation is None else whole.retardation.retardation_time
    held = fit.model_copy(update={"branches": times.size})
    if times.size > 1:
        ends = RelaxationTimes.model_construct(min=float(times[-1]), max=float(times[0]))
        held = held.model_copy(update={"relaxation_time": ends})
    flows = None if whole.retardation is None else whole.retardation.fluidity > 0  # a solid is a solid in every draw

    def refit(abscissa: Floats, ordinates: Floats) -> SpectrumFit:
        return fit_curve(ReducedCurve(curve.kind, (abscissa, *ordinates), curve.shift), held, flows=flows)

    abscissa, *ordinates = curve.columns
    curves, is_open = CurveDraws(read.abscissa, read.ordinates), material.equilibrium_range is not None
    spectra = draw_spectra(
        abscissa,
        np.array(ordinates),
        curves,
        whole,
        refit,
        spectrum=material.spectrum,
        open_end=is_open,
        level_known=fit.states_the_end,
    )
    tau = material.spectrum.relaxation_time
    members = [
        replace(material, equilibrium_modulus=float(level), spectrum=Spectrum(tau, moduli), shift=read.shifts[place])
        for place, level, moduli in zip(spectra.used, spectra.equilibrium_modulus, spectra.shear_modulus, strict=True)
    ]
    numbers = {
        "draws": len(members),
        "without_spectrum": len(read.number) - len(members),
        "curve_scatter": spectra.scatter,
        "model_misfit": spectra.misfit,
    }
    return draw_columns(read.number[spectra.used], members), numbers


def reduced(result: SpectrumFit, shift: ShiftLaw, reduce: Reduce) -> Reduction:
    """The reduced spectrum of a recipe with `[reduce]`; raises `InputError` as `reduce_spectrum` does."""
    first, last = reduce.window
    with located(key="reduce"), in_keys(REDUCE_KEYS):
        reduction = reduce_spectrum(
            result.spectrum,
            result.equilibrium_shear_modulus,
            shift,
            window=(first, last),
            temperatures=reduce.temperatures,
            tolerance=reduce.tolerance,
        )
    _warn_of_unmeasured(result, shift, reduction, reduce)
    return reduction


def _validity(result: SpectrumFit, recipe: SpectrumRecipe, reduction: Reduction | None) -> tuple[str, ...]:
    """The note of a card on omitted branches; warns of a card for a temperature for which the spectrum was not reduced."""
    if recipe.truncate is not None:
        kept, shortest = len(result.spectrum), result.spectrum.relaxation_time[-1]
        return (f"Truncated to the {kept} slowest branches: what relaxes faster than {shortest:.3g} s is left out.",)
    if reduction is None or recipe.reduce is None:
        return ()
    first, last = recipe.reduce.window
    temperatures, error = np.unique(reduction.test_temperature), reduction.max_relative_error
    alone = None if recipe.export is None else recipe.export.temperature
    if alone is not None and not temperatures[0] <= alone <= temperatures[-1]:
        warn(f"{alone:g} degC is outside of reduce.temperatures: the spectrum was not reduced for it", key="export.temperature")
    there = ", ".join(f"{temperature:g}" for temperature in temperatures)
    return (
        f"Reduced from {len(result.spectrum)} to {len(reduction.spectrum)} branches: G(t) within {error:.2%} "
        f"from {first:g} to {last:g} s at {there} degC;",
        "faster processes are left out, so that the instantaneous modulus is not the glassy one.",
    )


def _warn_of_unmeasured(result: SpectrumFit, shift: ShiftLaw, reduction: Reduction, reduce: Reduce) -> None:
    """Warn if the window, at its temperatures, extends beyond the master curve."""
    known_from, known_to = float(result.reduced_time[0]) / BEYOND, float(result.reduced_time[-1]) * BEYOND
    temperatures = np.unique(reduction.test_temperature)
    faster = 10 ** -shift.log10_shift_factor(temperatures)
    first, last = faster.min() * reduce.window[0], faster.max() * reduce.window[1]
    reach = [f"to {last:.3g} s at {temperatures[faster.argmax()]:g} degC"] if last > known_to else []
    reach += [f"from {first:.3g} s at {temperatures[faster.argmin()]:g} degC"] if first < known_from else []
    if reach:
        warn(
            f"reduce.window reaches {' and '.join(reach)} in reduced time, but the master curve is known from "
            f"{result.reduced_time[0]:.3g} to {result.reduced_time[-1]:.3g} s: beyond, the reduced spectrum agrees with a whole "
            "one that is itself extrapolated"
        )


def tables(
    result: SpectrumFit, continuous: ContinuousSpectrum | None = None, reduction: Reduction | None = None
) -> dict[str, Table]:
    """The tables of a spectrum by file name; the comparison of a reduced spectrum has shear moduli."""
    spectrum = result.spectrum if reduction is None else reduction.spectrum
    written = {"spectrum.csv": spectrum.columns(), "fit.csv": result.columns()}
    if continuous is not None:
        written["continuous-spectrum.csv"] = continuous.columns()
    if reduction is not None:
        written["reduction.csv"] = reduction.columns()
    return written


def headline(result: SpectrumFit, continuous: ContinuousSpectrum | None, reduction: Reduction | None) -> dict[str, dict[str, Any]]:
    """The headline numbers of a spectrum by section of the summary."""
    spectrum = result.spectrum if reduction is None else reduction.spectrum
    numbers: dict[str, dict[str, Any]] = {
        "fit": {
            "method": result.method,
            "measurement": None if result.test == "relaxation" else result.test,
            "branches": len(result.spectrum),
            "rms_relative_error": result.rms_relative_error,
            "max_relative_error": result.max_relative_error,
            "clipped_branches": result.clipped_branches,
            "polynomial_rms_relative_error": result.polynomial_rms_relative_error,
            "smoothing": result.smoothing,
        },
        "moduli": moduli_headline(spectrum, result.equilibrium_shear_modulus),
    }
    if continuous is not None:
        numbers["continuous"] = {
            "integral_Pa": continuous.integral,
            "rms_relative_error": continuous.rms_relative_error,
            "smoothing": continuous.smoothing,
        }
    if reduction is not None:
        numbers["reduce"] = {
            "branches": len(reduction.spectrum),
            "max_relative_error": reduction.max_relative_error,
            "tolerance": reduction.tolerance,
            "temperature_degC": reduction.temperature,
            "time_s": reduction.time,
            "ramp_max_relative_error": reduction.max_relative_error_ramp,
        }
    return numbers


def with_origin(material: Material, fit: FitSection) -> Material:
    """The material that says of its constants whether the curve or the recipe states them."""
    measured = {"nonequilibrium.shear_modulus", "nonequilibrium.relaxation_time"}
    measured |= {"equilibrium.shear_modulus"} if fit.equilibrium_modulus is None and not fit.liquid else set()
    paths = paths_of(material)
    return replace(
        material, origin={path: "measured" if path in measured or path.startswith("shift.") else "stated" for path in paths}
    )


def make_material(
    result: SpectrumFit, curve: ReducedCurve, constants: MaterialConstants, reduction: Reduction | None, end: OpenEnd
) -> Material:
    """The material for simulations: the spectrum, its shift law, and the constants that no relaxation test determines."""
    material = Material(
        name=constants.name,
        equilibrium_modulus=result.equilibrium_shear_modulus,
        spectrum=result.spectrum if reduction is None else reduction.spectrum,
        shift=curve.shift,
        equilibrium_law=Gent(),
        nonequilibrium_law=Gent(),
        measured_temperature=curve.measured_temperature,
        equilibrium_scaling=curve.scaling,
        nonequilibrium_scaling=curve.scaling,
        window=Window((float(result.reduced_time[0]), float(result.reduced_time[-1])), end.reached),
        equilibrium_range=end.range,
    )
    return with_constants(material, constants)
