"""Transients of a testing machine that no film can follow: a force that rings, and a force on a film at rest.

A grip that is started or stopped swings, and so does the load cell: the force goes up and down while the extension stands or barely
moves. The nearest film of any springs and branches (`any_film`) follows the measured extension, its overshoot included. Of the
differences from it, swings from one extreme to the next are left out where at least two follow each other of which each

- is larger than noise alone would make it in one test of a hundred,
- is larger by as much than all motion of this film in this time: the force moves against the film,
- takes no longer than a quarter of a ramp (a choice: a grip that swings more slowly could hardly have followed it),

with those next to them that are larger than noise and as fast, and until the swings have faded into noise, as damped ones do. Fast
relaxation after a ramp, kinks at turning points and the error of laws at large strain are no such swings: they are single, or slow,
or smaller than the motion of the film itself.
"""

import numpy as np
from scipy.special import ndtri

from dielast.calibration.any_film import any_film
from dielast.calibration.estimate import USUAL_ERROR
from dielast.calibration.experiment import TOLERANCE, MeasuredTest
from dielast.calibration.scatter import LEAST_NOISE, level_of
from dielast.numerics.arrays import Flags, Floats
from dielast.numerics.robust import extremes

ALARM = 0.01  # probability that noise alone makes a swing in a test
LAGS = (1, 2, 4)  # distances between points over which noise is estimated, as it may be correlated
CALM = 0.25  # of these distances, the smallest, are of noise alone
BLOCKS = (1, 2, 4, 8)  # points that are averaged, each in turn: the mean of many points has less noise
# The next four numbers are choices, not derived.
SETTLING = 0.25  # longest swing over the time of a ramp
SHY = 0.25  # of the ramp time after a change of speed: these points do not choose the film
UNLIKE = 2.0  # swings that take longer than so many times the usual one are not of the same ringing
KINK = 0.3  # change of speed over the speed of the ramps: a crosshead that swings makes smaller ones
FEWEST = 12  # points of a test that shows ringing


def ringing(test: MeasuredTest) -> Flags:
    """Which points (n,) of a test ring."""
    found = np.zeros(test.time.size, dtype=bool)
    lasts = _ramp_time(test)
    if test.nominal_field or test.time.size < FEWEST or not lasts > 0:
        return found
    columns = test.time, test.stress, any_film(test, ~_after_kinks(test, SHY * lasts)), level_of(test.stress, 0.5)
    for block in BLOCKS:
        count = test.time.size // block
        if count < FEWEST:
            break
        time, stress, model, level = (values[: count * block].reshape(count, block).mean(axis=1) for values in columns)
        for first, end in runs(_swinging(time, stress, model, level, lasts)):
            part = slice(first * block, end * block)
            # fewer points find the bounds of a transient more closely
            found[part] |= not found[part].any()
    return found


def _after_kinks(test: MeasuredTest, lasts: float) -> Flags:
    """The points (n,) within the time `lasts` in s after the crosshead has changed its speed by much: where it may ring."""
    time, stretch = test.corner_time, test.corner_stretch
    speed = np.concatenate(([0.0], np.diff(stretch) / np.maximum(np.diff(time), 1e-300)))
    usual = float(np.ptp(stretch)) / max(_ramp_time(test), 1e-300)
    kinks = time[:-1][np.abs(np.diff(speed)) > KINK * usual]
    return np.asarray(np.any((test.time > kinks[:, None]) & (test.time <= kinks[:, None] + lasts), axis=0))


def loaded_at_rest(test: MeasuredTest) -> Flags:
    """The points (n,) before the specimen is stretched at which it bears a stress beyond the usual error; a film bears none."""
    if test.nominal_field:
        return np.zeros(test.time.size, dtype=bool)
    moved = np.abs(test.stretch - 1) > TOLERANCE * float(np.ptp(np.append(test.stretch, 1.0)))
    loaded = np.abs(test.stress) > USUAL_ERROR * float(np.max(np.abs(test.stress)))
    return np.asarray(~np.logical_or.accumulate(moved) & loaded & (test.corner_stretch[0] == 1))


