"""The simulations of the library with their arguments in one mapping, so that a test can state a film once and vary any of it.

The dataclasses of arguments (`Plateaus`, `Film`, `Circuit`, `Failure`, `Output`, `Solver`, `HeldVoltages`, `Goal`) are filled from
keywords with the names of their fields; `voltage` are the values of `HeldVoltages`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import dielast


def _filled(kinds: Mapping[str, Any], stated: dict[str, Any]) -> dict[str, Any]:
    """The dataclasses by argument, without those of which nothing is stated."""
    taken = {
        argument: {field.name: stated.pop(field.name) for field in fields(kind) if field.name in stated}
        for argument, kind in kinds.items()
    }
    return {argument: kinds[argument](**values) for argument, values in taken.items() if values}


def _films(stated: dict[str, Any], **more: Any) -> dict[str, Any]:
    arguments = _filled({"film": dielast.Film, "failure": dielast.Failure, "solver": dielast.Solver, **more}, stated)
    assert not stated, f"no arguments of the library: {sorted(stated)}"
    return arguments


def _fit(function: Any) -> Any:
    """A fit of a spectrum, with the fields of `Plateaus` among its arguments."""

    def fit(*curve: Any, **stated: Any) -> dielast.SpectrumFit:
        known = _filled({"plateaus": dielast.Plateaus}, stated)
        return function(*curve, **known, **stated)

    return fit


fit_spectrum, fit_oscillation, fit_creep = map(_fit, (dielast.fit_spectrum, dielast.fit_oscillation, dielast.fit_creep))


def actuate(material: Any, steps: Any, **stated: Any) -> dielast.ActuationHistory:
    """`dielast.actuate`."""
    programme = {name: stated.pop(name) for name in ("mode", "repeat") if name in stated}
    steps = dielast.Programme(steps, **programme) if programme else steps
    return dielast.actuate(material, steps=steps, **_films(stated, circuit=dielast.Circuit, output=dielast.Output))


def _of_map(stated: dict[str, Any]) -> dict[str, Any]:
    if "voltage" in stated:
        stated["values"] = stated.pop("voltage")
    return _films(stated, voltages=dielast.HeldVoltages)


def failure_map(material: Any, **stated: Any) -> dielast.FailureMap:
    """`dielast.failure_map`."""
    return dielast.failure_map(material, **_of_map(stated))


def plan_failure_map(material: Any, *, sample: Any = None, **stated: Any) -> Any:
    """`dielast.plan_failure_map`, with relaxed films."""
    return dielast.plan_failure_map(material, sample=sample, **_of_map(stated)).relaxed()


def life_sensitivity(material: Any, sample: Any = None, *, seed: int = 1, **stated: Any) -> Any:
    """`dielast.life_sensitivity`."""
    return dielast.life_sensitivity(material, sample=sample, seed=seed, **_of_map(stated))


def design(material: Any, *, sample: Any = None, level: float = 0.9, **stated: Any) -> dielast.Design:
    """`dielast.design`."""
    return dielast.design(material, sample=sample, level=level, **_films(stated, goal=dielast.Goal))


def _specimens(stated: dict[str, Any]) -> dict[str, Any]:
    kept = {name: stated.pop(name) for name in ("mode", "temperature", "nominal_field", "slack") if name in stated}
    arguments = _filled({"output": dielast.Output, "solver": dielast.Solver}, stated)
    assert not stated, f"no arguments of the library: {sorted(stated)}"
    return kept | arguments


def relax(material: Any, steps: Any, **stated: Any) -> dielast.MembraneHistory:
    """`dielast.relax`."""
    return dielast.relax(material, steps, **_specimens(stated))


def creep(material: Any, steps: Any, **stated: Any) -> dielast.MembraneHistory:
    """`dielast.creep`."""
    return dielast.creep(material, steps, **_specimens(stated))
