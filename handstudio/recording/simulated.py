"""Takes of a virtual glove, written without waiting, with the truth in a file beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.hand.skeleton import ADULT_HAND_LENGTH_M, HandSide
from handstudio.health.record import TakeHealth
from handstudio.health.watch import Watch
from handstudio.layout import glove
from handstudio.protocol.codec import encode
from handstudio.protocol.packets import (
    Command,
    Description,
    Request,
)
from handstudio.recording.header import Header, Summary
from handstudio.recording.library import new_take_path
from handstudio.recording.material import material
from handstudio.recording.notes import Label, Notes, save_notes
from handstudio.recording.truth import TruthFile, save_truth
from handstudio.recording.writer import TakeWriter
from handstudio.setup import HandModel, Setup, for_device
from handstudio.simulation.firmware import RATES_HZ, Firmware, Readings
from handstudio.simulation.glove import Wire, description
from handstudio.simulation.imperfections.strengths import PLAIN, Imperfections, tell
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.rig import Truth
from handstudio.simulation.subject import Subject, ideal_subject
from handstudio.simulation.subject import subject as virtual_subject
from handstudio.simulation.things import things_held
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.worn import Worn, begin, sense, wear
from handstudio.stream import EventStream

_STEP_US = 100_000  # of the glove's time in one chunk
_READ_AHEAD = 1000  # instants
_LONGEST_OTHER = 300  # bytes: of this glove's frames only those with an instant are longer
_ROOM = 1 << 24  # bytes: an offline line drops nothing


@dataclass(frozen=True, slots=True, eq=False)
class Rehearsed:
    """All that decides a simulated take: who, doing what, with which glove."""

    subject: Subject
    motion: str
    trajectory: Trajectory
    worn: Worn
    imperfections: Imperfections
    seed: int


def rehearse(
    person: int = 0,
    motion: str = "showcase",
    imperfections: Imperfections = PLAIN,
    seed: int = 0,
    *,
    side: HandSide = "right",
    hand_length_m: float | None = None,
) -> Rehearsed:
    """Put a glove on somebody who knows what to do.

    Args:
        person: Number of a virtual subject; 0 is the ideal one.
        motion: In the language of motions.
        imperfections: Of sensors, skin and room.
        seed: Of this performance, this donning, this noise.
        side: Which hand.
        hand_length_m: Of the ideal subject; others have their own.

    Raises:
        SetupError: these are no motions, or this person cannot do them.
    """
    if person == 0:
        subject = ideal_subject(side, hand_length_m or ADULT_HAND_LENGTH_M)
    else:
        subject = virtual_subject(person, side)
    trajectory = perform(motion, Actor(subject, seed, material()))
    worn = wear(subject, glove(side), imperfections, seed)
    return Rehearsed(subject, motion, trajectory, worn, imperfections, seed)


def simulate(
    sessions: Path,
    rehearsed: Rehearsed | None = None,
    *,
    seconds: float | None = None,
    rate_hz: int = 100,
    code: str = "",
    name: str = "",
    start: datetime | None = None,
    health: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> Path:
    """Write a take, its truth and its labels.

    Args:
        sessions: Folder of the takes.
        rehearsed: What happens; the ideal subject's showcase unless told.
        seconds: How long; as long as the motion lasts unless told.
        rate_hz: Samples a second.
        code: Of the subject; ``virtual-NUMBER`` unless told.
        name: Of the take; as the motion unless told.
        start: When it begins; now unless told. The same rehearsal, start and name give the same
            file to the last bit.
        health: Keep the health of stream and sensors with the take, at half the speed; unless told
            it is computed when somebody asks for it.
        progress: Told the share that is done.

    Raises:
        SetupError: no glove has this rate, or there is no time to simulate.
        TakeError: the take cannot be written.
    """
    rehearsed = rehearsed or rehearse()
    trajectory = rehearsed.trajectory
    seconds = trajectory.duration_s if seconds is None else seconds
    _refuse(seconds, rate_hz)
    subject = rehearsed.subject
    told = described(subject, rehearsed.seed, rate_hz, rehearsed.seed + 1)
    start = (start or datetime.now(UTC)).astimezone(UTC)
    code = code or f"virtual-{subject.number}"
    path = new_take_path(sessions, code, name or rehearsed.motion, start)
    setup = for_device(told, "handstudio-1", HandModel(hand_length_m=subject.hand_length_m))
    start_ns = int(start.timestamp() * 1e9)
    writer = TakeWriter(path, Header(path.stem, code, start_ns, setup, "wire", "simulated"))
    try:
        heard = _Listener(setup) if health else None
        way = _Way(Wire(rehearsed.imperfections, rehearsed.seed))
        truths = _write(writer, told, rehearsed, seconds, way=way, heard=heard, progress=progress)
        save_truth(path, _truth_file(rehearsed, setup, truths, seconds))
        counts = way.packets, way.missing, way.damaged
        writer.close(Summary(0, 0, seconds, *counts, health=heard.health() if heard else None))
    except BaseException:
        writer.discard()  # it can be simulated again
        raise
    labels = tuple(
        Label(float(span.start_s), float(min(span.end_s, seconds)), span.name)
        for span in sorted(trajectory.spans, key=lambda span: span.start_s)
        if span.start_s < seconds
    )
    if labels:
        save_notes(path, Notes(labels=labels))
    return path


def described(subject: Subject, seed: int, rate_hz: int, epoch: int) -> Description:
    """How a virtual glove on this person describes itself."""
    length_mm = subject.hand_length_m * 1e3
    name = f"Virtual glove on person {subject.number}, hand {length_mm:.0f} mm"
    return description(
        subject.side, seed, rate_hz, epoch, name if subject.number else "Virtual glove"
    )


class _Way:
    """The way from device to host: counts what arrives."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self.packets = self.missing = self.damaged = 0

    def carry(self, frame: bytes) -> bytes:
        """What arrives of a frame."""
        arrived = self._wire.carry(frame)
        if len(frame) > _LONGEST_OTHER:
            self.packets += arrived == frame
            self.missing += arrived != frame
            self.damaged += arrived not in (frame, b"")
        return arrived


