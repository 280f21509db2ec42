"""`spectrum` from a Prony series that exists: the material of a card, and further cards of it."""

from dataclasses import replace
from typing import Any

import numpy as np

from dielast.commands.spectrum.recipe import EXPORT_KEYS, ExportSection, SpectrumRecipe
from dielast.errors import in_keys, located
from dielast.export.card import export_cards
from dielast.export.code import CardOptions
from dielast.handover.law_section import breakdown
from dielast.handover.material_file import write_material
from dielast.io.files import Inputs
from dielast.material.checks import warn_of_material
from dielast.material.material import Material, paths_of
from dielast.material.springs import Gent
from dielast.relaxation.result import SpectrumFit
from dielast.report.report import RunReport


def card_of(recipe: SpectrumRecipe, inputs: Inputs) -> tuple[Material, dict[str, str]]:
    """The material of a Prony series that exists, and the cards (name -> text) that the recipe requests."""
    from dielast.handover.prony_card import read_prony

    assert recipe.prony is not None
    card, constants, fit = read_prony(inputs.read(recipe.prony), recipe.prony, recipe.prony_units), recipe.material, recipe.fit
    with located(file=recipe.prony):
        instantaneous, at_rest = (None if young is None else young / 3 for young in (fit.glassy_modulus, fit.equilibrium_modulus))
        material = card.material(instantaneous, at_rest)
    limits = constants.J_lim
    material = replace(
        material,
        name=constants.name if "name" in constants.model_fields_set else material.name,
        equilibrium_law=material.equilibrium_law if limits.equilibrium is None else Gent(limits.equilibrium),
        nonequilibrium_law=material.nonequilibrium_law if limits.nonequilibrium is None else Gent(limits.nonequilibrium),
        permittivity=constants.dielectric(),
        breakdown=breakdown(constants.breakdown),
    )
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

    numbers: dict[str, dict[str, Any]] = {
        "prony": {"branches": len(spectrum)},
        "moduli": {
            "equilibrium_shear_Pa": equilibrium,
            "nonequilibrium_shear_Pa": float(np.sum(spectrum.shear_modulus)),
            "relaxation_time_min_s": float(tau.min(initial=np.inf)),
            "relaxation_time_max_s": float(tau.max(initial=0.0)),
        },
    }
    files = {"material.toml": write_material(material)} | {name: text.encode() for name, text in cards.items()}
    return RunReport({"spectrum.csv": spectrum.columns()}, numbers, figure, files)


def exported(material: Material, export: ExportSection, options: CardOptions) -> dict[str, str]:
    """The cards (name -> text) of a material that a recipe requests."""
    with located(key="export"), in_keys(EXPORT_KEYS):
        return export_cards(material, tuple(export.formats), options)
