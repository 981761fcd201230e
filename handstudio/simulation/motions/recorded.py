"""A real hand's motion, as somebody recorded it, done by the subject's hand.

What goes over is the angles, not the places: a subject has other bones. Per instant

- fingers: MCP flexion and deviation from the direction of the proximal phalanx in the palm; PIP and
  DIP flexion from the next phalanges' directions, each in the frame of the one before;
- thumb: CMC from its metacarpal against where a subject's lies on the flat hand, then MCP and IP.
  No rotation of it can be told from places;
- palm: no forearm was seen. Its attitude is had from pronation, wrist flexion and wrist deviation,
  exactly, on a forearm that points where the hand does on the whole and goes half of its way up,
  down and aside; the elbow stays.

Angles that stand out from their neighbours are taken for faults of the recorder and bridged, as are
gaps. All are then laid on even instants and low-passed at 8 Hz forwards and backwards (Butterworth,
second order, so 4th in all and no delay): hands move slower, and recorders of this kind shake
faster. An angle that leaves the subject's range is shifted by as little as brings it back, and one
that goes through more than the range is made smaller: nobody knows the zero of a recorder's palm
and fingers, and cutting off would leave joints still that moved. A quintic spline goes through all.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.hand.angles import compose, decompose
from handstudio.hand.skeleton import FINGERS, SEGMENTS, nominal_skeleton
from handstudio.maths import so3
from handstudio.simulation.motions.actor import Actor, HandRecording, Motion
from handstudio.simulation.motions.reach import reach
from handstudio.simulation.motions.swings import through_states
from handstudio.simulation.trajectory import DEGREE, Trajectory, labelled

LOW_PASS_HZ = 8.0

_EVERY_S = 0.01
_SHORTEST_S = 0.3
_FADE_S = 0.5  # from rest to the recorded motion, and back
_NEIGHBOURS = 9  # instants of which the middle one must not stand out
_STANDS_OUT = 4.0  # standard deviations of them
_STANDS_OUT_RAD = np.deg2rad(6.0)  # and no less than this
_FOREARM_SHARE = 0.5

_MIRROR = np.array([-1.0, 1.0, 1.0])


def _recorded(actor: Actor, argument: str) -> Trajectory:
    known = actor.material.recordings
    if not known:
        raise SetupError(
            "There are no recordings of hands to play.",
            "Put some in the folder leap of the folder that HANDSTUDIO_DATA names.",
        )
    if argument not in known:
        raise SetupError(
            "There is no recording of a hand called {name!r}.",
            "Choose one of: {known}.",
            name=argument,
            known=", ".join(known),
        )
    return labelled(replayed(known[argument](), actor), "work")


def replayed(recording: HandRecording, actor: Actor) -> Trajectory:
    """The recording's motion on the actor's hand, from rest and back to rest.

    Raises:
        SetupError: the recording is shorter than 0.3 s or has nothing of some joint.
    """
    if len(recording.time_s) < 2 * _NEIGHBOURS or np.ptp(recording.time_s) < _SHORTEST_S:
        raise SetupError(
            "The recording of a hand has {count} instants: too few.",
            "Choose one of {seconds:g} s or more.",
            count=len(recording.time_s),
            seconds=_SHORTEST_S,
        )
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - takes a second to load
    from scipy.signal import butter, sosfiltfilt  # noqa: PLC0415

    angles = recorded_angles(recording)
    time_s = recording.time_s - recording.time_s[0]
    even = np.arange(0.0, time_s[-1], _EVERY_S)
    low_pass = butter(2, LOW_PASS_HZ, fs=1.0 / _EVERY_S, output="sos")
    smooth = {}
    for name, values in angles.items():
        sound = np.isfinite(values)
        sound[sound] = ~_outliers(values[sound])
        if np.count_nonzero(sound) < 2:
            raise SetupError(
                "The recording of a hand has nothing of {name}.",
                "Choose another one.",
                name=name,
            )
        bridged = PchipInterpolator(time_s[sound], values[sound])(
            np.clip(even, time_s[sound][0], time_s[sound][-1])
        )
        low, high = (np.deg2rad(end) for end in reach(actor.subject, name))
        smooth[name] = _fitted(sosfiltfilt(low_pass, bridged), low, high)
    postures = [
        actor.posture({n: float(np.rad2deg(values[i])) for n, values in smooth.items()})
        for i in range(len(even))
    ]
    return _splined(even, np.stack(postures))


def recorded_angles(recording: HandRecording) -> dict[str, Float[Array, " n"]]:
    """Named angles [rad] at the instants of a recording; NaN where a place was unknown."""
    left = recording.side == "left"
    # everything as on a right hand: what is named means the same on both
    joints = recording.joints_m.copy()
    joints[:, 0, 3] = joints[:, 0, 4]  # a thumb's tip comes right after its IP
    directions = np.diff(joints, axis=2)
    directions = np.einsum("nji,nfbj->nfbi", recording.palm, directions)
    palm = so3.from_matrix(recording.palm)
    if left:
        directions, palm = directions * _MIRROR, palm * [1.0, 1.0, -1.0, -1.0]
    out = _of_palm(palm) | _of_thumb(directions[:, 0])
    for index, finger in enumerate(FINGERS[1:], start=1):
        _, proximal, intermediate, distal = np.moveaxis(directions[:, index], 1, 0)
        mcp, pip, dip = _along([proximal, intermediate, distal])
        away = 1.0 if finger in ("index", "middle") else -1.0
        out[f"{finger}_mcp_flexion"], out[f"{finger}_mcp_abduction"] = -mcp[:, 0], away * mcp[:, 1]
        out[f"{finger}_pip_flexion"], out[f"{finger}_dip_flexion"] = -pip[:, 0], -dip[:, 0]
    return out


def _of_thumb(directions: Array) -> dict[str, Array]:
    rest = nominal_skeleton("right").q_parent_rest[SEGMENTS.index("thumb_metacarpal")]
    metacarpal, proximal, distal = np.moveaxis(directions[:, :3], 1, 0)
    in_rest = [so3.rotate(so3.conjugate(rest), d) for d in (metacarpal, proximal, distal)]
    cmc, mcp, ip = _along(in_rest)
    return {
        "thumb_cmc_flexion": -cmc[:, 0],
        "thumb_cmc_abduction": cmc[:, 1],
        "thumb_mcp_flexion": -mcp[:, 0],
        "thumb_mcp_abduction": mcp[:, 1],
        "thumb_ip_flexion": -ip[:, 0],
    }


def _along(bones: list[Array]) -> list[Array]:
    """Turns about x and z that lay y along each bone, in the frame of the bone before."""
    out, q_first_bone = [], np.tile(so3.IDENTITY, (len(bones[0]), 1))
    for bone in bones:
        x, y, z = np.moveaxis(so3.rotate(so3.conjugate(q_first_bone), bone), -1, 0)
        turns = np.stack([np.arctan2(z, y), np.arctan2(-x, np.hypot(y, z)), np.zeros_like(x)], -1)
        out.append(turns)
        q_first_bone = so3.multiply(q_first_bone, compose(turns))
    return out


def _of_palm(q_start_palm: Float[Array, "n 4"]) -> dict[str, Array]:
    """Angles of forearm and wrist that give the palm its attitude; its heading's mean is the start.

    With the forearm's flexion and heading given, what is left is ``Ry Rx Rz``: pronation, then
    the wrist's two turns.
    """
    turns = np.unwrap(decompose(q_start_palm), axis=0)
    middle = np.median(turns, axis=0)
    forearm = middle + _FOREARM_SHARE * (turns - middle)
    forearm[:, 2] = 0.0
    left = so3.to_matrix(so3.multiply(so3.conjugate(compose(forearm)), q_start_palm))
    return {
        "elbow_flexion": forearm[:, 0],
        "elbow_rotation": forearm[:, 1],
        "forearm_pronation": -np.unwrap(np.arctan2(left[:, 0, 2], left[:, 2, 2])),
        "wrist_flexion": -np.arcsin(np.clip(-left[:, 1, 2], -1.0, 1.0)),
        "wrist_deviation_ulnar": -np.arctan2(left[:, 1, 0], left[:, 1, 1]),
    }


def _outliers(values: Array) -> Array:
    """What stands out from the median of its neighbours (Hampel's rule)."""
    from scipy.ndimage import median_filter  # noqa: PLC0415 - takes a second to load

    middle = median_filter(values, _NEIGHBOURS, mode="nearest")
    away = np.abs(values - middle)
    spread = 1.4826 * median_filter(away, _NEIGHBOURS, mode="nearest")
    outliers: Array = away > np.maximum(_STANDS_OUT * spread, _STANDS_OUT_RAD)
    return outliers


def _fitted(values: Array, low: float, high: float) -> Array:
    """The course of an angle brought into a range: made smaller if need be, and shifted."""
    least, most = float(values.min()), float(values.max())
    if most - least > high - low:
        values = low + (values - least) * (high - low) / (most - least)
        least, most = low, high
    return values + max(0.0, low - least) - max(0.0, most - high)


def _splined(even: Array, postures: Array) -> Trajectory:
    """A quintic spline, with ways from rest to its first state and from its last one to rest."""
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - takes a second to load

    spline = make_interp_spline(even, postures, k=DEGREE)
    x, v, a = (spline(even, nu=order) for order in range(3))
    still = np.zeros((1, postures.shape[1]))
    # half the speed on average, so nothing has to swing back for its run-up, if there is room
    first, last = x[:1] - 0.5 * _FADE_S * v[:1], x[-1:] + 0.5 * _FADE_S * v[-1:]
    first, last = (np.clip(end, x.min(axis=0), x.max(axis=0)) for end in (first, last))
    at = np.concatenate([[0.0], even + _FADE_S, [even[-1] + 2.0 * _FADE_S]])
    return through_states(
        at.round(6),
        np.concatenate([first, x, last]),
        np.concatenate([still, v, still]),
        np.concatenate([still, a, still]),
    )


RECORDED = (
    Motion(
        "recorded",
        "A real hand's motion, recorded elsewhere",
        _recorded,
        "name",
        example="pinch",
    ),
)
