"""Takes of a virtual glove, written without waiting, with the truth in a file beside them.

The truth never reaches the pipeline: comparisons read it, nothing else does.
"""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from handstudio.errors import SetupError
from handstudio.hand.skeleton import HandSide
from handstudio.health.record import TakeHealth
from handstudio.health.watch import Watch
from handstudio.layout import glove
from handstudio.protocol.codec import encode
from handstudio.protocol.packets import Command, ImuPacket, Request
from handstudio.recording.header import Header, Summary
from handstudio.recording.library import new_take_path
from handstudio.recording.writer import TakeWriter
from handstudio.setup import HandModel, Setup, for_device
from handstudio.simulation.firmware import RATES_HZ, Firmware
from handstudio.simulation.glove import WornGlove, description
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject
from handstudio.stream import EventStream

_STEP_US = 50_000  # of the glove's time in one chunk
_ROOM = 1 << 24  # bytes: an offline line drops nothing


def simulate(
    sessions: Path,
    *,
    seconds: float,
    rate_hz: int = 100,
    seed: int = 0,
    side: HandSide = "right",
    hand: HandModel | None = None,
    subject: str = "virtual",
    name: str = "showcase",
) -> Path:
    """Write a take of the showcase, and its truth.

    Raises:
        SetupError: no glove has this rate, or there is no time to simulate.
        TakeError: the take cannot be written.
    """
    _refuse(seconds, rate_hz)
    hand = hand or HandModel()
    told = description(side, seed, rate_hz, epoch=seed + 1, name="Virtual glove")
    start = datetime.now(UTC)
    start_ns = int(start.timestamp() * 1e9)
    path = new_take_path(sessions, subject, name, start)
    setup = for_device(told, "handstudio-1", hand)
    worn = WornGlove(side, seed, hand.hand_length_m)
    writer = TakeWriter(path, Header(path.stem, subject, start_ns, setup, "wire", "simulated"))
    try:
        clocks, health = _write(writer, Firmware(told, worn.read, _ROOM), setup, seconds, start_ns)
        count = len(clocks)
        writer.close(Summary(writer.chunks, writer.bytes, seconds, packets=count, health=health))
    finally:
        writer.abandon()
    _save_truth(path, side, hand.hand_length_m, clocks)
    return path


def truth_path(take: Path) -> Path:
    """Where the truth of a simulated take lives."""
    return take.with_suffix(".truth.npz")


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
    writer: TakeWriter, glove: Firmware, setup: Setup, seconds: float, start_ns: int
) -> tuple[np.ndarray, TakeHealth | None]:
    """Let the glove perform; returns the device clock of every instant [µs], and the health."""
    stream, clocks, watch = EventStream("handstudio-1", setup.ranges), list[int](), Watch()
    watch.begin(setup)
    watch.begin_take()
    glove.receive(encode(Request(Command.START, 0)))
    for now_us in range(0, round(seconds * 1e6) + 1, _STEP_US):
        glove.advance(now_us)
        chunk = bytes(glove.outgoing)
        glove.taken(len(chunk))
        if chunk:
            arrival_ns = start_ns + now_us * 1000
            writer.write(arrival_ns, chunk)
            packets, events = stream.feed(chunk, arrival_ns)
            watch.note(packets, events, arrival_ns)
            clocks += [packet.clock_us for packet in packets if isinstance(packet, ImuPacket)]
    return np.array(clocks, dtype=np.int64), watch.end_take()


def _save_truth(path: Path, side: HandSide, hand_length_m: float, clocks: np.ndarray) -> None:
    layout, subject = glove(side), ideal_subject(side, hand_length_m)
    _, truth = signals(subject, layout, showcase(side), clocks - clocks[0])
    np.savez_compressed(
        truth_path(path),
        time_us=clocks,
        sensors=np.array(layout.names),
        q_world_sensor=truth.q_world_sensor,
        q_world_segment=truth.q_world_segment,
        t_world_joint=truth.t_world_joint,
        t_world_tip=truth.t_world_tip,
        angles=truth.angles,
    )
