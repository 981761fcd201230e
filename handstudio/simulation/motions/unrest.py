"""What a hand does that is never still: tremor, and slow drift."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.skeleton import JOINTS
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.swings import through_states
from handstudio.simulation.trajectory import CHANNELS, Trajectory

# Physiological tremor of a hand in the air peaks at 8 to 12 Hz (J. H. McAuley and C. D. Marsden,
# Brain 123 (2000) 1545). The sizes are ours, those of somebody tired or nervous: rms of flexion,
# and of the elbow's place.
_TREMOR_HZ = (8.0, 12.0)
_TREMOR_RMS_DEG = {"elbow": 0.02, "wrist": 0.06, "mcp": 0.07, "cmc": 0.05}
_TREMOR_RMS_ELSE_DEG = 0.04
_TREMOR_RMS_M = 3e-5
_ACROSS = 0.4  # of that, about the second axis; none about the third
_TONES = 3  # a joint's tremor is several that beat

_DRIFT_HZ = (0.05, 0.25)
_DRIFT_RMS_DEG = 0.8  # ours: a hand in the air that is told to keep still
_DRIFT_RMS_M = 0.001

_STEP_S = 0.02  # a quintic between instants is exact to 1 % of the tremor
_FADE_S = 0.4  # so that it begins and ends at rest


def unrest(actor: Actor, motion: str, seconds: float, strength: float = 1.0) -> Trajectory:
    """Tremor and drift of every joint and of the elbow, about zero, at rest at both ends.

    A strength of 1 is somebody restless, 0 nobody.
    """
    rng = actor.rng(f"{motion} unrest")
    at = np.linspace(0.0, seconds, max(4, round(seconds / _STEP_S)) + 1).round(6)
    sizes = _sizes()
    states = np.zeros((3, len(at), CHANNELS))
    for rms, band in ((sizes, _TREMOR_HZ), (_drifts(sizes), _DRIFT_HZ)):
        for _tone in range(_TONES):
            hertz = rng.uniform(*band, CHANNELS)
            phase = rng.uniform(0.0, 2.0 * np.pi, CHANNELS)
            size = strength * rms * np.sqrt(2.0 / _TONES) * rng.uniform(0.7, 1.3, CHANNELS)
            turned = 2.0 * np.pi * hertz * at[:, None] + phase
            pace = 2.0 * np.pi * hertz
            wave = np.sin(turned), pace * np.cos(turned), -(pace**2) * np.sin(turned)
            states += size * np.stack(wave)
    return through_states(at, *_faded(states, at))


def _sizes() -> Float[Array, " c"]:
    """Tremor's rms of every channel."""
    out = np.zeros((len(JOINTS), 3))
    for index, joint in enumerate(JOINTS):
        kind = joint.name.rpartition("_")[2]
        flexion = np.deg2rad(_TREMOR_RMS_DEG.get(kind, _TREMOR_RMS_ELSE_DEG))
        out[index, 0] = flexion
        out[index, 1] = _ACROSS * flexion * (joint.axes > 1)
    return np.concatenate([out.ravel(), np.full(3, _TREMOR_RMS_M)])


def _drifts(sizes: Array) -> Float[Array, " c"]:
    """Drift's rms, of what trembles."""
    drifts = np.where(sizes > 0.0, np.deg2rad(_DRIFT_RMS_DEG), 0.0)
    drifts[-3:] = _DRIFT_RMS_M
    return drifts


def _faded(states: Array, at: Array) -> Array:
    """States with a rise at the begin and a fall at the end, by the rule of the product."""
    fade = min(_FADE_S, 0.25 * float(at[-1]))
    u = np.clip(np.minimum(at, at[-1] - at) / fade, 0.0, 1.0)
    towards = np.where(at < 0.5 * at[-1], 1.0, -1.0)
    rise = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    slope = towards * 30.0 * u**2 * (1.0 - u) ** 2 / fade
    bend = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / fade**2
    rise, slope, bend = (x[:, None] for x in (rise, slope, bend))
    x, v, a = states
    faded: Array = np.stack([rise * x, slope * x + rise * v, bend * x + 2.0 * slope * v + rise * a])
    return faded
