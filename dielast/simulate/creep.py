"""Creep: the nominal stress (dead load) is prescribed, the stretch follows."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from dielast.material.material import Material
from dielast.mechanics.load import Mode, Step
from dielast.simulate.membrane import MembraneHistory, simulate


def creep(
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
    """Stretch of a membrane at rest whose nominal stress follows `steps` (a stretch may be prescribed in between).

    The cases are as many as the longest of: values in the steps, `temperature` (degC; default the material's reference
    temperature), materials. Output at `times` in s since the start, (k,) or (cases, k), or else at `points_per_decade` from the
    start of each step to its end, and evenly spaced in a ramp; given times at the moment of a load applied at once show what was
    before it. Of a `Waveform` the `cycles` are kept in full: "all", "last", or their numbers from 1; by default all up to 100, or
    else 1, 2, 5, 10, 20 and so on, and the last. `rtol` bounds
    the local relative error of stretches (not of stretch - 1), of viscous stretches, and of stresses above 1e-4 of the
    equilibrium modulus; `internal` keeps the viscous stretches. Cases of one call share the way they are solved and their
    output, so that one with steps of another nature (at once, or leading nowhere) belongs into a call of its own. Raises
    `InputError` for anything wrong with the arguments; numerics that give up are an outcome in the result.
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