class _Listener:
    """Watches what a host would have watched, for the health of the take."""

    def __init__(self, setup: Setup) -> None:
        self._stream, self._watch = EventStream("handstudio-1", setup.ranges), Watch()
        self._watch.begin(setup)
        self._watch.begin_take()

    def hear(self, arrival_ns: int, chunk: bytes) -> None:
        """Decode what came."""
        packets, events = self._stream.feed(chunk, arrival_ns)
        self._watch.note(packets, events, arrival_ns)

    def health(self) -> TakeHealth | None:
        """Of the whole take."""
        return self._watch.end_take()


def _refuse(seconds: float, rate_hz: int) -> None:
    if rate_hz not in RATES_HZ:
        rates = ", ".join(str(rate) for rate in RATES_HZ)
        raise SetupError(
            "No virtual glove has a rate of {rate} Hz.",
            "Choose one of {rates}.",
            rate=rate_hz,
            rates=rates,
        )
    if not seconds > 0.0:
        raise SetupError(
            "A take of {seconds:g} s holds nothing.", "Choose more than 0 s.", seconds=seconds
        )


def _write(
    writer: TakeWriter,
    told: Description,
    rehearsed: Rehearsed,
    seconds: float,
    *,
    way: _Way,
    heard: _Listener | None,
    progress: Callable[[float], None],
) -> list[Truth]:
    """Let the glove perform; returns what was true."""
    truths: list[Truth] = []
    state = begin(rehearsed.worn)

    def read(time_us: Array, rate_hz: int) -> Readings:
        nonlocal state
        sensed, state = sense(rehearsed.worn, state, rehearsed.trajectory, time_us, rate_hz)
        truths.append(sensed.truth)
        return Readings(sensed.counts, sensed.fresh, sensed.answering, sensed.celsius[-1])

    device = Firmware(told, read, _ROOM, wire=way.carry, read_ahead=_READ_AHEAD)
    began_ns = writer.start_utc_ns
    device.receive(encode(Request(Command.START, 0)))
    end_us = round(seconds * 1e6)
    for now_us in range(0, end_us + _STEP_US, _STEP_US):
        device.advance(min(now_us, end_us))
        chunk = device.outgoing
        device.taken(len(chunk))
        if chunk:
            arrival_ns = began_ns + min(now_us, end_us) * 1000
            writer.write(arrival_ns, chunk)
            writer.flush()  # by itself it also does by the clock, and then files would differ
            if heard is not None:
                heard.hear(arrival_ns, chunk)
        progress(min(now_us / end_us, 1.0))
    return truths


def _truth_file(
    rehearsed: Rehearsed, setup: Setup, truths: list[Truth], seconds: float
) -> TruthFile:
    time_us = np.concatenate([truth.time_us for truth in truths])
    count = int(np.searchsorted(time_us, round(seconds * 1e6), side="right"))

    def whole(name: str) -> Array:
        return np.concatenate([getattr(truth, name) for truth in truths])[:count]

    q_world_segment, t_world_joint = whole("q_world_segment"), whole("t_world_joint")
    held = things_held(rehearsed.trajectory, time_us[:count], q_world_segment, t_world_joint)
    subject, mounting = rehearsed.subject, rehearsed.worn.mounting
    skeleton, mechanism = subject.skeleton, subject.mechanism
    facts = {
        "person": subject.number,
        "side": subject.side,
        "hand_length_m": subject.hand_length_m,
        "motion": rehearsed.motion,
        "imperfections": tell(rehearsed.imperfections),
        "seed": rehearsed.seed,
        "held": held.told,
    }
    return TruthFile(
        time_us=time_us[:count],
        sensors=setup.layout.names,
        q_world_segment=q_world_segment,
        q_world_sensor=whole("q_world_sensor"),
        t_world_joint=t_world_joint,
        t_world_sensor=whole("t_world_sensor"),
        t_world_tip=whole("t_world_tip"),
        angles=whole("angles"),
        q_world_start=rehearsed.worn.world.q_world_start,
        t_parent_joint=skeleton.t_parent_joint,
        q_parent_rest=skeleton.q_parent_rest,
        t_distal_tip=skeleton.t_distal_tip,
        q_segment_sensor=mounting.q_segment_sensor,
        t_segment_sensor=mounting.t_segment_sensor,
        axes=mechanism.axes,
        points=mechanism.points,
        q_world_held=held.q_world_held,
        t_world_held=held.t_world_held,
        pen_down=held.pen_down,
        facts=msgspec.json.encode(facts).decode(),
    )
