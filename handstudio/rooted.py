"""A hand's place and heading in a tracker's room, where a take has the track of a terminal.

The track says where one sensor of the glove was; the inertial motion says the rest. Both are held
together by `trackers.late_root`: its filter goes through the take instant by instant, so that
cutting it anywhere changes no digit. What comes out is kept beside the take's motion. A track that
lies beside the take counts before one that was recorded with it.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from zipfile import BadZipFile

import msgspec
import numpy as np
from jaxtyping import Float, Int64, UInt8

from handstudio import __version__
from handstudio.arrays import Array
from handstudio.calibration.device import corrected
from handstudio.errors import CalibrationError, HandstudioError, TrackError
from handstudio.hand.pose import Pose, moved
from handstudio.hand.skeleton import SEGMENTS
from handstudio.hand_fit import mechanism_of
from handstudio.kinematics import pose_of
from handstudio.maths import so3
from handstudio.pipeline import Motion
from handstudio.recorded_track import recorded_track
from handstudio.recording.take import Take
from handstudio.recording.take_track import (
    KeptTrack,
    TrackFacts,
    load_track,
    track_hash,
    track_path,
)
from handstudio.setup import Setup
from handstudio.terminal import AGAIN_S, attitudes, best_sensor, filter_of, in_time, tells
from handstudio.trackers import late_root
from handstudio.trackers.late_align import align
from handstudio.trackers.late_root import Felt
from handstudio.trackers.track import Track

WITHIN_S = 10.0
"""How far a tracker's clock may begin from the take's first instant, unless told."""

BELIEVED_SD_M = 0.05
"""A place that is known worse is none."""

TOLD_S = (-0.5, 1.5)
"""How late what comes along with the bytes may be: the clock is the host's."""

_STEP = 2048


@dataclass(frozen=True, slots=True, eq=False)
class Root:
    """Where the elbow is in the room, and how the inertial world lies in it; NaN where unknown.

    Attributes:
        time_us: Of the motion's instants.
        t_room_elbow: [m].
        q_room_world: What takes the motion's attitudes into the room.
        sd_m: How sure the place of the sensor is, along one axis.
        fates: What was done with every pose (`trackers.late_faults.Fate`).
        sensor: The sensor the terminal sits on.
        facts: What is known of the track.
        pose_us: When the poses were.
    """

    time_us: Int64[Array, " n"]
    t_room_elbow: Float[Array, "n 3"]
    q_room_world: Float[Array, "n 4"]
    sd_m: Float[Array, " n"]
    fates: UInt8[Array, " m"]
    sensor: str
    facts: TrackFacts
    pose_us: Int64[Array, " m"]

    def placing(self, pose: Pose, time_us: Int64[Array, " n"]) -> Pose:
        """A pose of instants of the motion, moved into the room; NaN where that is not known."""
        at = np.searchsorted(self.time_us, time_us)
        return moved(pose, self.q_room_world[at], self.t_room_elbow[at])


def aligned_track(
    take: Take,
    motion: Motion,
    track: Track,
    source: str,
    *,
    sensor: str | None = None,
    lever_m: tuple[float, float, float] | None = None,
    within_s: float = WITHIN_S,
) -> KeptTrack:
    """A track on a take's clock, with the sensor it sits on.

    Args:
        take: The recording.
        motion: Its motion by its own setup.
        track: Of one terminal, its times from about the take's first instant.
        source: Name of the file it came from.
        sensor: The one it sits on; None: the one whose attitude stays with it best.
        lever_m: Where it sits in that sensor's axes; None: found from the motion, which takes some
            fast movements.
        within_s: How far the two clocks may be apart.

    Raises:
        CalibrationError: it turns as no sensor does, or as another than the one that was named; or
            too little was seen of it.
    """
    track = replace(track, time_us=track.time_us + motion.time_us[0])
    search_s = -within_s, within_s
    return _aligned(
        take,
        take.header.setup,
        motion,
        track,
        source=source,
        sensor=sensor,
        lever_m=lever_m,
        search_s=search_s,
    )


