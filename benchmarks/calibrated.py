"""One virtual person calibrated, held against the truth that the calibration cannot see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import msgspec
import numpy as np
from jaxtyping import Float

from benchmarks.checked import CHECK, CHECKS, Checks, checks
from handstudio.arrays import Array
from handstudio.calibration.chain_tree import UNCALIBRATED as ROUGH
from handstudio.calibration.chain_tree import USUAL, Priors
from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.opening import opened
from handstudio.calibration.recorded import even
from handstudio.calibration.sensors import calibrate_sensors
from handstudio.calibration.solve import Found, found
from handstudio.calibration.subject import SubjectCalibration
from handstudio.calibration.swings import Swings
from handstudio.hand.skeleton import JOINTS, PARENTS, HandType
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.recording.material import material
from handstudio.samples import ImuSamples
from handstudio.simulation.imperfections.strengths import Imperfections
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.mounting import segment_indices
from handstudio.simulation.rig import Truth
from handstudio.simulation.subject import Subject, subject
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.worn import begin, sense, wear

RATE_HZ = 100
COURSE = "calibration"
TUMBLE = "quick_start+tumble"


@dataclass(frozen=True, slots=True)
class Asked:
    """Whom to calibrate, and how."""

    person: int
    seed: int
    imperfections: Imperfections
    sensors_first: bool = True  # the sensors' errors, by a tumble of the glove on another day
    priors: Priors = USUAL
    check: bool = False  # whether it holds, some minutes later and after slips
    hand_type: HandType = 3


class Errors(msgspec.Struct, frozen=True):
    """How far off a calibration is, by joint, link (the joint at its end) or finger.

    Attributes:
        centre_mm: Of a joint's centre in the sensor beyond it; of a hinge, from its axis.
        along_mm: And along that axis.
        link_mm: Of a link's length, and the standard deviation that was told.
        axis_deg: Of a flexion axis against the principal axis of the true rotation.
        frame_deg: And against the axis that the true frame is laid by.
        checks: What checks of it read; None: none were done.
    """

    person: int
    centre_mm: dict[str, float]
    along_mm: dict[str, float]
    link_mm: dict[str, tuple[float, float]]
    axis_deg: dict[str, float]
    frame_deg: dict[str, float]
    checks: Checks | None = None


def run(asked: Asked) -> Errors:
    """Let a person do the course, calibrate, compare."""
    hand, known, truth, labels = calibrated_hand(asked)
    errors = _compared(asked.person, hand, truth, labels)
    if asked.check:
        errors = msgspec.structs.replace(errors, checks=_checked(asked, hand, known))
    return errors


def kept(hand: Found, someone: Subject, name: str = "own") -> SubjectCalibration:
    """A calibration as the studio would keep it."""
    return SubjectCalibration(
        id=name,
        made_utc="",
        software="",
        subject=str(someone.number),
        side=someone.side,
        hand_length_m=someone.hand_length_m,
        hand_type=hand.swings.layout.hand_type,
        device="",
        segments=hand.segments(),
        tips=hand.tips(),
        centres=hand.centres(),
        axes=hand.functional_axes(),
        rocking=hand.rocks(),
    )


def _checked(asked: Asked, hand: Found, known: DeviceCalibration | None) -> Checks:
    someone, takes = subject(asked.person), []
    for count in range(CHECKS):
        seed = asked.seed + 1000 * (count + 1)
        trajectory = perform(CHECK, Actor(someone, seed, material()))
        samples, _ = _sensed(someone, asked, trajectory, occasion=0)
        swings = _opened(asked, samples, trajectory, known)
        (grasp,) = (span for span in trajectory.spans if span.name == "work")
        takes.append((swings, _part(grasp.start_s, grasp.end_s)))
    return checks(kept(hand, someone), takes)


Labelled: TypeAlias = list[tuple[float, float, str]]


def calibrated_hand(asked: Asked) -> tuple[Found, DeviceCalibration | None, Truth, Labelled]:
    """Let a person do the course: the hand and the sensors as found, and what was true."""
    someone = subject(asked.person)
    known = _sensors(someone, asked) if asked.sensors_first else None
    trajectory = perform(COURSE, Actor(someone, asked.seed, material()))
    samples, truth = _sensed(someone, asked, trajectory, occasion=0)
    labels = _labels(trajectory)
    swings = _opened(asked, samples, trajectory, known)
    priors = ROUGH if known is None else asked.priors
    hand = found(swings, someone.side, someone.hand_length_m, priors)
    return hand, known, truth, labels


def _labels(trajectory: Trajectory) -> Labelled:
    return sorted((span.start_s, span.end_s, span.name) for span in trajectory.spans)


def _opened(
    asked: Asked, samples: ImuSamples, trajectory: Trajectory, known: DeviceCalibration | None
) -> Swings:
    layout = glove(hand_type=asked.hand_type)
    recorded = even([samples], RATE_HZ, known, layout.names)
    free, labels = known is not None, _labels(trajectory)
    return opened(layout, float(RATE_HZ), recorded, labels, calibrated=free)


def functional_frames(
    someone: Subject, hand: Found, truth: Truth, labels: Labelled
) -> Float[Array, "k 4"]:
    """Frames as a calibration lays them, from the truth: attitude in the simulator's own, (k, 4).

    x is the principal axis of a joint's true flexion in the course, z square to it and to the true
    bone. Where a joint was not swung, or has no sensor, they are the simulator's own.
    """
    flat = (hand.swings.flat.start + hand.swings.flat.stop) // 2
    out = np.tile(so3.IDENTITY, (len(JOINTS), 1))
    for k, joint in enumerate(JOINTS):
        if joint.name in hand.axes:
            x = _true_axis(truth, k, flat, labels)
            x = x * np.sign(x[0])
            z = np.cross(x, someone.skeleton.t_far_end[k])
            z = z / np.linalg.norm(z)
            out[k] = so3.from_matrix(np.stack([x, np.cross(z, x), z], axis=-1))
    return out


def _sensors(someone: Subject, asked: Asked) -> DeviceCalibration:
    trajectory = perform(TUMBLE, Actor(someone, asked.seed, material()))
    samples, _ = _sensed(someone, asked, trajectory, occasion=1)
    known, _ = calibrate_sensors(samples, glove().names)
    return known


def _sensed(
    someone: Subject, asked: Asked, trajectory: Trajectory, occasion: int
) -> tuple[ImuSamples, Truth]:
    worn = wear(someone, glove(), asked.imperfections, asked.seed, occasion=occasion)
    state, runs, truths = begin(worn), [], []
    count = round(trajectory.duration_s * RATE_HZ)
    for start in range(0, count, 1000):
        index = np.arange(start, min(start + 1000, count))
        sensed, state = sense(worn, state, trajectory, index * (1_000_000 // RATE_HZ), RATE_HZ)
        runs.append(sensed.samples)
        truths.append(sensed.truth)
    samples = ImuSamples(*(np.concatenate(x) for x in _columns(runs, ImuSamples.__slots__)))
    return samples, Truth(*(np.concatenate(x) for x in _columns(truths, Truth.__slots__)))


def _columns(parts: Sequence[object], names: Sequence[str]) -> list[list[Array]]:
    return [[getattr(part, name) for part in parts] for name in names]


def _compared(person: int, hand: Found, truth: Truth, labels: Labelled) -> Errors:
    swings = hand.swings
    flat = (swings.flat.start + swings.flat.stop) // 2
    on = segment_indices(swings.layout)
    q_world_segment = truth.q_world_segment[flat, on]
    q_segment_sensor = so3.multiply(so3.conjugate(q_world_segment), truth.q_world_sensor[flat])
    t_segment_sensor = so3.rotate(
        so3.conjugate(q_world_segment), truth.t_world_sensor[flat] - truth.t_world_joint[flat, on]
    )
    centre, along, axis_deg, frame_deg, means = {}, {}, {}, {}, {}
    for k, joint in enumerate(JOINTS):
        sensor = swings.drivers(joint.name)[1]
        if joint.name not in hand.axes or sensor is None:
            continue
        turn = _true_axis(truth, k, flat, labels)
        means[k] = _mean_centre(truth, k, labels, turn)
        seen = so3.conjugate(q_segment_sensor[sensor])
        true = so3.rotate(seen, t_segment_sensor[sensor] - means[k][0])
        n = so3.rotate(seen, turn)
        off = 1e3 * (hand.chain.sensor(sensor)[0] - true)
        beside = off - n * (off @ n)
        hinge = joint.axes == 1
        centre[joint.name] = float(np.linalg.norm(beside if hinge else off))
        if hinge:
            along[joint.name] = float(off @ n)
        found_axis = hand.axes[joint.name].seen_from(swings, sensor)
        axis_deg[joint.name] = _between(found_axis, n)
        frame_deg[joint.name] = _between(found_axis, so3.rotate(seen, np.array([1.0, 0.0, 0.0])))
    links = {}
    for k, joint in enumerate(JOINTS):
        if k in means and PARENTS[k] in means:
            link, spread = hand.chain.link(joint.name)
            length = float(np.linalg.norm(link))
            sd = float(np.sqrt(link @ spread @ link)) / length
            true_length = float(np.linalg.norm(means[k][1] - means[PARENTS[k]][0]))
            links[joint.name] = (1e3 * (length - true_length), 1e3 * sd)
    return Errors(person, centre, along, links, axis_deg, frame_deg)


def _between(a: Array, b: Array) -> float:
    return float(np.rad2deg(np.arccos(min(1.0, abs(float(a @ b))))))


def _part(start_s: float, end_s: float) -> slice:
    return slice(round(start_s * RATE_HZ), round(end_s * RATE_HZ))


def _true_axis(truth: Truth, k: int, flat: int, labels: Labelled) -> Array:
    """Principal axis of a joint's true flexion, in its segment at the flat hand."""
    parts = [_part(a, b) for a, b, name in labels if name == f"{JOINTS[k].name}:flexion"]
    rel = [_relative(truth, k, part) for part in parts]
    steps = [so3.log(so3.multiply(q[1:], so3.conjugate(q[:-1]))) for q in rel]
    axis = np.linalg.svd(np.concatenate(steps), full_matrices=False)[2][0]
    here = _relative(truth, k, slice(flat, flat + 1))[0]
    return so3.rotate(so3.conjugate(here), axis)


