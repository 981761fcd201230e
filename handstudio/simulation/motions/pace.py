"""The same movement at another pace: halts and sudden starts on its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handstudio.arrays import Array
from handstudio.simulation.motions.swings import through_states
from handstudio.simulation.trajectory import Span, Trajectory

_STEP_S = 0.01  # of the grid that the new movement is laid on
_HALTING_S = 0.08  # to stop, and to start
_WAIT_S = (0.1, 0.35)
_BETWEEN_S = (0.4, 1.6)


def halting(part: Trajectory, rng: np.random.Generator) -> Trajectory:
    """The movement, along the same way, with halts: within 80 ms from full pace to none.

    It takes longer by its halts; what its spans name is named still.
    """
    clock = _clock(part.duration_s, rng)
    count = max(2, round(clock.duration_s / _STEP_S))
    at = np.unique(np.concatenate([np.linspace(0.0, clock.duration_s, count), clock.breaks_s]))
    at = at[np.concatenate([[True], np.diff(at) > 1e-6])]
    at[-1] = clock.duration_s
    then, pace, change = (x[:, :1] for x in clock.derivatives(at))
    then = np.clip(then, 0.0, part.duration_s)
    x, v, a = part.derivatives(then[:, 0])
    done = through_states(at, x, v * pace, a * pace**2 + v * change)
    return replace(done, spans=tuple(_moved(span, then[:, 0], at) for span in part.spans))


def _clock(seconds: float, rng: np.random.Generator) -> Trajectory:
    """How far the movement has got [s] at every instant of the new one."""
    times, states = [0.0], [(0.0, 1.0)]  # instant, how far, pace
    got = float(rng.uniform(*_BETWEEN_S))
    while got < seconds - _HALTING_S:
        wait = float(rng.uniform(*_WAIT_S))
        cruise = times[-1] + got - states[-1][0]
        half = 0.5 * _HALTING_S  # of the way at full pace
        times += [cruise, cruise + _HALTING_S]
        states += [(got, 1.0), (got + half, 0.0)]
        times += [times[-1] + wait, times[-1] + wait + _HALTING_S]
        states += [(got + half, 0.0), (got + 2.0 * half, 1.0)]
        got = states[-1][0] + float(rng.uniform(*_BETWEEN_S))
    times.append(times[-1] + seconds - states[-1][0])
    states.append((seconds, 1.0))
    value = np.array(states)
    still = np.zeros((len(times), 1))
    return through_states(np.round(times, 9), value[:, :1], value[:, 1:], still)


def _moved(span: Span, then: Array, at: Array) -> Span:
    """When in the new movement a span of the old one begins and ends."""
    begin = float(np.interp(span.start_s, then, at))
    return replace(span, start_s=begin, end_s=float(np.interp(span.end_s, then, at)))
