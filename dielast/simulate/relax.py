"""Relaxation: the stretch is prescribed, the stress follows."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from dielast.material.material import Material
from dielast.mechanics.load import Mode, Step
from dielast.simulate.membrane import MembraneHistory, simulate


def relax(
    material: Material | Sequence[Material],
    steps: Sequence[Step],
    *,
    mode: Mode | str = Mode.UNIAXIAL,
    temperature: ArrayLike | None = None,
    times: ArrayLike | None = None,
    points_per_decade: int = 30,
    rtol: float = 1e-6,
    internal: bool = False,
    cycles: str | Sequence[int] | None = None,
) -> MembraneHistory:
    """Stress of a membrane at rest whose stretch follows `steps`; arguments and result as in `creep`.

    In uniaxial mode the result has a `relaxation_modulus`, nominal stress over (stretch - 1), in Pa.
    """
    return simulate(
        material,
        steps,
        mode=mode,
        temperature=temperature,
        times=times,
        points_per_decade=points_per_decade,
        rtol=rtol,
        internal=internal,
        cycles=cycles,
    )
