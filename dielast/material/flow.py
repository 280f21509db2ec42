"""The flow laws: how fast a branch flows under stress. To add a law, write its module and register its class in `FLOWS`."""

from dataclasses import dataclass
from typing import ClassVar

from dielast.base.registry import Registry
from dielast.material.law import FlowLaw


@dataclass(frozen=True, slots=True)
class LinearFlow(FlowLaw):
    """Flow in proportion to stress (Eqs. 7 and 8 of DOI 10.1115/1.4030850): a relaxation time does not depend on stress."""

    name: ClassVar = "linear"
    title: ClassVar = "linear flow"
    depends_on_stress: ClassVar = False


LINEAR_FLOW = LinearFlow()
FLOWS: Registry[type[FlowLaw]] = Registry("flow law", LinearFlow)
