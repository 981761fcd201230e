"""Real hands as a Leap Motion controller recorded them, in the JSON of its playback tool.

Places are millimetres, x to the right, y up, z towards the person. A finger's ``mcpPosition`` to
``tipPosition`` are its joints; the thumb's ``mcpPosition`` is the base of its metacarpal and its
``pipPosition`` the MCP, as the maker counts a metacarpal of no length before them.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from handstudio.arrays import Array
from handstudio.errors import TakeError
from handstudio.hand.skeleton import FINGERS
from handstudio.simulation.motions.actor import HandRecording

_JOINTS = ("mcpPosition", "pipPosition", "dipPosition", "tipPosition")
_PLACES = {"thumb": (0, 1, 2, 4)}  # of these four among base, MCP, PIP, DIP and tip
_PLACES_OF_FINGER = (1, 2, 3, 4)

_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def recordings_in(folder: Path) -> Mapping[str, Callable[[], HandRecording]]:
    """Recordings of a folder by name, each read when asked for; none if there is no folder."""
    return {path.stem: partial(read_leap, path) for path in sorted(folder.glob("*.json"))}


def read_leap(path: Path) -> HandRecording:
    """Read one recording: the hand that is seen longest in it.

    Frames without that hand, or with a part of it missing, are left out.

    Raises:
        TakeError: the file cannot be read, is no such recording, or holds no hand.
    """
    frames = _frames(path)
    hands = [(n, frame, hand) for n, frame in enumerate(frames) for hand in _parts(frame, "hands")]
    seen = Counter(hand["id"] for _, _, hand in hands if isinstance(hand.get("id"), int | str))
    if not seen:
        raise TakeError(
            "{path}: there is no hand in this recording.", "Choose another file.", path=path
        )
    hand_id = seen.most_common(1)[0][0]
    found = [(number, frame, hand) for number, frame, hand in hands if hand.get("id") == hand_id]
    rows = [_Row(path, number).read(frame, hand) for number, frame, hand in found]
    whole = [row for row in rows if row is not None]
    if len(whole) < 2:
        raise TakeError(
            "{path}: the hand is never seen whole in this recording.",
            "Choose another file.",
            path=path,
        )
    sides = {str(hand.get("type")) for _, _, hand in found}
    if len(sides) != 1 or not sides <= {"left", "right"}:
        raise TakeError(
            "{path}: the hand is said to be {sides}, not left or right.",
            "Choose another file.",
            path=path,
            sides=", ".join(sorted(sides)),
        )
    time_s, joints, palm = (np.array(column) for column in zip(*whole, strict=True))
    if np.any(np.diff(time_s) <= 0.0):
        raise TakeError(
            "{path}: the frames are not in the order of their time.",
            "Choose another file.",
            path=path,
        )
    return HandRecording(sides.pop(), time_s - time_s[0], joints, palm)


def _frames(path: Path) -> list[dict[str, Any]]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise TakeError(
            "{path}: no recording of a hand can be read ({reason}).",
            "Choose a JSON file of Leap Motion's playback tool that is not compressed.",
            path=path,
            reason=error,
        ) from error
    frames = content.get("frames") if isinstance(content, dict) else None
    if not isinstance(frames, list) or not frames or not isinstance(frames[0], dict):
        raise TakeError(
            "{path}: this JSON holds no list of frames with names.",
            "Choose a recording that was not packed.",
            path=path,
        )
    return [frame if isinstance(frame, dict) else {} for frame in frames]


def _parts(frame: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    """Hands or fingers of a frame, whatever it holds there."""
    parts = frame.get(name)
    return [part for part in parts if isinstance(part, dict)] if isinstance(parts, list) else []


class _Row:
    """Reads one frame; what is wrong is told with its number."""

    def __init__(self, path: Path, number: int) -> None:
        self._path, self._number = path, number

    def read(
        self, frame: Mapping[str, Any], hand: Mapping[str, Any]
    ) -> tuple[float, Array, Array] | None:
        """Instant [s], joints [m] and palm with z up; None if a finger is missing."""
        joints = np.full((len(FINGERS), 5, 3), np.nan)
        seen = set()
        for pointable in _parts(frame, "pointables"):
            finger = pointable.get("type")
            of_hand = pointable.get("handId") == hand.get("id")
            if not of_hand or not isinstance(finger, int) or finger not in range(len(FINGERS)):
                continue  # another hand's, a pen or another tool
            places = _PLACES.get(FINGERS[finger], _PLACES_OF_FINGER)
            for name, place in zip(_JOINTS, places, strict=True):
                joints[finger, place] = self._vector(pointable, name) @ _Z_UP.T * 1e-3
            seen.add(finger)
        if len(seen) < len(FINGERS):
            return None
        return self._instant(frame), joints, self._palm(hand)

    def _palm(self, hand: Mapping[str, Any]) -> Array:
        forwards, palmar = (self._vector(hand, name) for name in ("direction", "palmNormal"))
        across = np.cross(palmar, forwards)
        lengths = [float(np.linalg.norm(v)) for v in (forwards, across)]
        if not all(1e-3 < length < 1e6 for length in lengths):
            raise TakeError(
                "{path}, frame {number}: direction and palmNormal of the hand give no palm.",
                "Choose another file, or take this frame out.",
                path=self._path,
                number=self._number,
            )
        y, x = forwards / lengths[0], across / lengths[1]
        palm: Array = _Z_UP @ np.stack([x, y, np.cross(x, y)], axis=-1)
        return palm

    def _instant(self, frame: Mapping[str, Any]) -> float:
        value = frame.get("timestamp")
        try:
            seconds = float(value) * 1e-6 if isinstance(value, int | float) else np.nan
        except OverflowError:
            seconds = np.nan
        if not np.isfinite(seconds):
            raise self._wrong("timestamp")
        return seconds

    def _vector(self, of: Mapping[str, Any], name: str) -> Array:
        try:
            vector = np.array(of.get(name), dtype=float)
        except (TypeError, ValueError, OverflowError):
            vector = np.zeros(0)
        if vector.shape != (3,) or not np.all(np.isfinite(vector)):
            raise self._wrong(name)
        return vector

    def _wrong(self, name: str) -> TakeError:
        return TakeError(
            "{path}, frame {number}: {name} is missing or makes no sense.",
            "Choose another file, or take this frame out.",
            path=self._path,
            number=self._number,
            name=name,
        )
