"""The unknowns of `chain`: who hangs on whom, which vectors are sought, what is known before."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.axes import JointAxis
from handstudio.calibration.mounting import nominal_places
from handstudio.calibration.swings import Swings
from handstudio.hand.skeleton import JOINTS, SEGMENTS, ULNAR, Joint, Skeleton

Key: TypeAlias = tuple[str, int, str]
"""An unknown vector: ("link", 0, joint), ("sensor", sensor, ""), ("skin", sensor, joint),
("roll", 0, joint), ("pass", 0, joint), ("lean", 0, joint), ("bias", sensor, "")."""


@dataclass(frozen=True, slots=True)
class Priors:
    """How well everything is known before: standard deviations, all but the shares in SI.

    Attributes:
        link_share: Of a link, as a share of its length in mean proportions.
        link_m: And beside that.
        lateral_m: Of a sensor's place across its bone: gloves are cut to lie over the middle.
        sensor_off_m: Of a sensor along the axis of its segment's hinge. Tighter than gloves are
            cut: an axis that wanders would else be taken for knowledge of that place.
        link_off_m: Of a link along the axis of the hinge it leads to.
        along_share: Of its place along the bone, as a share of the bone.
        height_m: Of its height above the bone.
        skin_m_rad: How far skin moves a board for a turn of a joint beside it.
        roll_m_rad: How far a joint's centre wanders with its flexion; the wrist's five times that.
        lean_rad_rad: How a link turns in a board that rocks by nobody knows how much.
        pass_m: How far the two axes of wrist and thumb pass by one another; of others a quarter.
        tilt_rad: Of the attitude in a swing, and of how it drifts.
        acc_bias: Of an accelerometer [m/s²].
        noise: Of one smoothed acceleration, at least [m/s²].
        tilting: How far a board on skin tilts where it is accelerated [rad per m/s²].
        lagging: And how far it stays behind [m per m/s²].
        model_m: What the model leaves out, of every place: skin is no straight line, axes wander.
            Chosen on virtual people so that error bars hold.
        swing_share: What else differs from swing to swing counts this much more than noise.
    """

    link_share: float = 0.15
    link_m: float = 0.004
    lateral_m: float = 0.003
    sensor_off_m: float = 0.0007
    link_off_m: float = 0.0015
    along_share: float = 0.25
    height_m: float = 0.01
    skin_m_rad: float = 0.002
    roll_m_rad: float = 0.0001
    lean_rad_rad: float = 0.03
    pass_m: float = 0.004
    tilt_rad: float = float(np.deg2rad(0.1))
    acc_bias: float = 0.005
    noise: float = 0.02
    model_m: float = 0.0012
    swing_share: float = 2.0
    tilting: float = 0.005
    lagging: float = 1e-4


USUAL = Priors()
"""Where the sensors' own errors were taken off."""

UNCALIBRATED = Priors(acc_bias=0.1, tilt_rad=float(np.deg2rad(0.7)), model_m=0.002)
"""Where they were not: 10 mg of bias, and half a degree for a scale that is 1 % off."""


_OFF_PLANE_M = 1e-5
_PASSING = ("wrist", "thumb_cmc")


class Tree:
    """Who hangs on whom: segments by sensor, sensors by segment, joints by their child."""

    def __init__(self, swings: Swings, axes: Mapping[str, JointAxis]) -> None:
        self.swings, self.axes = swings, axes
        self.segment = {s: swings.layout.sensors[s].segment for s in swings.alive}
        self.driver = swings.first
        self.joint_of = {joint.child: joint for joint in JOINTS}
        self.hinged = swings.layout.hand_type == 3

    def chain(self, segment: str) -> list[Joint]:
        """Joints from the elbow out to a segment."""
        out: list[Joint] = []
        at: str | None = segment
        while at is not None:
            out.append(self.joint_of[at])
            at = self.joint_of[at].parent
        return out[::-1]

    def below(self, joint: str) -> list[int]:
        """Sensors that a joint moves, whose whole chain carries sensors."""
        return [
            s
            for s, segment in self.segment.items()
            if joint in [j.name for j in self.chain(segment)]
            and all(j.parent is None or j.parent in self.driver for j in self.chain(segment))
        ]

    def begin_at(self, joint: str) -> tuple[str, ...]:
        """Segments that begin at a joint's centre: at the wrist both blocks of an unhinged palm."""
        child = JOINTS[number_of(joint)].child
        return (child, ULNAR) if child == "hand" and not self.hinged else (child,)

    def beside(self, sensor: int) -> list[str]:
        """Joints whose skin a sensor lies on."""
        segment = self.segment[sensor]
        return [j.name for j in JOINTS if segment in (j.parent, j.child) and j.name in self.axes]