def _aligned(
    take: Take,
    setup: Setup,
    motion: Motion,
    track: Track,
    *,
    source: str,
    sensor: str | None,
    lever_m: tuple[float, float, float] | None,
    search_s: tuple[float, float],
) -> KeptTrack:
    names = setup.layout.names
    if sensor is not None and sensor not in names:
        raise CalibrationError(
            "There is no sensor {sensor}.",
            "Choose one of: {known}.",
            sensor=sensor,
            known=", ".join(names),
        )
    found, best = best_sensor(setup, motion, track, sensor, search_s)
    offset_us = round(found.delay_s * 1e6)
    track = replace(track, time_us=track.time_us - offset_us)
    sd = 0.0
    if lever_m is None:
        filter = filter_of(replace(found, delay_s=0.0), None)
        felt = _felt(take, setup, motion, names.index(best))
        _placed, state = late_root.run(filter, late_root.begin(filter), felt, track)
        lever_m = tuple(state.lever.tolist())
        sd = float(np.sqrt(np.trace(state.p[late_root.LEVER, late_root.LEVER]) / 3.0))
    facts = TrackFacts(
        terminal=track.name,
        source=source,
        sensor=best,
        t_sensor_terminal=lever_m,
        lever_source="measured" if sd == 0.0 else "found",
        lever_sd_m=sd,
        offset_s=found.delay_s,
        correlation=found.correlation,
        residual_rad=found.residual_rad,
    )
    return KeptTrack(track, facts)


def root_of(take: Take, setup: Setup, motion: Motion) -> Root | None:
    """Where the hand was in the room.

    None of a take without a track, or without a hand; and where the track that was recorded with
    it cannot be aligned: `root_or_why` says why. Computed once, then found beside the motion.

    Args:
        take: The recording.
        setup: What the motion was computed by.
        motion: All of it.

    Raises:
        TakeError: the take or its track cannot be read.
        TrackError: the track beside it is not of this glove's layout.
        CalibrationError: by this setup the track beside it cannot be aligned.
    """
    found = root_or_why(take, setup, motion)
    if isinstance(found, HandstudioError) and track_path(take.path).exists():
        raise found  # somebody added it, and waits for it
    return found if isinstance(found, Root) else None


def root_or_why(take: Take, setup: Setup, motion: Motion) -> Root | HandstudioError | None:
    """As `root_of`; where a track cannot be aligned, why.

    Raises:
        TakeError: the take or its track cannot be read.
    """
    key = track_key(take, setup)
    if key is None:
        return None
    path = _place(take, setup, motion, key)
    root = _opened(path, motion)
    if root is None:
        try:
            kept = load_track(take.path) or _as_recorded(take, setup, motion)
            root = _computed(take, setup, motion, kept)
        except (CalibrationError, TrackError) as error:
            root = error
        with suppress(OSError):  # it can be computed again
            _keep(path, root)
    return root


def track_key(take: Take, setup: Setup) -> str | None:
    """What tells the track of a take from another one; None: it has none, or no hand.

    One that was added beside the take goes before the one that was recorded with it.
    """
    if not setup.layout.is_hand:
        return None
    if track_path(take.path).exists():
        return track_hash(take.path)
    return None if take.header.tracker is None else "recorded"


def _as_recorded(take: Take, setup: Setup, motion: Motion) -> KeptTrack:
    """The track that was recorded with a take, aligned by a setup."""
    facts, track = take.header.tracker, recorded_track(take, motion.time_us)
    assert facts is not None  # or nobody asks
    assert track is not None
    return _aligned(
        take,
        setup,
        motion,
        track,
        source=facts.source,
        sensor=facts.sensor or None,
        lever_m=facts.lever_m,
        search_s=TOLD_S,
    )


