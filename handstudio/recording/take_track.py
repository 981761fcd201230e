"""The track of a tracker's terminal, kept beside the take it was recorded along with."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from zipfile import BadZipFile

import msgspec
import numpy as np

from handstudio.errors import TakeError
from handstudio.recording.atomic import unwritable
from handstudio.recording.naming import take_stem
from handstudio.trackers.track import Track

TRACK = ".track.npz"


class TrackFacts(msgspec.Struct, frozen=True):
    """What is known of a kept track besides its poses.

    Attributes:
        terminal: Its name in the file it came from.
        source: Name of that file.
        sensor: The sensor of the glove it sits on, by its name in the layout.
        t_sensor_terminal: Where on it, in the sensor's axes [m].
        lever_source: Whether that was measured or found from the motion.
        lever_sd_m: How well it is known, along one axis.
        offset_s: What was taken off the file's times, which count from the take's first instant:
            delay and start of the tracker's clock in one.
        correlation: Of speeds of turning of terminal and sensor.
        residual_rad: By how much their attitudes differ, root mean square.
    """

    terminal: str
    source: str
    sensor: str
    t_sensor_terminal: tuple[float, float, float]
    lever_source: str
    lever_sd_m: float
    offset_s: float
    correlation: float
    residual_rad: float


@dataclass(frozen=True, slots=True, eq=False)
class KeptTrack:
    """Poses with the times when they were, on the time axis of the take's motion."""

    track: Track
    facts: TrackFacts


def track_path(take: Path) -> Path:
    """Where the track of a take lives."""
    return take.with_name(take_stem(take) + TRACK)


def save_track(take: Path, kept: KeptTrack) -> None:
    """Store a track beside a take; one that was there is replaced.

    Raises:
        TakeError: it cannot be written.
    """
    path, track = track_path(take), kept.track
    fresh = path.with_name(path.name + ".new")
    try:
        with fresh.open("wb") as file:
            np.savez_compressed(
                file,
                facts=np.array(msgspec.json.encode(kept.facts).decode()),
                time_us=track.time_us,
                t_room_terminal=track.t_room_terminal,
                q_room_terminal=track.q_room_terminal,
                quality=track.quality,
            )
        fresh.replace(path)
    except OSError as error:
        raise unwritable(path, error) from error


def load_track(take: Path) -> KeptTrack | None:
    """The track of a take; None where it has none.

    Raises:
        TakeError: it cannot be read.
    """
    path = track_path(take)
    if not path.exists():
        return None
    try:
        # opened here: numpy leaves a file open that is no archive
        with path.open("rb") as stream, np.load(stream) as file:
            facts = msgspec.json.decode(str(file["facts"]), type=TrackFacts)
            poses = file["time_us"], file["t_room_terminal"], file["q_room_terminal"]
            return KeptTrack(Track(facts.terminal, *poses, file["quality"]), facts)
    except (OSError, KeyError, ValueError, EOFError, BadZipFile, msgspec.MsgspecError) as error:
        raise TakeError(
            "{path}: the track cannot be read ({reason}).",
            "Add it again: handstudio add-track TAKE FILE. Without the file the take is as before.",
            path=path,
            reason=error,
        ) from error


def track_hash(take: Path) -> str:
    """Of the track's file: what is computed with it is kept under this."""
    return sha256(track_path(take).read_bytes()).hexdigest()
