"""Which way the bones of fingers point at the flat hand: from all a finger's links together.

A link of 20 to 40 mm between centres that err by a millimetre or two tells its bone's pitch by two
to five degrees only, and a last bone has no link. The flat hand tells more: the bones of a finger
lie in a row then. Extended joints of healthy fingers differ by some degrees, so this counts by a
standard deviation, beside the links by theirs (least squares). Thumbs are straight alike, but less
so. That a flat hand is level too was tried and adds nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.axes import JointAxis
from handstudio.calibration.chain import Chain
from handstudio.calibration.swings import Swings
from handstudio.hand.skeleton import FINGERS, JOINTS, SEGMENTS
from handstudio.maths import so3

BENT_RAD = {"thumb": float(np.deg2rad(6.0))}
BENT_ELSEWHERE_RAD = float(np.deg2rad(3.0))
"""How far a bone is out of its finger's line at the flat hand, standard deviation; ours."""


def bones(
    swings: Swings, axes: Mapping[str, JointAxis], chain: Chain
) -> dict[str, Float[Array, " 3"]]:
    """Direction of bones towards the fingertip, in the sensors that drive them, by segment.

    Fingers and thumbs only, and of these the segments with a sensor and a known axis.
    """
    out: dict[str, Array] = {}
    for finger in FINGERS:
        names = [name for name in SEGMENTS if name.startswith(f"{finger}_")]
        out |= _of_finger(swings, axes, chain, [n for n in names if _known(swings, axes, n)])
    return out


def pitches(
    measured: Float[Array, " k"], sd: Float[Array, " k"], bent: float
) -> Float[Array, " k"]:
    """Pitch of each bone of one finger [rad], extension positive; 0 where no link tells any.

    Args:
        measured: Of the links, from the knuckle on; NaN where there is none.
        sd: Of these. Neighbours share a centre: what takes one up takes the other one down.
        bent: Standard deviation of a bone's pitch about the finger's.
    """
    known = np.flatnonzero(np.isfinite(measured))
    weight = np.linalg.inv(_noise(sd[known], np.diff(known) == 1))
    precision = np.zeros((len(sd) + 1, len(sd) + 1))  # the bones, and the finger
    bones, finger = np.arange(len(sd)), len(sd)
    precision[bones, bones] = bent**-2.0
    precision[bones, finger] = precision[finger, bones] = -(bent**-2.0)
    precision[finger, finger] = len(sd) * bent**-2.0
    precision[np.ix_(known, known)] += weight
    right = np.zeros(len(sd) + 1)
    right[known] = weight @ measured[known]
    # of no link at all nothing follows: the least solution is 0
    found: Array = np.linalg.lstsq(precision, right, rcond=None)[0][:-1]
    return found


def _noise(sd: Array, neighbours: Array) -> Array:
    noise = np.diag(sd**2)
    for i in np.flatnonzero(neighbours):
        noise[i, i + 1] = noise[i + 1, i] = -0.5 * sd[i] * sd[i + 1]
    return noise


def _known(swings: Swings, axes: Mapping[str, JointAxis], segment: str) -> bool:
    joint = JOINTS[SEGMENTS.index(segment)].name
    return joint in axes and swings.drivers(joint)[1] is not None


def _of_finger(
    swings: Swings, axes: Mapping[str, JointAxis], chain: Chain, names: Sequence[str]
) -> dict[str, Array]:
    if not names:
        return {}
    q = {name: swings.q_flat(_driver(swings, name)) for name in names}
    # any direction will do that pitches can be told against: the mean of the boards' own
    ahead = np.sum([so3.rotate(one, np.array([0.0, 1.0, 0.0])) for one in q.values()], axis=0)
    frames = {name: _across(axes[JOINTS[SEGMENTS.index(name)].name], ahead) for name in names}
    links = [_pitch(chain, name, q[name], *frames[name]) for name in names]
    measured, sd = np.array(links).T
    bent = BENT_RAD.get(names[0].partition("_")[0], BENT_ELSEWHERE_RAD)
    found = pitches(measured, sd, bent)
    return {
        name: so3.rotate(so3.conjugate(q[name]), np.cos(turn) * y + np.sin(turn) * z)
        for name, turn, (y, z) in zip(names, found, frames.values(), strict=True)
    }


def _driver(swings: Swings, segment: str) -> int:
    driver = swings.drivers(JOINTS[SEGMENTS.index(segment)].name)[1]
    assert driver is not None  # or it were not among the known
    return driver


def _across(axis: JointAxis, ahead: Array) -> tuple[Array, Array]:
    """Ahead and up of a bone of pitch 0, both square to its axis, in the world."""
    y = ahead - axis.in_world * (axis.in_world @ ahead)
    y = y / np.linalg.norm(y)
    return y, np.cross(axis.in_world, y)


def _pitch(chain: Chain, segment: str, q: Array, y: Array, z: Array) -> tuple[float, float]:
    """Of the link to the next joint, and its standard deviation [rad]; NaN for last bones."""
    beyond = [joint.name for joint in JOINTS if joint.parent == segment]
    if not beyond:
        return float("nan"), float("nan")
    link, spread = chain.link(beyond[0])
    link, up = so3.rotate(q, link), so3.rotate(so3.conjugate(q), z)
    ahead, high = float(link @ y), float(link @ z)
    return float(np.arctan2(high, ahead)), float(np.sqrt(up @ spread @ up) / np.hypot(ahead, high))
