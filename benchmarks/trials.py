"""One trial of the accuracy bench: a virtual person does something, a filter follows, both compare.

The pipeline sees events only; the truth is looked at when it is done.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

import msgspec
import numpy as np

from benchmarks.calibrated import Asked, calibrated_hand, functional_frames, kept
from benchmarks.honesty import inside_two_sd
from handstudio import pipeline
from handstudio.analysis.hand_error import (
    HandPoints,
    SensorErrors,
    angle_errors,
    hand_points,
    heading_scatter,
    point_errors,
    sensor_errors,
)
from handstudio.arrays import Array
from handstudio.calibration.device import corrected
from handstudio.calibration.heading import CALIBRATED, UNCALIBRATED, Tolerances
from handstudio.calibration.quick_start import quick_start
from handstudio.calibration.subject import Axis, Centre, Segment, SubjectCalibration, Tip
from handstudio.hand.angles import hand_angles
from handstudio.hand.skeleton import FINGERS, JOINTS, SEGMENTS, HandSide
from handstudio.hand_fit import HandFit, fit_of
from handstudio.kinematics import angles_of, measured_angles, pose_of
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.recording.material import material
from handstudio.samples import ImuSamples
from handstudio.setup import HandModel, Setup, calibrated, filter_named, smoothing
from handstudio.simulation.imperfections.readout import MPU9250
from handstudio.simulation.imperfections.strengths import Imperfections
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.mounting import nominal_mounting, segment_indices
from handstudio.simulation.rig import Truth
from handstudio.simulation.subject import Subject, subject
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.worn import Worn, begin, sense, wear
from handstudio.smoothing import Smoother

Calibration: TypeAlias = Literal["truth", "nominal", "own"]
"""What the pipeline is told of hand and mounting: all of it; nothing but the hand's length; or what
a course before, in the same donning, found of them, of the sensors, and of headings."""

RATE_HZ = 100
_X_ALONG_BONE = so3.about_z(0.5 * np.pi)
_BLOCK = 1000  # instants simulated in one go
_SETTLED_S = 2.5  # without a heading rotation: the first rest has been found by then


@dataclass(frozen=True, slots=True)
class Trial:
    """What is tried."""

    person: int
    motion: str
    imperfections: Imperfections
    seed: int
    filter: str = "vqf"
    calibration: Calibration = "truth"
    side: HandSide = "right"
    smooth: bool = False  # with the future taken in
    compass: bool = True  # otherwise no magnetometer is read
    x_along_bone: bool = False  # otherwise a sensor's x lies along the flexion axis
    align: bool = False  # headings by the quick start of the take, also where nothing else is "own"


class Figures(msgspec.Struct, frozen=True):
    """How far off a trial was, RMS over its instants [deg, mm]; names in the order of the layout.

    Attributes:
        seconds: Compared.
        heading_offset_deg: Taken out of all orientations alike.
        heading_sd_deg: Scatter of the sensors' mean headings.
        sensors: Total, heading and inclination of every sensor.
        segments: Total of every segment that carries a sensor, against the simulator's frames.
        functional: The same against frames by true functional axes; with ``own`` alone.
        definition: How far these are from the simulator's; with ``own`` alone.
        inside: Share of errors within two standard deviations, own and relative; of a filter
            that tells them.
        angles: Of every joint angle.
        tips_elbow, tips_hand: Of every fingertip, thumb to little finger.
        places_elbow: Of every sensor, from the elbow.
    """

    seconds: float
    heading_offset_deg: float
    heading_sd_deg: float
    sensors: dict[str, tuple[float, float, float]]
    segments: dict[str, float]
    angles: dict[str, float]
    tips_elbow: tuple[float, ...]
    tips_hand: tuple[float, ...]
    places_elbow: dict[str, float]
    functional: dict[str, float] = {}
    definition: dict[str, float] = {}
    inside: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """A trial after the filter, before comparison."""

    worn: Worn
    setup: Setup
    trajectory: Trajectory
    truth: Truth
    motion: pipeline.Motion
    compared: Array = field(repr=False)  # which instants
    own: HandFit | None = None  # the hand as a course before found it
    q_segment_functional: Array | None = field(default=None, repr=False)  # true axes of that course
    runs: tuple[ImuSamples, ...] = field(default=(), repr=False)  # what the sensors told

    @property
    def fit(self) -> HandFit:
        """Hand and mounting as they are."""
        mounting, skeleton = self.worn.mounting, self.worn.subject.skeleton
        return HandFit(skeleton, so3.conjugate(mounting.q_segment_sensor))


def run(trial: Trial) -> Figures:
    """Try it, and compare."""
    return compare(follow(trial), trial.calibration)


def follow(trial: Trial, performed: Trajectory | None = None) -> Followed:
    """Let the person perform and the filter follow."""
    someone = subject(trial.person, trial.side)
    if performed is None:
        performed = performance(someone, trial.motion, trial.seed)
    nominal = nominal_mounting(glove(trial.side), someone.skeleton)
    if trial.x_along_bone:
        nominal = replace(
            nominal, q_segment_sensor=so3.multiply(nominal.q_segment_sensor, _X_ALONG_BONE)
        )
    worn = wear(someone, glove(trial.side), trial.imperfections, trial.seed, nominal=nominal)
    setup = Setup(
        worn.layout,
        float(RATE_HZ),
        float(MPU9250.mag_rate_hz),
        filter=filter_named(trial.filter),
        hand=HandModel(hand_length_m=someone.hand_length_m),
    )
    motions, truths, runs = [], [], []
    wearing = begin(worn)
    count = round(performed.duration_s * RATE_HZ)
    for start in range(0, count, _BLOCK):
        index = np.arange(start, min(start + _BLOCK, count))
        sensed, wearing = sense(worn, wearing, performed, index * (1_000_000 // RATE_HZ), RATE_HZ)
        runs.append(sensed.samples)
        truths.append(sensed.truth)
    own, functional = None, None
    if trial.calibration == "own":
        setup, own, functional = _own(trial, setup, runs)
    if trial.calibration == "truth":
        setup = calibrated(setup, subject=as_it_is(worn))
    if trial.align and trial.calibration != "own":
        labels = [(span.start_s, span.end_s, span.name) for span in performed.spans]
        setup = _aligned(setup, trial, runs, labels=labels)
    if not trial.compass:
        runs = [replace(samples, fresh=np.zeros_like(samples.fresh)) for samples in runs]
    if trial.smooth:
        motions = _smoothed(smoothing(setup), runs)
    else:
        state = pipeline.begin(setup)
        for samples in runs:
            motion, state = pipeline.run(setup, state, [samples])
            motions.append(motion)
    truth = _joined(truths)
    time_s = truth.time_us * 1e-6
    compared = time_s >= _begins_s(performed)
    motion = pipeline.join(motions)
    return Followed(worn, setup, performed, truth, motion, compared, own, functional, tuple(runs))


def _smoothed(setup: Setup, runs: list[ImuSamples]) -> list[pipeline.Motion]:
    smoother, state, motions = Smoother(setup), pipeline.begin(setup), []
    for samples in runs:
        motion, state = smoother.run(state, [samples])
        motions.append(motion)
    return [*motions, smoother.rest()]


def _own(trial: Trial, setup: Setup, runs: list[ImuSamples]) -> tuple[Setup, HandFit, Array]:
    """What a course of the same person, in the same donning, found; headings by the quick start.

    And frames by the true functional axes of that course, in the simulator's own.
    """
    asked = Asked(trial.person, trial.seed, trial.imperfections)
    hand, known, course, labels = calibrated_hand(asked)
    functional = functional_frames(subject(trial.person), hand, course, labels)
    setup = calibrated(setup, subject=kept(hand, subject(trial.person, trial.side)), sensors=known)
    setup = _aligned(setup, trial, runs, CALIBRATED)
    return setup, fit_of(setup), functional


def _aligned(
    setup: Setup,
    trial: Trial,
    runs: list[ImuSamples],
    tolerances: Tolerances = UNCALIBRATED,
    labels: Sequence[tuple[float, float, str]] = (),
) -> Setup:
    """Headings by the turn that a recording opens with."""
    names = ImuSamples.__slots__
    opening = ImuSamples(*(np.concatenate([getattr(r, n) for r in runs[:2]]) for n in names))
    if setup.sensors is not None:
        opening = corrected(opening, setup.sensors, setup.layout.names)
    alignment, _ = quick_start(
        opening,
        setup.layout.names,
        labels=labels,
        compass=trial.compass,
        tolerances=tolerances,
    )
    return msgspec.structs.replace(setup, heading_rad=alignment.psi_cor)


def as_it_is(worn: Worn) -> SubjectCalibration:
    """A calibration that found everything: skeleton, mounting and places of the sensors."""
    layout, skeleton = worn.layout, worn.subject.skeleton
    q_sensor_segment = so3.conjugate(worn.mounting.q_segment_sensor)
    segments, centres, axes = [], [], []
    for k, name in enumerate(SEGMENTS):
        sensor, joint = layout.drivers[name], JOINTS[k].name
        place = so3.rotate(q_sensor_segment[sensor], worn.mounting.t_segment_sensor[sensor])
        x = so3.rotate(q_sensor_segment[sensor], np.array([1.0, 0.0, 0.0]))
        segments.append(
            Segment(
                name=name,
                sensor=layout.names[sensor],
                q_sensor_segment=_floats(q_sensor_segment[sensor]),
                q_parent_rest=_floats(skeleton.q_parent_rest[k]),
                t_parent_joint=_floats(skeleton.t_parent_joint[k]),
                sd_m=(0.0, 0.0, 0.0),
                length_m=float(skeleton.length_m[k]),
                length_sd_m=0.0,
                source="measured",
                length_source="measured",
                plausible=0.0,
            )
        )
        nothing = (0.0, 0.0, 0.0)
        known = layout.names[sensor]
        centres.append(
            Centre(joint, known, _floats(place), nothing, nothing, 0.0, (90.0, 0.0), 1.0)
        )
        axes.append(Axis(joint, known, _floats(x), _TRUE_AXIS_SD))
    tips = tuple(
        Tip(finger, _floats(tip), 0.0, "measured")
        for finger, tip in zip(FINGERS, skeleton.t_distal_tip, strict=True)
    )
    return SubjectCalibration(
        "truth", "", "", str(worn.subject.number), skeleton.side, worn.subject.hand_length_m, 3, "",
        tuple(segments), tips, tuple(centres), tuple(axes),
    )  # fmt: skip


_TRUE_AXIS_SD = float(np.deg2rad(1.5))  # people's own axes are not exactly the simulator's x


def _floats(values: Array) -> Any:
    return tuple(float(value) for value in values)


def performance(someone: Subject, motion: str, seed: int) -> Trajectory:
    """The motion of a trial."""
    return perform(motion, Actor(someone, seed, material()))


def compare(followed: Followed, calibration: Calibration) -> Figures:
    """Hold what came out against what was true."""
    part, truth = followed.compared, followed.truth
    fit = followed.fit if calibration == "truth" else followed.own or fit_of(followed.setup)
    motion = _of(followed.motion, part)
    sensors = sensor_errors(
        followed.setup.layout.names, truth.q_world_sensor[part], motion.q_world_sensor
    )
    pose = pose_of(followed.setup, motion.q_world_sensor, fit)
    driven = [SEGMENTS.index(name) for name in followed.setup.layout.drivers]
    q_true, q_got = truth.q_world_segment[part][:, driven], pose.q_world_segment[:, driven]
    names = [SEGMENTS[k] for k in driven]
    segments = _in_degrees(sensor_errors(names, q_true, q_got))
    functional, definition = dict[str, float](), dict[str, float]()
    if followed.q_segment_functional is not None:
        frames = followed.q_segment_functional[driven]
        against = sensor_errors(names, so3.multiply(q_true, frames), q_got)
        functional = {k: v[0] for k, v in _in_degrees(against).items()}
        apart = np.rad2deg(so3.angle_between(frames, so3.IDENTITY))
        definition = dict(zip(names, apart.tolist(), strict=True))
    known = measured_angles(followed.setup.layout)
    columns = [hand_angles().index(angle) for angle in known]
    angles = angle_errors(
        [angle.name for angle in known],
        truth.angles[part][:, columns],
        angles_of(followed.setup, motion, known, fit),
    )
    elbow = truth.t_world_joint[part][:, :1]
    hand = SEGMENTS.index("hand")
    true_points = HandPoints(
        truth.t_world_tip[part] - elbow,
        truth.q_world_segment[part][:, hand],
        truth.t_world_joint[part][:, hand] - elbow[:, 0],
    )
    tips = point_errors(true_points, hand_points(pose))
    on = segment_indices(followed.setup.layout)
    # as if it knew where on the segment a sensor sits: how the hand is off, not the board
    lever = so3.rotate(pose.q_world_segment[:, on], followed.worn.mounting.t_segment_sensor)
    off = pose.t_world_joint[:, on] + lever - (truth.t_world_sensor[part] - elbow)
    places = np.sqrt(np.mean(np.sum(off**2, axis=-1), axis=0)) * 1e3
    return Figures(
        seconds=int(part.sum()) / RATE_HZ,
        heading_offset_deg=float(np.rad2deg(sensors.heading_offset)),
        heading_sd_deg=_scatter(truth, motion, part),
        sensors=_in_degrees(sensors),
        segments={k: v[0] for k, v in segments.items()},
        angles=dict(zip(angles.names, np.rad2deg(angles.rmse).tolist(), strict=True)),
        tips_elbow=tuple(1e3 * x for x in tips.from_elbow),
        tips_hand=tuple(1e3 * x for x in tips.in_hand),
        places_elbow=dict(zip(sensors.names, places.tolist(), strict=True)),
        functional=functional,
        definition=definition,
        inside=inside_two_sd(followed.setup, motion, truth.q_world_sensor[part]),
    )


def _scatter(truth: Truth, motion: pipeline.Motion, part: Array) -> float:
    return float(np.rad2deg(heading_scatter(truth.q_world_sensor[part], motion.q_world_sensor)))


def _in_degrees(found: SensorErrors) -> dict[str, tuple[float, float, float]]:
    return {
        name: tuple(float(np.rad2deg(x)) for x in (e.total, e.heading, e.inclination))  # type: ignore[misc]
        for name, e in zip(found.names, found.errors, strict=True)
    }


def _begins_s(performed: Trajectory) -> float:
    """When comparing begins: after the turn every recording opens with, or its first rest."""
    turns = [span.end_s for span in performed.spans if span.name == "heading_rotation"]
    return min(turns) if turns else _SETTLED_S


def _of(motion: pipeline.Motion, part: Array) -> pipeline.Motion:
    return pipeline.Motion(*(getattr(motion, name)[part] for name in pipeline.Motion.__slots__))


def _joined(truths: list[Truth]) -> Truth:
    return Truth(*(np.concatenate([getattr(t, name) for t in truths]) for name in Truth.__slots__))
