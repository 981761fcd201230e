"""From a prepared course to a subject calibration: axes, centres, frames, and how sure they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.axes import JointAxis, flexion_axis
from handstudio.calibration.chain import Chain, solved
from handstudio.calibration.chain_tree import USUAL, Priors
from handstudio.calibration.frames import Frames, framed, turning
from handstudio.calibration.rocking import Rocking, leaning, rocking, steadied
from handstudio.calibration.subject import (
    Axis,
    Centre,
    Quaternion,
    Rock,
    Segment,
    Source,
    Tip,
    Vector,
)
from handstudio.calibration.swings import Swings
from handstudio.hand.skeleton import (
    DISTALS,
    FINGERS,
    JOINTS,
    PARENTS,
    SEGMENTS,
    HandSide,
    Skeleton,
    nominal_skeleton,
)

POPULATION_SHARE = 0.06
"""How much lengths of segments differ between hands of one length, standard deviation; ours."""

_TIP_SHARE = 0.08  # of a last bone's length that was not measured


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What signals say of a hand.

    Attributes:
        swings: The course, sensors freed of rocking as far as swings alone tell of it.
        axes: Flexion axes by joint.
        rocking: How boards rock.
        chain: Joint centres.
        frames: Segment frames.
        skeleton: The mean proportions it was held against.
    """

    swings: Swings
    axes: Mapping[str, JointAxis]
    rocking: Rocking
    chain: Chain
    frames: Frames
    skeleton: Skeleton

    def segments(self) -> tuple[Segment, ...]:
        """All segments, as they are kept."""
        return tuple(_segment(self, k) for k in range(len(SEGMENTS)))

    def tips(self) -> tuple[Tip, ...]:
        """All fingertips."""
        return tuple(
            Tip(
                finger,
                _vector(self.frames.t_distal_tip[i]),
                (0.003 if measured else _TIP_SHARE * _length(self.frames.t_distal_tip[i])),
                "measured" if measured else "proportions",
            )
            for i, (finger, measured) in enumerate(
                zip(FINGERS, self.frames.tip_measured, strict=True)
            )
        )

    def centres(self) -> tuple[Centre, ...]:
        """Centres of joints that were swung, seen from the sensors on both sides."""
        swung = [joint.name for joint in JOINTS if joint.name in self.axes]
        return tuple(centre for joint in swung for centre in _centres(self, joint))

    def functional_axes(self) -> tuple[Axis, ...]:
        """Flexion axes, seen from the sensor beyond the joint."""
        out = []
        for joint, axis in self.axes.items():
            sensor = self.swings.drivers(joint)[1]
            assert sensor is not None  # or there were no axis
            name = self.swings.layout.names[sensor]
            out.append(Axis(joint, name, _vector(axis.seen_from(self.swings, sensor)), axis.sd_rad))
        return tuple(out)

    def rocks(self) -> tuple[Rock, ...]:
        """How boards rock with the joints beside them, as far as it could be told."""
        names = self.swings.layout.names
        return tuple(Rock(names[s], joint, share) for (s, joint), share in self.rocking.items())


def found(swings: Swings, side: HandSide, hand_length_m: float, priors: Priors = USUAL) -> Found:
    """Compute all that the swings of a course tell of a hand."""
    raw = _axes(swings)
    rocks = rocking(swings, raw)
    steady = steadied(swings, raw, rocks)
    axes = _axes(steady)
    skeleton = nominal_skeleton(side, hand_length_m, swings.layout.hand_type)
    chain = solved(steady, axes, skeleton, priors)
    rocks = leaning(steady, axes, chain) | rocks
    return Found(steady, axes, rocks, chain, framed(steady, axes, chain, skeleton), skeleton)


def _axes(swings: Swings) -> dict[str, JointAxis]:
    every = ((joint.name, flexion_axis(swings, joint.name)) for joint in JOINTS)
    return {name: axis for name, axis in every if axis is not None}


