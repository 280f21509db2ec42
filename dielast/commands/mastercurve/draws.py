"""Tables and summary of the draws of a master curve."""

from __future__ import annotations

from typing import Any

import numpy as np

from dielast.handover.mastercurve_folder import CURVES, DRAWS, LAWS
from dielast.io.table import Column, Table
from dielast.material.measurement_kind import MeasurementKind
from dielast.superposition.bootstrap import MasterCurveDraws


def curve_tables(draws: MasterCurveDraws, kind: MeasurementKind) -> dict[str, Table]:
    """The tables of the draws of a master curve by file name: shift factors, laws and smooth curves."""
    curves = [Column(*kind.reduced_abscissa, draws.smooth_abscissa)]
    for channel, (name, unit) in enumerate(kind.ordinates):
        pairs = zip(draws.number, draws.smooth_ordinates[:, channel], strict=True)
        curves += [Column(f"{name}_{number}", unit, values) for number, values in pairs]
    laws = [Column(name, unit, values) for (name, unit), values in zip(draws.law.drawn(), draws.law_parameters.T, strict=True)]
    return {
        DRAWS: draws.columns(),
        LAWS: [Column("draw", None, draws.number), *laws],
        CURVES: curves,
    }


def draws_headline(draws: MasterCurveDraws, wanted: int, seed: int) -> dict[str, Any]:
    """The section of a summary that compares the scatter of the draws with the standard errors of the fit."""
    stderr = draws.stderr()
    return {
        "draws": wanted,
        "seed": seed,
        "without_master_curve": wanted - len(draws.number),
        **{f"{name}_stderr": stderr[constant.name] for name, constant in draws.law.summary_names().items()},
        "log10_shift_factor_stderr": np.std(draws.log10_shift_factor, axis=0, ddof=1).tolist(),
    }
