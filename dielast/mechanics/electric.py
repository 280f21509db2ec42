"""The electrical load: the electrical quantity that is prescribed, and the Maxwell stress that it causes.

A film of nominal field V/L_3 has the true field E = (V/L_3) lambda_1 lambda_2 and the Maxwell stress eps E^2, equal in axes 1 and 2
(Eq. 6 of DOI 10.1115/1.4030850). Both depend on the stretches through the area, here as
`log_area` = Lambda_1 + Lambda_2 = 2 ln(lambda_1 lambda_2), and through the present permittivity eps. Arrays are of shape (cases,).

The energy U of the dielectric at a prescribed field or charge is a function of the capacitance per undeformed area only, that is,
of L = log_area + ln eps, and eps E^2 = -2 dU/dL. So if the permittivity depends on stretch, with g_i = dL/dLambda_i =
1 + d ln eps/dLambda_i and h_ij = d2 ln eps/dLambda_i dLambda_j, the stresses m_i in both axes and their derivatives are

    m_i = eps E^2 g_i,    dm_i/dLambda_j = d(eps E^2)/dL g_i g_j + eps E^2 h_ij.

Under a prescribed field, m_i/lambda_i = eps E~^2 lambda_1^2 lambda_2^2/lambda_i + E~^2 lambda_1^2 lambda_2^2 (d eps/d lambda_i)/2,
E~ the nominal field: the second term is electrostriction (Zhao and Suo, J. Appl. Phys. 104 (2008) 123530).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from dielast.numerics.arrays import Floats

ELECTRIC = 2  # row of the prescribed electrical quantity among the values of a load


class ElectricalLoad(Protocol):
    """A prescribed electrical quantity: `prescribed` is its value, `permittivity` is in F/m at the present stretch of the film."""

    def stress(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """The Maxwell stress eps E^2 in Pa."""

    def linearised(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> tuple[Floats, Floats, Floats]:
        """The Maxwell stress, and its derivatives in `log_area` (equal to that in ln eps) and in the prescribed quantity."""

    def true_field(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """The true field E in V/m."""


@dataclass(frozen=True, slots=True)
class FieldControl:
    """The nominal field V/L_3 (V/m) is prescribed, as by a voltage source: eps E^2 = eps (V/L_3)^2 exp(log_area)."""

    def stress(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """eps E^2."""
        return np.asarray(permittivity * np.square(prescribed) * np.exp(log_area))

    def linearised(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> tuple[Floats, Floats, Floats]:
        """eps E^2, its derivative in `log_area`, which is the same, and 2 eps (V/L_3) exp(log_area)."""
        slope = 2 * permittivity * prescribed * np.exp(log_area)
        stress = 0.5 * slope * prescribed
        return stress, stress, slope

    def true_field(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """E = (V/L_3) exp(log_area/2)."""
        return np.asarray(prescribed * np.exp(0.5 * log_area))


@dataclass(frozen=True, slots=True)
class ChargeControl:
    """The nominal charge density D~ (C/m^2), charge per undeformed area, is prescribed: eps E^2 = D~^2/eps exp(-log_area).

    The Maxwell stress decreases as the film expands, so that a charged film never pulls in. Without a load on its edges, a
    neo-Hookean film reaches lambda^6 = 1 + D~^2/(mu eps) (Keplinger, Kaltenbrunner, Arnold and Bauer, PNAS 107 (2010) 4505).
    """

    def stress(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """eps E^2."""
        return np.asarray(np.square(prescribed) / permittivity * np.exp(-log_area))

    def linearised(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> tuple[Floats, Floats, Floats]:
        """eps E^2, its derivative -eps E^2 in `log_area`, and 2 D~/eps exp(-log_area)."""
        slope = 2 * prescribed / permittivity * np.exp(-log_area)
        stress = 0.5 * slope * prescribed
        return stress, -stress, slope

    def true_field(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """E = D~/eps exp(-log_area/2)."""
        return np.asarray(prescribed / permittivity * np.exp(-0.5 * log_area))


FIELD, CHARGE = FieldControl(), ChargeControl()
