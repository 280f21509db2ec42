"""Weights of the points in the joint fit: measured noise, misfit of the model, and outliers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import Floats, Index

SMALLEST = 1e-9  # decades squared; no test is accurate to 0.01 %, and larger weights would spoil the normal equations
BEND, ZERO = 3.0, 6.0  # standard deviations at which the trust in a point begins to fall, and reaches 0


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """`weight` = `trust` / `variance`, each (n,); `floor` times `share` is added to the measured variance, in decades squared."""

    weight: Floats
    trust: Floats
    variance: Floats
    share: Floats
    floor: float


def even_weights(variance: Floats) -> Weights:
    """Initial weights, before there are residuals: for a misfit of 2 %."""
    total = variance + 1e-4
    return Weights(1 / total, np.ones(total.size), total, np.ones(total.size), 0.0)


def robust_weights(variance: Floats, residual: Floats, parameters: float, share: Floats, old: Weights) -> Weights:
    """Weights from the residuals (n,) of a fit with `parameters` parameters; the floor is such that the reduced chi-square is 1.

    `share` (n,) is the variance of the noise of a point's curve relative to that of all curves.
    """
    square = residual**2
    floor = old.floor if old.floor > 0 else float(np.median(square)) / 0.455
    floor = max(floor, SMALLEST)
    score = np.abs(residual) / np.sqrt(variance + floor * share)
    trust = np.clip((ZERO - score) / (ZERO - BEND), 0, 1) * np.minimum(1, BEND / np.maximum(score, BEND))
    freedom = max(float(np.sum(trust)) - parameters, 1.0)
    for _ in range(5):  # Newton's method for the floor, on the reciprocal of chi-square, which is nearly linear in it
        total = variance + floor * share
        part = trust * square / total
        chi = float(np.sum(part))
        steepness = float(np.sum(part * share / total))
        if steepness <= 0:
            break
        floor = max(floor + (chi - freedom) / steepness * chi / freedom, SMALLEST)
    total = variance + floor * share
    return Weights(trust / total, trust, total, share, floor)


def channel_shares(channel: Index, residual: Floats) -> Floats:
    """Variance of each point's channel relative to that of all (n,), from medians."""
    if channel[-1] == 0:
        return np.ones(channel.size)
    typical = np.array([np.median(residual[channel == k] ** 2) for k in range(channel[-1] + 1)])
    typical = np.maximum(typical, SMALLEST)
    return np.asarray((typical / np.exp(np.mean(np.log(typical))))[channel])


def noise_shares(curve: Index, residual: Floats, channel: Index) -> Floats:
    """Variance of each point's curve relative to that of all (n,), from medians; 1 unless the difference is significant.

    Curves are compared within their channel.
    """
    among = channel_shares(channel, residual)
    square = residual**2 / among
    order = np.lexsort((square, curve))
    count = np.bincount(curve)
    middle = np.cumsum(count) - count + count // 2
    typical = float(np.median(square))
    if typical <= 0:
        return among
    ratio = square[order][middle] / typical
    doubt = np.exp(7 / np.sqrt(count))  # three standard errors of the logarithm of a median of squares
    sure = (ratio > doubt) | (ratio < 1 / doubt)
    return np.asarray(among * np.where(sure, np.clip(ratio, 0.01, 100.0), 1.0)[curve])
