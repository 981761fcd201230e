"""A virtual person with a tracker, in the real studio's threads: where the hand is, against truth.

    python -m benchmarks.live_tracker --json FILE

The virtual glove's process streams its bytes and, by the Lab Streaming Layer, a terminal's poses:
60 Hz, 50 ms late, 1 mm and 0.15 degrees. Both are recorded and followed as they come, in real time,
a minute and a half a person; then the take is processed. Hand and mounting are known, sensors not
calibrated; the lever to the terminal is told. Needs the extra ``trackers``.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any
from urllib.parse import urlencode

import numpy as np
import tyro

from benchmarks.trials import as_it_is
from handstudio.arrays import Array
from handstudio.device.capture import Capture
from handstudio.device.following import RootNow
from handstudio.device.live_tracker import LiveTracker
from handstudio.device.orders import (
    Connect,
    Disconnect,
    Phase,
    SetFilter,
    SetSubject,
    StartTake,
    StopTake,
)
from handstudio.device.tracker import TrackerPhase
from handstudio.hand.skeleton import SEGMENTS
from handstudio.kinematics import pose_of
from handstudio.maths import so3
from handstudio.process import process
from handstudio.protocol.packets import ImuPacket
from handstudio.recording.library import new_take_path
from handstudio.recording.simulated import Rehearsed, rehearse
from handstudio.recording.take import Take, open_take
from handstudio.recording.tracker_message import TrackerFacts
from handstudio.rooted import Root, root_or_why
from handstudio.setup import HandModel, filter_named
from handstudio.shell import out, print_table
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.rig import Truth
from handstudio.simulation.streamed import LEVER_M, standing_of
from handstudio.simulation.subject import DEVELOPMENT, REPORTING
from handstudio.simulation.worn import begin, sense

MOTION = "quick_start+ball_throw~slow&elbow_moving:all 60+tissue"
"""The hand goes at up to two metres a second in it."""

RATE_HZ = 100
_PERIOD_US = 1_000_000 // RATE_HZ
_SETTLED_S = 5.0
_WAIT_S = 30.0


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """What came of one recording."""

    take: Path
    places: list[RootNow]
    latency_p99_ms: float


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    people: int = 2,
    seconds: float = 80.0,
    development: bool = False,
    lever: bool = True,
    imperfections: str = "typical",
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        people: How many.
        seconds: Of each recording.
        development: People and seeds that parameters may be chosen on, not those reported.
        lever: Tell where the terminal sits; else it is found.
        imperfections: Of sensors, skin and room.
    """
    found: dict[str, Any] = {}
    for segment in ("hand", "forearm"):
        each = []
        for number in (DEVELOPMENT if development else REPORTING)[:people]:
            seed = number if development else 10_000 + number
            rehearsed = rehearse(number, MOTION, parse(imperfections), seed)
            with TemporaryDirectory() as folder:
                got = record(
                    rehearsed,
                    segment,
                    Path(folder),
                    seconds=seconds,
                    imperfections=imperfections,
                    lever=lever,
                )
                each.append({"person": number, **compare(rehearsed, segment, got)})
            out.print(json.dumps(each[-1]))
        keys = [key for key in each[0] if key.endswith("_mm")]
        rms = {k: float(np.sqrt(np.mean([one[k] ** 2 for one in each]))) for k in keys}
        found[segment] = {**rms, "people": each}
    rows = [[name, *(f"{found[name][k]:.2f}" for k in keys)] for name in found]
    print_table("RMS over people, mm", ["tracker on", *keys], rows)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2), encoding="utf-8")


def record(
    rehearsed: Rehearsed,
    segment: str,
    sessions: Path,
    *,
    seconds: float,
    imperfections: str = "typical",
    lever: bool = True,
) -> Recorded:
    """Record from the glove's own process, and follow as it comes."""
    stream = f"handstudio benchmark {rehearsed.seed} {segment}"
    options = {
        "subject": rehearsed.subject.number,
        "motion": MOTION,
        "imperfections": imperfections,
        "seed": rehearsed.seed,
        "tracker": segment,
        "tracker-name": stream,
    }
    path = new_take_path(sessions, "bench", segment, datetime.now(UTC))
    sensor = rehearsed.worn.layout.names[rehearsed.worn.layout.drivers[segment]]
    capture = Capture()
    facts = TrackerFacts(f"lsl:{stream}", segment, sensor, LEVER_M if lever else None)
    tracker = LiveTracker(facts, capture)
    capture.start()
    tracker.start()
    try:
        capture.send(SetSubject(as_it_is(rehearsed.worn)))
        capture.send(SetFilter(filter_named("tree")))
        hand = HandModel(hand_length_m=rehearsed.subject.hand_length_m)
        capture.send(Connect(f"virtual:?{urlencode(options)}", hand))
        _wait(lambda: capture.newest.phase is Phase.STREAMING, capture)
        _wait(lambda: tracker.newest.tracker.phase is TrackerPhase.STREAMING, capture)
        capture.send(StartTake(path, "bench"))
        places = list[RootNow]()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            time.sleep(0.1)
            places += tracker.drain()
        latency = capture.newest.health.latency_p99_ms
        capture.send(StopTake())
        time.sleep(0.5)
        capture.send(Disconnect())
    finally:
        tracker.end()
        capture.stop()
        tracker.join()
    return Recorded(path, places, latency)