def _segment(found: Found, k: int) -> Segment:
    frames = found.frames
    sensor = frames.driver[k]
    spread = frames.covariance[k]
    far, far_sd, far_source = _far(found, k)
    usual = float(found.skeleton.length_m[k])
    return Segment(
        name=SEGMENTS[k],
        sensor="" if sensor is None else found.swings.layout.names[sensor],
        q_sensor_segment=_quaternion(frames.q_sensor_segment[k]),
        q_parent_rest=_quaternion(frames.q_parent_rest[k]),
        t_parent_joint=_vector(frames.t_parent_joint[k]),
        sd_m=_vector(np.sqrt(np.diag(spread))),
        length_m=far,
        length_sd_m=far_sd,
        source=_source(found, turning(found.swings, k)),
        length_source=far_source,
        plausible=(far - usual) / float(np.hypot(POPULATION_SHARE * usual, far_sd)),
    )


def _far(found: Found, k: int) -> tuple[float, float, Source]:
    """Length of a segment, its standard deviation, and where it is from."""
    frames = found.frames
    children = [c for c, parent in enumerate(PARENTS) if parent == k]
    if not children:
        finger = DISTALS.index(SEGMENTS[k])
        tip = found.tips()[finger]
        return _length(frames.t_distal_tip[finger]), tip.sd_m, tip.source
    child = max(children, key=lambda c: _length(frames.t_parent_joint[c]))
    link = frames.t_parent_joint[child]
    along = link / np.linalg.norm(link)
    sd = float(np.sqrt(along @ frames.covariance[child] @ along))
    return _length(link), sd, _source(found, JOINTS[child].name)


def _source(found: Found, joint: str) -> Source:
    """How much the signals added to what was known before; nothing of a joint nobody swung."""
    chain, key = found.chain, ("link", 0, joint)
    if key not in chain.index or joint not in found.axes:
        return "proportions"
    part = slice(chain.index[key], chain.index[key] + 3)
    sd = np.sqrt(np.diag(chain.covariance)[part])
    left = float(np.median(sd / chain.prior_sd[part]))
    return "measured" if left < 0.35 else "with prior" if left < 0.8 else "proportions"


def _centres(found: Found, joint: str) -> list[Centre]:
    parent, child = found.swings.drivers(joint)
    out = []
    if child is not None:
        place, spread = found.chain.sensor(child)
        out.append(_centre(found, joint, child, place, spread))
    if parent is not None and ("link", 0, joint) in found.chain.index:
        place, spread = found.chain.sensor(parent)
        link, more = found.chain.link(joint)
        out.append(_centre(found, joint, parent, place - link, spread + more))
    return out


def _centre(found: Found, joint: str, sensor: int, place: Array, spread: Array) -> Centre:
    axis = found.axes[joint]
    hinge = {j.name: j.axes == 1 for j in JOINTS}[joint]
    unseen = axis.seen_from(found.swings, sensor) if hinge else np.zeros(3)
    values = np.linalg.eigvalsh(spread)
    return Centre(
        joint=joint,
        sensor=found.swings.layout.names[sensor],
        from_centre_m=_vector(place),
        sd_m=_vector(np.sqrt(np.diag(spread))),
        unseen=_vector(unseen),
        residual=found.chain.residual.get(joint, float("nan")),
        excitation_deg=_excitation(found, joint),
        condition=float(np.sqrt(values[-1] / values[0])),
    )


def _excitation(found: Found, joint: str) -> tuple[float, float]:
    axis = found.axes[joint]
    main = [np.ptp(axis.angle[0][s.moving]) for s in found.swings.of_joint(joint, flexion=True)]
    side = [
        np.ptp(axis.sideways[0][s.moving])
        for s in found.swings.of_joint(joint, flexion=False)
        if axis.sideways is not None
    ]
    return (
        float(np.rad2deg(max(main, default=0.0))),
        float(np.rad2deg(max(side, default=0.0))),
    )


def _length(v: Array) -> float:
    return float(np.linalg.norm(v))


def _vector(v: Array) -> Vector:
    x, y, z = (float(c) for c in v)
    return x, y, z


def _quaternion(q: Array) -> Quaternion:
    w, x, y, z = (float(c) for c in q)
    return w, x, y, z