def _relative(truth: Truth, k: int, part: slice) -> Array:
    q = truth.q_world_segment[part, k]
    if PARENTS[k] < 0:
        return q
    return so3.multiply(so3.conjugate(truth.q_world_segment[part, PARENTS[k]]), q)


def _mean_centre(truth: Truth, k: int, labels: Labelled, axis: Array) -> tuple[Array, Array]:
    """The point fixed in both segments that moves least in a joint's true swings.

    In the child's frame and in the parent's. Rolling joints and axes that pass by one another have
    no centre but this; along a hinge's axis it is where the true frame has it.
    """
    rows, right = [], []
    for start, end, name in labels:
        if not name.startswith(f"{JOINTS[k].name}:"):
            continue
        part = slice(_part(start, end).start, _part(start, end).stop, 5)
        child = so3.to_matrix(truth.q_world_segment[part, k])
        if PARENTS[k] < 0:
            parent, base = np.tile(np.eye(3), (len(child), 1, 1)), np.zeros(3)
        else:
            parent = so3.to_matrix(truth.q_world_segment[part, PARENTS[k]])
            base = truth.t_world_joint[part, PARENTS[k]]
        rows.append(np.concatenate([child, -parent], axis=2).reshape(-1, 6))
        right.append((base - truth.t_world_joint[part, k]).reshape(-1))
    origin = _relative_place(truth, k)
    before = np.concatenate([np.zeros(3), origin])
    a, y = np.concatenate(rows), np.concatenate(right)
    n = np.concatenate([axis, np.zeros(3)])
    held = (1e3 if JOINTS[k].axes == 1 else 0.0) * np.outer(n, n) + 1e-9 * np.eye(6)
    normal = a.T @ a / len(a) + held
    x = before + np.linalg.solve(normal, a.T @ (y - a @ before) / len(a))
    return x[:3], x[3:]


def _relative_place(truth: Truth, k: int) -> Array:
    place = truth.t_world_joint[0, k]
    if PARENTS[k] < 0:
        return np.asarray(place)
    away = place - truth.t_world_joint[0, PARENTS[k]]
    return so3.rotate(so3.conjugate(truth.q_world_segment[0, PARENTS[k]]), away)
