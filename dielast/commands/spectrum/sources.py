"""What `spectrum` reads: a folder of `mastercurve`, a test at one temperature or a curve from elsewhere, or a Prony series."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.base.errors import InputError, in_keys, located, reached_by, warn
from dielast.commands.spectrum.recipe import EXPORT_KEYS, ExportSection, MaterialConstants, SpectrumRecipe
from dielast.handover.export.card import export_cards
from dielast.handover.export.code import CardOptions
from dielast.handover.law_section import breakdown
from dielast.handover.mastercurve_folder import ReducedCurve, read_master_curve
from dielast.handover.material_file import write_material
from dielast.io.files import Inputs
from dielast.material.checks import warn_of_material
from dielast.material.material import Material, paths_of
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.numerics.arrays import Floats
from dielast.readings.recipe import CurveData
from dielast.relaxation.result import SpectrumFit
from dielast.report.report import RunReport

NO_SCATTER = 1.25  # times as large a value at the same time is no scatter of one test


def curve_of(recipe: SpectrumRecipe, inputs: Inputs) -> ReducedCurve:
    """The curve that a recipe names; raises `InputError` if it cannot be read."""
    if recipe.data is None:
        with reached_by("mastercurve"):
            return read_master_curve(str(recipe.mastercurve), inputs)
    with reached_by("data.file"):
        return read_curve(recipe.data, inputs)


def read_curve(data: CurveData, inputs: Inputs) -> ReducedCurve:
    """A test at one temperature, or a master curve from elsewhere, without a shift law; all runs of it together.

    Raises `InputError` naming file and line, column or step, or if there are several temperatures.
    """
    # readers that the folder of a master curve does not need
    from dielast.readings.isotherms import WIDEST
    from dielast.readings.read import read_all
    from dielast.readings.steps import TABLE

    dataset = read_all(data, inputs)
    temperature = [test.temperature for test in dataset.measurements]
    if max(temperature) - min(temperature) > data.temperature_tolerance:
        tests = f"there are tests from {min(temperature):g} to {max(temperature):g} degC"
        raise InputError(f'{tests}, and a spectrum is made of one temperature: "dielast mastercurve" joins several', file=data.file)
    measured, stated = round(math.fsum(temperature) / len(temperature), 6), data.reference_temperature
    if stated is not None and abs(measured - stated) > WIDEST * data.temperature_tolerance:
        raise InputError(
            f"the test was at {measured:g} degC, but reference_temperature is {stated:g} degC: leave one out", file=data.file
        )
    columns = np.concatenate([test.columns for test in dataset.measurements], axis=1)
    columns = columns[:, np.all(columns[1:] > 0, axis=0)]
    _warn_of_several(columns, data.file)
    at = measured if stated is None else stated
    exported = set(dataset.formats) != {TABLE}  # of a plain table the recipe says it all
    read = {**dataset.summary, "temperature_degC": at, "points": int(columns.shape[1])} if exported else None
    return ReducedCurve(dataset.kind, tuple(columns), NoShift(at), data=read)


def _warn_of_several(columns: Floats, source: str) -> None:
    """Warn of other values at the same times or frequencies: of several tests, perhaps, that are taken for one."""
    order = np.argsort(columns[0], kind="stable")
    x, y = columns[0, order], np.log(columns[1, order])
    starts = np.flatnonzero(np.append(True, np.diff(x) > 0))
    apart = np.exp(np.maximum.reduceat(y, starts) - np.minimum.reduceat(y, starts))
    if np.any(far := apart > NO_SCATTER):
        again = f"{np.count_nonzero(far)} times or frequencies appear again with values up to {apart.max():.3g} times as large"
        warn(f"{again}: are these several tests? Leave the rows of one in the file", file=source)


@reached_by("prony")
def card_of(recipe: SpectrumRecipe, inputs: Inputs) -> tuple[Material, dict[str, str]]:
    """The material of a Prony series that exists, and the cards (name -> text) that the recipe requests."""
    from dielast.handover.prony_card import read_prony

    assert recipe.prony is not None
    constants, fit = recipe.material, recipe.fit
    card = read_prony(inputs.read(recipe.prony), recipe.prony, recipe.prony_units, recipe.prony_temperature_scale)
    with located(file=recipe.prony):
        instantaneous, at_rest = (None if young is None else young / 3 for young in (fit.glassy_modulus, fit.equilibrium_modulus))
        material = card.material(instantaneous, at_rest)
    if "name" in constants.model_fields_set:
        material = replace(material, name=constants.name)
    material = with_constants(material, constants)
    material = replace(material, origin=dict.fromkeys(paths_of(material), "stated"))
    warn_of_material(material)
    export = recipe.export
    return material, {} if export is None else exported(material, export, export.options())


def run_card(recipe: SpectrumRecipe, inputs: Inputs) -> RunReport:
    """The report on a Prony series that exists."""
    material, cards = card_of(recipe, inputs)
    spectrum, equilibrium = material.spectrum, material.equilibrium_modulus
    tau = spectrum.relaxation_time
    time = np.geomspace(tau.min(initial=1.0) / 30, 30 * tau.max(initial=1.0), 200)
    model = 3 * spectrum.relaxation_modulus(time, equilibrium)
    shown = SpectrumFit("nnls", spectrum, equilibrium, 0.0, 0.0, time, np.full(time.size, np.nan), model)

    def figure() -> Any:
        from dielast.commands.simulation.naming import headed
        from dielast.plots.spectrum import plot_spectrum

        return plot_spectrum(shown, headed(recipe.title, [material.name]), measured="")

    numbers = {"prony": {"branches": len(spectrum)}, "moduli": moduli_headline(spectrum, equilibrium)}
    return RunReport({"spectrum.csv": spectrum.columns()}, numbers, figure, material_files(material, cards))


def with_constants(material: Material, constants: MaterialConstants) -> Material:
    """A material with the constants of the recipe that no relaxation test gives; its springs are those it has without J_lim."""
    limits = constants.J_lim
    return replace(
        material,
        equilibrium_law=material.equilibrium_law if limits.equilibrium is None else Gent(limits.equilibrium),
        nonequilibrium_law=material.nonequilibrium_law if limits.nonequilibrium is None else Gent(limits.nonequilibrium),
        permittivity=constants.dielectric(),
        breakdown=breakdown(constants.breakdown),
    )


def moduli_headline(spectrum: Spectrum, equilibrium: float) -> dict[str, Any]:
    """The section of a summary on the moduli of a material."""
    tau = spectrum.relaxation_time
    return {
        "equilibrium_shear_Pa": equilibrium,
        "nonequilibrium_shear_Pa": float(np.sum(spectrum.shear_modulus)),
        "relaxation_time_min_s": float(tau.min(initial=np.inf)),
        "relaxation_time_max_s": float(tau.max(initial=0.0)),
    }


def material_files(material: Material, cards: Mapping[str, str], draws: str | None = None) -> dict[str, bytes]:
    """The file of a material, which names that of its `draws`, and its cards (name -> text)."""
    return {"material.toml": write_material(material, draws)} | {name: text.encode() for name, text in cards.items()}


def exported(material: Material, export: ExportSection, options: CardOptions) -> dict[str, str]:
    """The cards (name -> text) of a material that a recipe requests."""
    with located(key="export"), in_keys(EXPORT_KEYS):
        return export_cards(material, tuple(export.formats), options)