def _computed(take: Take, setup: Setup, motion: Motion, kept: KeptTrack) -> Root:
    names = setup.layout.names
    if kept.facts.sensor not in names:
        raise TrackError(
            "The track sits on {sensor}, which this glove has not.",
            "Add the track again: handstudio add-track.",
            sensor=kept.facts.sensor,
        )
    k = names.index(kept.facts.sensor)
    found = align(*attitudes(setup, motion, k), kept.track, AGAIN_S)
    filter = filter_of(found, kept.facts.t_sensor_terminal)
    felt = _felt(take, setup, motion, k)
    placed, _ = late_root.run(filter, late_root.begin(filter), felt, kept.track)
    believed = placed.sd_m <= BELIEVED_SD_M
    q_room_world = np.where(believed[:, None], placed.q_room_world, np.nan)
    t_room_sensor = np.where(believed[:, None], placed.t_room_sensor, np.nan)
    t_room_elbow = np.concatenate(
        [
            elbow_of(setup, motion[at : at + _STEP], k, t_room_sensor[at:][:_STEP], q_at)
            for at in range(0, len(motion), _STEP)
            for q_at in [q_room_world[at : at + _STEP]]
        ]
        or [np.zeros((0, 3))]
    )
    return Root(
        np.array(motion.time_us),
        t_room_elbow,
        q_room_world,
        placed.sd_m,
        placed.fates,
        kept.facts.sensor,
        kept.facts,
        kept.track.time_us[: len(placed.fates)],
    )


def elbow_of(
    setup: Setup, motion: Motion, k: int, t_room_sensor: Array, q_room_world: Array
) -> Array:
    """From a sensor to its segment's joint, and from there along the bones."""
    q_room_sensor = so3.multiply(q_room_world, motion.q_world_sensor[:, k])
    t_sensor_joint = mechanism_of(setup).t_sensor_joint[k]
    t_room_joint = t_room_sensor + so3.rotate(q_room_sensor, t_sensor_joint)
    segment = SEGMENTS.index(setup.layout.sensors[k].segment)
    t_world_joint = pose_of(setup, motion.q_world_sensor).t_world_joint[:, segment]
    return np.asarray(t_room_joint - so3.rotate(q_room_world, t_world_joint))


def _felt(take: Take, setup: Setup, motion: Motion, k: int) -> Felt:
    """What the sensor felt, instant by instant of the motion."""
    acc = [np.zeros((0, 3))]
    for run in take.runs():
        sound = run if setup.sensors is None else corrected(run, setup.sensors, setup.layout.names)
        acc.append(sound.acc[:, k])
    time_us, q = np.array(motion.time_us), in_time(setup, motion.q_world_sensor[:, k])
    return Felt(time_us, q, np.concatenate(acc), tells(motion, k))


def _place(take: Take, setup: Setup, motion: Motion, track: str) -> Path:
    parts = f"{take.sha256()} {setup.key} {__version__} {track} {len(motion)}"
    key = hashlib.sha256(parts.encode()).hexdigest()[:16]
    return take.path.with_suffix(".motion") / f"root-{key}.npz"


def _keep(path: Path, root: Root | HandstudioError) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(path.name + ".new")
    with fresh.open("wb") as file:
        if isinstance(root, HandstudioError):
            np.savez(file, why=np.array([root.what, root.remedy]))
        else:
            np.savez(
                file,
                t_room_elbow=root.t_room_elbow,
                q_room_world=root.q_room_world,
                sd_m=root.sd_m,
                fates=root.fates,
                facts=np.array(msgspec.json.encode(root.facts).decode()),
                pose_us=root.pose_us,
            )
    fresh.replace(path)


def _opened(path: Path, motion: Motion) -> Root | HandstudioError | None:
    try:
        with path.open("rb") as stream, np.load(stream) as file:
            if "why" in file:
                what, remedy = map(str, file["why"])
                return CalibrationError("{what}", "{remedy}", what=what, remedy=remedy)
            facts = msgspec.json.decode(str(file["facts"]), type=TrackFacts)
            return Root(
                np.array(motion.time_us),
                file["t_room_elbow"],
                file["q_room_world"],
                file["sd_m"],
                file["fates"],
                facts.sensor,
                facts,
                file["pose_us"],
            )
    except (OSError, KeyError, ValueError, EOFError, BadZipFile, msgspec.MsgspecError):
        return None