def index_of(tree: Tree) -> dict[Key, int]:
    """Where each unknown vector begins."""
    links = [j for j in JOINTS if j.child != ULNAR or tree.hinged]
    keys: list[Key] = [("link", 0, j.name) for j in links if j.parent in tree.driver]
    keys += [("sensor", s, "") for s in tree.segment]
    keys += [("skin", s, j) for s in tree.segment for j in tree.beside(s)]
    moving = [j.name for j in JOINTS if j.parent in tree.driver and j.name in tree.axes]
    keys += [("roll", 0, name) for name in moving]
    keys += [("pass", 0, name) for name in moving if tree.axes[name].sideways is not None]
    keys += [("lean", 0, name) for name in moving if name.endswith("_dip")]
    keys += [("bias", s, "") for s in tree.segment]
    return {key: 3 * count for count, key in enumerate(keys)}


def prior_of(
    tree: Tree, index: dict[Key, int], skeleton: Skeleton, priors: Priors
) -> tuple[Array, Array]:
    """Means of all unknowns, and the precision of what is known of them before."""
    size = 3 * len(index)
    mean, precision = np.zeros(size), np.zeros((size, size))
    places = nominal_places(tree.swings.layout, skeleton)
    for (kind, sensor, joint), at in index.items():
        part = slice(at, at + 3)
        if kind == "link":
            link = skeleton.t_parent_joint[number_of(joint)]
            mean[part] = link
            sd = priors.link_share * np.linalg.norm(link) + priors.link_m
            precision[part, part] = np.eye(3) / sd**2
        elif kind == "sensor":
            far = skeleton.t_far_end[SEGMENTS.index(tree.segment[sensor])]
            mean[part] = places[sensor]
            lengthwise = max(priors.along_share * float(np.linalg.norm(far)), priors.height_m)
            precision[part, part] = np.diag(
                [priors.lateral_m**-2, lengthwise**-2, priors.height_m**-2]
            )
        elif kind in ("skin", "roll", "pass", "lean"):
            seen_by = sensor if kind == "skin" else tree.driver[parent_of(joint)]
            n = tree.axes[joint].seen_from(tree.swings, seen_by)
            along_n, across = np.outer(n, n), np.eye(3) - np.outer(n, n)
            wide = priors.skin_m_rad if kind == "skin" else priors.roll_m_rad
            if kind == "roll" and joint == "wrist":
                wide *= 5.0
            if kind == "lean":
                wide = priors.lean_rad_rad * float(
                    np.linalg.norm(skeleton.t_parent_joint[number_of(joint)])
                )
            if kind == "pass":
                along_n, across = across, along_n
                wide = priors.pass_m * (1.0 if joint in _PASSING else 0.25)
            precision[part, part] = along_n / _OFF_PLANE_M**2 + across / wide**2
        else:
            precision[part, part] = np.eye(3) / priors.acc_bias**2
        hinge = _hinge(tree, kind, sensor, joint)
        if hinge is not None:
            off = priors.link_off_m if kind == "link" else priors.sensor_off_m
            mean[part] -= hinge * (hinge @ mean[part])
            precision[part, part] += np.outer(hinge, hinge) / off**2
    return mean, precision


def _hinge(tree: Tree, kind: str, sensor: int, joint: str) -> Array | None:
    """The axis along which a hinge's swings tell nothing of this vector, in its frame."""
    if kind == "sensor":
        joint = tree.joint_of[tree.segment[sensor]].name
    if kind not in ("sensor", "link") or JOINTS[number_of(joint)].axes != 1:
        return None
    if joint not in tree.axes:
        return None
    seen_by = sensor if kind == "sensor" else tree.driver[parent_of(joint)]
    return tree.axes[joint].seen_from(tree.swings, seen_by)


def parent_of(joint: str) -> str:
    """The segment before a joint that is not the root's."""
    parent = JOINTS[number_of(joint)].parent
    assert parent is not None
    return parent


def number_of(joint: str) -> int:
    """Index of a joint."""
    return [j.name for j in JOINTS].index(joint)