def _swinging(time: Floats, stress: Floats, film: Floats, level: Floats, lasts: float) -> Flags:
    """The points (n,) in swings of the `stress` (n,) about that of the `film` (n,), over the `level` (n,); `lasts` is the time of a
    ramp in s.
    """
    found, difference = np.zeros(time.size, dtype=bool), (stress - film) / level
    noise = _noise(stress, difference, level)
    extreme = float(-ndtri(ALARM / (2 * len(BLOCKS) * time.size))) * noise
    turns = np.unique([0, *extremes(difference, 2 * extreme), difference.size - 1])
    motion = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(film)) / level[1:])))
    first, last = turns[:-1], turns[1:]
    swing = np.abs(difference[last] - difference[first])
    fast = (swing > 2 * extreme) & (time[last] - time[first] <= SETTLING * lasts)
    against = fast & (swing > motion[last] - motion[first] + 2 * extreme)
    if not against.any():
        return found
    # ringing has one frequency, known to the spacing of the points: the way between two transients is no swing of either
    takes, spacing = time[last] - time[first], np.gradient(time)
    usual = float(np.median(takes[against]))
    alike = fast & (takes <= UNLIKE * usual + np.maximum(spacing[first], spacing[last]))
    for begin, end in runs(alike):
        if np.any(against[begin : end - 1] & against[begin + 1 : end]):
            found[first[begin] + 1 : last[end - 1]] = True
            end_time, spacing_there = time[last[end - 1]], spacing[last[end - 1]]
            faded = _fading(swing[begin:end], time[last[begin:end]], spacing_there, noise)
            found |= (time >= end_time) & (time <= end_time + faded)
            for place, way in ((first[begin], -1), (last[end - 1], 1)):
                # with the rest of the first and of the last lobe, as far as it exceeds noise
                sign, begun = np.sign(difference[place]), time[place]
                while 0 <= place < time.size and sign * difference[place] > extreme and abs(time[place] - begun) <= usual:
                    found[place] = True
                    place += way
    return found


def _fading(swing: Floats, time: Floats, spacing: float, noise: float) -> float:
    """The time in s after the last of the swings (n,), which end at times (n,), until points of this spacing in s do not show the
    rest of a damped one; 0 for swings that do not become smaller.

    With an amplitude a that falls at the rate c, the squares of all further points have the sum a^2/(4 c spacing). The rest is not
    seen, and moves no parameter by more than noise does, where this is less than the variance of one point.
    """
    largest = int(np.argmax(swing))
    fall = float(np.log(swing[largest] / swing[-1]))
    if not fall > 0:
        return 0.0
    rate = fall / float(time[-1] - time[largest])
    unseen = 2 * noise * float(min(np.sqrt(rate * spacing), 0.5))
    return max(float(np.log(0.5 * swing[-1] / unseen)), 0.0) / rate


def _noise(stress: Floats, difference: Floats, level: Floats) -> float:
    """The standard deviation of noise in the `difference` (n,), from distances of points to the middle of two others: by the
    smallest ones, as ringing that fades slowly, or is sampled in log time, fills most of a test.
    """
    bends = [np.abs(difference[lag:-lag] - 0.5 * (difference[: -2 * lag] + difference[2 * lag :])) for lag in LAGS]
    scatter = [float(np.quantile(bend, CALM)) / (float(ndtri(0.5 + 0.5 * CALM)) * np.sqrt(1.5)) for bend in bends]
    values = np.unique(stress)
    digit = float(np.min(np.diff(values))) / float(np.median(level)) / np.sqrt(12) if values.size > 1 else 0.0
    return float(max(*scatter, digit, LEAST_NOISE))


def _ramp_time(test: MeasuredTest) -> float:
    """The time in s for the whole range of the stretch, at the mean rate along its path; 0 for a test without ramps."""
    path, lasts = np.abs(np.diff(test.corner_stretch)), np.diff(test.corner_time)
    moved = path > 0
    rates = float(np.sum(np.square(path[moved]) / lasts[moved]))
    return float(np.ptp(test.corner_stretch)) * float(np.sum(path)) / rates if rates > 0 else 0.0


def runs(flags: Flags) -> list[tuple[int, int]]:
    """First and end of each run of flags (n,) that are True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
