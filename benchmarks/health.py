"""What watching the health of a stream costs, against fusing the same chunks.

    python -m benchmarks.health --rate 1000 --seconds 30

A virtual glove, without a line: its bytes in chunks as a line would give them, decoded, fused and
watched one after the other, a take being recorded. Times of this machine; the ratio is the figure.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import tyro

from handstudio import pipeline
from handstudio.arrays import Array
from handstudio.health.watch import Watch
from handstudio.protocol.codec import encode
from handstudio.protocol.packets import Command, Description, Request
from handstudio.samples import Ranges
from handstudio.setup import for_device
from handstudio.shell import out
from handstudio.simulation.firmware import Firmware
from handstudio.simulation.glove import description, plain_glove
from handstudio.stream import EventStream

_ROOM = 1 << 24
_PACE_US = 4000  # as the capture reads


def main(rate: int = 1000, seconds: float = 30.0, seed: int = 0) -> None:
    """Print both costs a chunk, and their ratio.

    Args:
        rate: Samples a second.
        seconds: Of the glove's time.
        seed: Which glove.
    """
    told = description("right", seed, rate, epoch=1, name="Virtual glove")
    setup = for_device(told, "handstudio-1")
    stream, state, watch = (
        EventStream("handstudio-1", Ranges.of(told)),
        pipeline.begin(setup),
        Watch(),
    )
    watch.begin(setup)
    watch.begin_take()
    took: list[tuple[float, float]] = []
    for arrival_ns, chunk in _chunks(told, seed, seconds):
        packets, events = stream.feed(chunk, arrival_ns)
        began = time.perf_counter()
        _, state = pipeline.run(setup, state, events)
        fused = time.perf_counter()
        watch.note(packets, events, arrival_ns)
        watch.note_latency(1.0)
        took.append((fused - began, time.perf_counter() - fused))
    fusing, watching = 1e6 * np.array(took).T
    out.print(f"{len(took)} chunks of {rate} Hz, {len(told.sensors)} sensors")
    _tell("pipeline.run", fusing)
    _tell("watch", watching)
    out.print(f"watch / pipeline.run: {watching.sum() / fusing.sum():.3f}")


def _tell(what: str, took_us: Array) -> None:
    half, most = np.percentile(took_us, [50, 99])
    out.print(
        f"{what:14} mean {took_us.mean():6.0f} us, 50 % {half:6.0f}, 99 % {most:6.0f}, "
        f"longest {took_us.max():6.0f}"
    )


def _chunks(told: Description, seed: int, seconds: float) -> Iterator[tuple[int, bytes]]:
    glove = Firmware(told, plain_glove("right", seed).read, _ROOM)
    glove.receive(encode(Request(Command.START, 0)))
    for now_us in range(0, round(seconds * 1e6) + 1, max(_PACE_US, 1_000_000 // told.rate_hz)):
        glove.advance(now_us)
        chunk = bytes(glove.outgoing)
        glove.taken(len(chunk))
        if chunk:
            yield 10**18 + now_us * 1000, chunk


if __name__ == "__main__":
    tyro.cli(main)
