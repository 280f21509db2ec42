"""The tables of a fit of failures, and its headline."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dielast.commands.lifetime.ranking import Ranked
from dielast.failures.fits import FittedLaw
from dielast.failures.likelihood import Seen
from dielast.failures.specimens import Simulated
from dielast.io.table import Column, Table


def specimen_columns(tested: Simulated, fitted: Sequence[FittedLaw]) -> Table:
    """A row for each specimen: its state at its end, and its rank among the failures of its kind."""
    specimens, n = tested.specimens, len(tested.specimens)
    field, stretch = tested.state
    rank, exposure = np.full(n, np.nan), np.full(n, np.nan)
    for law in fitted:
        rows = law.law.rows
        ranks = law.ranks()
        rank[rows] = np.where(np.isfinite(ranks), ranks, rank[rows])
        mine = np.array([not law.mode or specimens.mode[row] in (law.mode, "") for row in rows])
        exposure[rows] = np.where(mine, np.exp(law.plain_standing()), exposure[rows])
    return [
        Column("specimen", None, list(specimens.name)),
        Column("voltage", "V", tested.voltage),
        Column("prestretch_1", "1", specimens.prestretch[:, 0]),
        Column("prestretch_2", "1", specimens.prestretch[:, 1]),
        Column("time", "s", tested.end),
        Column("suspended", None, ["yes" if seen == Seen.SUSPENDED else "no" for seen in tested.seen]),
        Column("true_field", "V/m", field),
        Column("stretch", "1", stretch),
        Column("exposure", "1", exposure),
        Column("rank", None, rank),
        *([Column("batch", None, list(specimens.batch))] if any(specimens.batch) else []),
        *([Column("mode", None, list(specimens.mode))] if any(specimens.mode) else []),
    ]


def law_columns(ranks: Sequence[Ranked]) -> Table:
    """A row for each law and kind of failure, the best first."""
    rows = [
        (rank.mode, law.name, law.law.options.scatter, law.law.rows.size, law.fit.free.size, law.fit.value, law.fit.aic, score)
        for rank in ranks
        for law, score in zip(rank.fitted, rank.scores, strict=True)
    ]
    mode, name, scatter, count, free, value, aic, score = zip(*rows, strict=True)
    return [
        *([Column("mode", None, list(mode))] if any(mode) else []),
        Column("law", None, list(name)),
        Column("scatter", None, list(scatter)),
        Column("specimens", None, np.array(count)),
        Column("parameters", None, np.array(free)),
        Column("log_likelihood", "1", np.array(value)),
        Column("aic", "1", np.array(aic)),
        Column("left_out_log_likelihood", "1", np.array(score)),
    ]


def joined(tables: Sequence[Table]) -> Table:
    """Tables with the same columns, one below the other."""
    result = []
    for parts in zip(*tables, strict=True):
        values = [part.values for part in parts]
        text = isinstance(values[0], list)
        result.append(
            Column(parts[0].name, parts[0].unit, [cell for part in values for cell in part] if text else np.concatenate(values))
        )
    return result


def headline(tested: Simulated, best: FittedLaw) -> dict[str, dict[str, Any]]:
    """The numbers of specimens, and the fitted law."""
    table = {column.name: list(column.values) for column in best.columns()}
    options = best.law.options
    references = {
        "reference_area_m2": options.reference_area,
        "reference_humidity": options.reference_humidity if "humidity_exponent" in table["parameter"] else None,
    }
    return {
        "lifetime": {
            "specimens": len(tested.specimens),
            "failed": int(np.count_nonzero(tested.seen != Seen.SUSPENDED)),
            "law": best.name,
            "log_likelihood": best.fit.value,
            **{name: value for name, value in references.items() if value is not None},
        },
        "parameters": {
            name.replace(".", "_").replace("[", "_").replace("]", ""): float(value)
            for name, value in zip(table["parameter"], table["value"], strict=True)
        },
    }
