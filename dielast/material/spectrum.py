"""The discrete relaxation spectrum (Prony series) at the reference temperature."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.io.result import Result, TabularResult, freeze
from dielast.io.table import Column, Table, plural, spoken
from dielast.material.argument_types import checked
from dielast.numerics.arrays import Floats


def check_processes(spectrum: Result, times: str, strengths: str) -> None:
    """Make the fields `times` and `strengths` of a spectrum, (N,) each, read-only arrays.

    Raises `InputError` if they differ in length, a time is not positive, a strength is negative, or either is not finite.
    """
    time, strength = (np.array(getattr(spectrum, name), dtype=float).reshape(-1) for name in (times, strengths))
    if time.size != strength.size:
        sizes = f"{time.size} {plural(times)} but {strength.size} {plural(strengths)}"
        raise InputError(f"{sizes}: one {spoken(strengths)} for each time is needed")
    if not np.all(np.isfinite(time) & (time > 0)):
        raise InputError(f"every {spoken(times)} must be positive and finite")
    if not np.all(np.isfinite(strength) & (strength >= 0)):
        raise InputError(f"every {spoken(strengths)} must be finite and not negative")
    freeze(spectrum, {times: time, strengths: strength})


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Spectrum(TabularResult):
    """N relaxation processes: `relaxation_time` (s) and `shear_modulus` (Pa), both of shape (N,), in any order, which is kept: that
    of the fits is slowest first.

    Raises `InputError` if the lists differ in length, a time is not positive, a modulus is negative, or either is not finite.
    """

    relaxation_time: Floats
    shear_modulus: Floats

    def __post_init__(self) -> None:
        check_processes(self, "relaxation_time", "shear_modulus")

    def __len__(self) -> int:
        return self.relaxation_time.size

    def columns(self) -> Table:
        """The table, one row per branch."""
        return [Column("relaxation_time", "s", self.relaxation_time), Column("shear_modulus", "Pa", self.shear_modulus)]

    def slowest(self, keep: int) -> Self:
        """The `keep` slowest processes, slowest first (the truncation of Sec. 3.4, DOI 10.1115/1.4030850)."""
        if not 1 <= keep <= len(self):
            raise InputError(f"cannot keep {keep} of {len(self)} branches")
        ordered = self.slowest_first()
        return type(self)(ordered.relaxation_time[:keep], ordered.shear_modulus[:keep])

    def slowest_first(self) -> Self:
        """The processes in descending order of their times."""
        order = np.argsort(-self.relaxation_time, kind="stable")
        return type(self)(self.relaxation_time[order], self.shear_modulus[order])

    def relaxation_modulus(self, time: ArrayLike, equilibrium_modulus: float = 0.0) -> Floats:
        """Shear relaxation modulus in Pa at `time` (s), G(t) = mu_eq + sum mu_k exp(-t/tau_k), Eq. 17 of DOI 10.1115/1.4030850.

        `equilibrium_modulus` is the shear modulus mu_eq in Pa. Young's modulus of an incompressible solid is three times as much.
        """
        t = np.asarray(time, dtype=float)
        return np.asarray(equilibrium_modulus + np.exp(-t[..., None] / self.relaxation_time) @ self.shear_modulus)

    def storage_modulus(self, angular_frequency: ArrayLike, equilibrium_modulus: float = 0.0) -> Floats:
        """Shear storage modulus in Pa at `angular_frequency` w (rad/s): mu_eq + sum mu_k (w tau_k)^2 / (1 + (w tau_k)^2)."""
        phase = np.asarray(angular_frequency, dtype=float)[..., None] * self.relaxation_time
        return np.asarray(equilibrium_modulus + phase**2 / (1 + phase**2) @ self.shear_modulus)

    def loss_modulus(self, angular_frequency: ArrayLike) -> Floats:
        """Shear loss modulus in Pa at `angular_frequency` w (rad/s): sum mu_k w tau_k / (1 + (w tau_k)^2)."""
        phase = np.asarray(angular_frequency, dtype=float)[..., None] * self.relaxation_time
        return np.asarray(phase / (1 + phase**2) @ self.shear_modulus)