def _wait(for_it: Any, capture: Capture) -> None:
    end = time.monotonic() + _WAIT_S
    while not for_it():
        if time.monotonic() > end:
            raise capture.newest.problem or TimeoutError("glove or tracker did not come")
        time.sleep(0.02)


def compare(rehearsed: Rehearsed, segment: str, got: Recorded) -> dict[str, Any]:
    """RMS [mm] of the joint the segment begins at, live and of the processed take."""
    take = open_take(got.take)
    setup, motion = take.header.setup, process(take)
    since_us = motion.time_us - began_us(take)
    truth = _truth(rehearsed, int(since_us[-1]) + _PERIOD_US)
    standing = standing_of(rehearsed.seed)
    joint = SEGMENTS.index(segment)
    at = np.rint(since_us / _PERIOD_US).astype(np.int64)
    true = standing.t_room_world + so3.rotate(standing.q_room_world, truth.t_world_joint[at, joint])
    root = root_or_why(take, setup, motion)
    if not isinstance(root, Root):
        raise root or ValueError("a take without a track")
    t_world_joint = pose_of(setup, motion.q_world_sensor).t_world_joint[:, joint]
    batch = root.t_room_elbow + so3.rotate(root.q_room_world, t_world_joint)
    settled = motion.time_us > motion.time_us[0] + _SETTLED_S * 1e6
    off = np.linalg.norm(batch - true, axis=-1)[settled]
    places = [
        p for p in got.places if p.time_us >= motion.time_us[0] and p.t_room_elbow is not None
    ]
    found_s = (places[0].time_us - motion.time_us[0]) * 1e-6
    k = np.searchsorted(motion.time_us, [p.time_us for p in places])
    q = np.array([p.q_room_world for p in places])
    live = np.array([p.t_room_elbow for p in places]) + so3.rotate(q, t_world_joint[k])
    later = motion.time_us[k] > motion.time_us[k[0]] + _SETTLED_S * 1e6
    live_off = np.linalg.norm(live - true[k], axis=-1)[later]
    speed = np.linalg.norm(np.gradient(true, _PERIOD_US * 1e-6, axis=0), axis=-1)
    return {
        "live_mm": _rms(1e3 * live_off),
        "take_mm": _rms(1e3 * off),
        "live_p95_mm": float(1e3 * np.percentile(live_off, 95)),
        "take_known": float(np.isfinite(off).mean()),
        "found_after_s": float(found_s),
        "places_a_second": len(places) / float(np.ptp(motion.time_us[k]) * 1e-6),
        "delay_ms": 1e3 * root.facts.offset_s,
        "lever_off_mm": 1e3
        * float(np.linalg.norm(np.subtract(root.facts.t_sensor_terminal, LEVER_M))),
        "joint_fastest_m_s": float(speed[settled].max()),
        "latency_p99_ms": got.latency_p99_ms,
    }


def began_us(take: Take) -> int:
    """When the glove was started, on its own clock: its instants are numbered."""
    for _arrival, packets, _events in take.decoded():
        for packet in packets:
            if isinstance(packet, ImuPacket):
                return packet.clock_us - packet.sequence * _PERIOD_US
    raise ValueError("no instant is in the take")


def _truth(rehearsed: Rehearsed, until_us: int) -> Truth:
    parts, state = [], begin(rehearsed.worn)
    for first in range(0, until_us + 1, 1000 * _PERIOD_US):
        time_us = np.arange(first, min(first + 1000 * _PERIOD_US, until_us + 1), _PERIOD_US)
        sensed, state = sense(rehearsed.worn, state, rehearsed.trajectory, time_us, RATE_HZ)
        parts.append(sensed.truth)
    return Truth(*(np.concatenate([getattr(p, n) for p in parts]) for n in Truth.__slots__))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(np.square(values))))


if __name__ == "__main__":
    tyro.cli(main)
