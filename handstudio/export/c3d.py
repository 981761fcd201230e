"""C3D: places of joints and fingertips, POINT in millimetres, residual -1 and NaN in gaps.

Blocks of 512 bytes, little-endian, numbers as IEEE floats (The C3D File Format, User Guide,
Motion Lab Systems 2021): a header, parameters in groups, then frames. It is written here and not
by a library so that memory does not grow with the take and a full disk is noticed; tests read it
with two libraries.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from itertools import count as counted
from typing import Any, BinaryIO

import msgspec
import numpy as np

from handstudio.arrays import Array
from handstudio.export.frames import Frames, blocks, frames_of
from handstudio.export.part import Part
from handstudio.export.tables import POINTS, points_mm

_BLOCK = 512
_MOST = 65535  # what sixteen bits hold
_WIDTH = 120  # characters a line of the metadata
_INTEL, _KEY = 84, 80
_FIRST, _LAST = b"\x01\x50", b"\x00" * 4  # what a parameter section begins and ends with


def write(part: Part, file: BinaryIO) -> None:
    """Write every frame from the window's first instant to its last."""
    frames = frames_of(part)
    # the parameters say in which block the frames begin, which takes no more room or less
    size = len(_parameters(part, frames, 0))
    start = 2 + -(-(size + 4) // _BLOCK)
    parameters = _parameters(part, frames, start)
    head = _FIRST + bytes([start - 2, _INTEL])
    file.write(_header(frames, start))
    file.write((head + parameters).ljust((start - 2) * _BLOCK, b"\0"))
    for _first, count, motion, rows in blocks(part, frames):
        values = np.full((count, len(POINTS), 4), np.nan, dtype="<f4")
        values[..., 3] = -1.0
        places = points_mm(part.pose(motion))
        values[rows, :, :3] = places
        values[rows, :, 3] = np.where(np.isfinite(places[..., 0]), 0.0, -1.0)
        file.write(values.tobytes())
    written = frames.count * len(POINTS) * 16
    file.write(b"\0" * (-written % _BLOCK))


def _header(frames: Frames, start: int) -> bytes:
    first, last = (min(number, _MOST) for number in _first_and_last(frames))
    words = struct.pack(
        "<BB5HfHHf", 2, _KEY, len(POINTS), 0, first, last, 0, -1.0, start, 0, frames.rate_hz
    )
    return words.ljust(_BLOCK, b"\0")


def _first_and_last(frames: Frames) -> tuple[int, int]:
    """Frames count from one in this format."""
    return frames.first + 1, frames.first + frames.count


def _parameters(part: Part, frames: Frames, start: int) -> bytes:
    first, last = (_two_words(number) for number in _first_and_last(frames))
    few = np.array(min(frames.count, _MOST), dtype="<u2")
    groups: dict[str, dict[str, Any]] = {
        "POINT": {
            "USED": _whole(len(POINTS)),
            "SCALE": np.float32(-1.0),
            "RATE": np.float32(frames.rate_hz),
            "DATA_START": _whole(start),
            "FRAMES": few,
            "UNITS": "mm",
            "LABELS": list(POINTS),
            "DESCRIPTIONS": ["joint centre" if "tip" not in p else "fingertip" for p in POINTS],
            "X_SCREEN": "+X",
            "Y_SCREEN": "+Z",
        },
        "ANALOG": {
            "USED": _whole(0),
            "GEN_SCALE": np.float32(1.0),
            "RATE": np.float32(0.0),
        },
        "TRIAL": {
            "ACTUAL_START_FIELD": first,
            "ACTUAL_END_FIELD": last,
            "CAMERA_RATE": np.float32(frames.rate_hz),
        },
        "SUBJECTS": {
            "USED": _whole(1),
            "NAMES": [str(part.about["subject"])],
            "MARKER_SETS": [f"{part.about['hand_side']} hand"],
        },
        "MANUFACTURER": {"COMPANY": "handstudio", "SOFTWARE": str(part.about["software"])},
        "HANDSTUDIO": {"METADATA": _lines(part.about)},
    }
    records = []
    for number, (name, parameters) in zip(counted(1), groups.items(), strict=False):
        records.append(_record(-number, name, b""))
        records += [_record(number, key, _data(value)) for key, value in parameters.items()]
    return b"".join(records) + _LAST


def _record(group: int, name: str, data: bytes) -> bytes:
    """A group or a parameter: its name, the way to the next, its data, no description."""
    text = name.encode("ascii")
    body = data + b"\0"
    return struct.pack("<bb", len(text), group) + text + struct.pack("<h", len(body) + 2) + body


def _data(value: str | list[str] | Array | np.float32) -> bytes:
    """Kind, dimensions, the numbers or characters."""
    if isinstance(value, str):
        text = _ascii([value])
        return struct.pack("<bBB", -1, 1, len(text)) + text
    if isinstance(value, list):
        text = _ascii(value)
        return struct.pack("<bBBB", -1, 2, len(text) // len(value), len(value)) + text
    kind = 4 if value.dtype.kind == "f" else 2
    shape = value.shape
    return struct.pack(f"<bB{len(shape)}B", kind, len(shape), *shape) + value.tobytes()


def _ascii(lines: Sequence[str]) -> bytes:
    """Lines of one length."""
    encoded = [line.encode("ascii", "replace") for line in lines]
    longest = max(len(line) for line in encoded)
    return b"".join(line.ljust(longest) for line in encoded)


def _lines(about: dict[str, Any]) -> list[str]:
    """All there is to tell as JSON, cut into lines; the sidecar has it where it is too long."""
    text = msgspec.json.encode(about).decode()
    ascii_only = "".join(sign if sign.isascii() else f"\\u{ord(sign):04x}" for sign in text)
    lines = [ascii_only[at : at + _WIDTH] for at in range(0, len(ascii_only), _WIDTH)]
    return lines if len(lines) <= 255 else ["see the file beside: it is too long for this one"]


def _whole(number: int) -> Array:
    return np.array(number, dtype="<i2")


def _two_words(number: int) -> Array:
    """A number of 32 bits as this format has it: the lower sixteen first."""
    return np.array([number & 0xFFFF, number >> 16], dtype="<u2")
