"""The incompressible membrane: plane stress, through-thickness stress eliminated, axes 1 and 2 principal.

A spring is described by its squared elastic stretches, shape (2, ...): A = lambda_1^2 and B = lambda_2^2, with C = 1/(A B) =
lambda_3^2. With a law's stiffness phi(I1), I1 = A + B + C, it carries p = phi (A - C) and q = phi (B - C) in axes 1 and 2 (Sec. 3
of DOI 10.1115/1.4030850).
"""

from __future__ import annotations

import numpy as np

from dielast.material.springs import Floats, SpringLaw


def invariant(squared_stretch: Floats) -> tuple[Floats, Floats]:
    """I1 and C, both of shape (...)."""
    thickness = squared_stretch[0] * squared_stretch[1]
    np.divide(1.0, thickness, out=thickness)
    total = squared_stretch[0] + squared_stretch[1]
    total += thickness
    return total, thickness


def stress(law: SpringLaw, squared_stretch: Floats) -> Floats:
    """True stresses (p, q) for unit shear modulus, shape (2, ...); not finite outside the law's domain."""
    total, thickness = invariant(squared_stretch)
    carried = squared_stretch - thickness
    carried *= law.stiffness(total)
    return carried


def tangent(law: SpringLaw, squared_stretch: Floats) -> tuple[Floats, Floats]:
    """Stresses, and half their derivatives in the logarithmic stretches, (K11, K12, K22)/2 of shape (3, ...).

    K11 = 2 phi (A + C) + 2 phi' (A - C)^2 and so on, phi' = dphi/dI1: exact and symmetric. The halves are derivatives in ln A, ln
    B.
    """
    total, thickness = invariant(squared_stretch)
    stiffness, slope = law.hardening(total)
    difference = squared_stretch - thickness
    half = np.empty((3, *total.shape))
    np.add(squared_stretch, thickness, out=half[::2])
    half[1] = thickness
    half *= stiffness
    steeper = difference * slope
    half[0] += steeper[0] * difference[0]
    half[1] += steeper[0] * difference[1]
    half[2] += steeper[1] * difference[1]
    difference *= stiffness
    return difference, half


def energy(law: SpringLaw, squared_stretch: Floats) -> Floats:
    """Strain energy per undeformed volume for unit shear modulus, shape (...)."""
    return law.energy(invariant(squared_stretch)[0])
