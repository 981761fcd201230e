"""Poses of a tracker as messages of a take, little endian: as they came, with both clocks."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array

_VECTORS = (("t_room_terminal", 3), ("q_room_terminal", 4))


class TrackerFacts(msgspec.Struct, frozen=True):
    """The tracker of a take, as it was chosen before the take began.

    Attributes:
        source: Where its poses came from: ``lsl:NAME``.
        terminal: Which terminal, as the tracker calls it; empty: the only one.
        sensor: The sensor of the glove that it sits on; empty: nobody said.
        lever_m: Where on it, in that sensor's axes; None: not measured.
    """

    source: str
    terminal: str = ""
    sensor: str = ""
    lever_m: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Poses of one terminal in the tracker's own frame, the room.

    Attributes:
        arrival_ns: When the host had each, on its steady clock [ns UTC].
        own_us: The time the tracker gave it [µs]: on the host's clock where the way it came tells
            how clocks stand, else on a clock of its own, or nonsense.
        t_room_terminal: [m]; NaN where unseen.
        q_room_terminal: Scalar first; NaN where unseen.
        quality: 0 unseen to 1.
    """

    arrival_ns: Int64[Array, " n"]
    own_us: Int64[Array, " n"]
    t_room_terminal: Float[Array, "n 3"]
    q_room_terminal: Float[Array, "n 4"]
    quality: Float[Array, " n"]

    def __len__(self) -> int:
        return len(self.arrival_ns)

    def __getitem__(self, part: slice | Array) -> Poses:
        return Poses(*(getattr(self, name)[part] for name in Poses.__slots__))


def joined(parts: list[Poses]) -> Poses:
    """One after the other; of none: nothing."""
    if not parts:
        whole = np.zeros(0, dtype=np.int64)
        return Poses(whole, whole, np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(0))
    return Poses(*(np.concatenate([getattr(p, name) for p in parts]) for name in Poses.__slots__))


def encode_poses(poses: Poses) -> bytes:
    """One message: how many (u32), then the arrays one after the other; arrival is the message's.

    All of them arrived together.
    """
    head = np.array([len(poses)], dtype="<u4").tobytes() + poses.own_us.astype("<i8").tobytes()
    arrays = [getattr(poses, name).astype("<f8").tobytes() for name, _ in _VECTORS]
    return b"".join([head, *arrays, poses.quality.astype("<f8").tobytes()])


def decode_poses(arrival_ns: int, data: bytes) -> Poses:
    """Inverse of `encode_poses`.

    Raises:
        ValueError: the message has another length than its size says.
    """
    (count,) = (int(x) for x in np.frombuffer(data, "<u4", 1))
    if len(data) != 4 + count * 8 * (1 + 3 + 4 + 1):
        raise ValueError(f"{len(data)} bytes for {count} poses")
    own_us = np.frombuffer(data, "<i8", count, 4).astype(np.int64)
    numbers, at = np.frombuffer(data, "<f8", count * 8, 4 + 8 * count).astype(float), 0
    parts = []
    for _, size in _VECTORS:
        parts.append(numbers[at : at + count * size].reshape(count, size))
        at += count * size
    arrival = np.full(count, arrival_ns, dtype=np.int64)
    return Poses(arrival, own_us, parts[0], parts[1], numbers[at:])
