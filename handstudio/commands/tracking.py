"""Trackers in the shell: recorded along with a take, or their track put beside one."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import tyro

from handstudio.commands.arguments import Json, TakeFile
from handstudio.device.capture import Capture
from handstudio.device.orders import SetTracker
from handstudio.device.tracker import TrackerPhase, TrackerReader
from handstudio.errors import DeviceError, HandstudioError, TrackError
from handstudio.pipeline import Motion
from handstudio.process import process
from handstudio.recording.take import Take, open_take
from handstudio.recording.take_track import TrackFacts, load_track, save_track
from handstudio.recording.tracker_message import TrackerFacts
from handstudio.recording.tracks import read_tracks
from handstudio.rooted import WITHIN_S, Root, aligned_track, root_of, root_or_why
from handstudio.setup import Setup
from handstudio.shell import err, out, print_json, progress
from handstudio.trackers.late_faults import Fate, told_faults
from handstudio.trackers.track import Track

_FOUND_S = 15.0

_SAID = {
    Fate.LOST: "not seen",
    Fate.FROZEN: "frozen: the same pose again",
    Fate.JUMPED: "elsewhere: not taken",
    Fate.MIRRORED: "on the other side of the transmitter: mirrored back",
    Fate.AFRESH: "stayed elsewhere: begun anew from there",
    Fate.TURNED: "its attitude does not fit: only the place was taken",
}


def add_track(
    take: TakeFile,
    file: Annotated[Path, tyro.conf.Positional],
    *,
    terminal: str | None = None,
    sensor: str | None = None,
    lever_mm: tuple[float, float, float] | None = None,
    within_s: float = WITHIN_S,
    json: Json = False,
) -> int:
    """Add the track of a tracker to a take: the hand then has its place in the tracker's room.

    The terminal sits on a sensor of the glove, or fixed to the same segment. Clock, delay and
    mounting are found from the motion.

    Args:
        take: The take.
        file: What the tracker told: CSV (docs/late-trackers.md).
        terminal: Which terminal of the file; needed where it has several.
        sensor: The sensor it sits on; the one it stays with best unless given.
        lever_mm: Where it sits, along x, y and z of that sensor; found from fast movements unless
            given.
        within_s: How far the tracker's clock may begin from the take's first instant.
        json: Print JSON for a program instead of words.
    """
    opened, track = open_take(take), _chosen(read_tracks(file), terminal)
    setup = opened.header.setup
    with progress(take.name, quiet=json) as share:
        motion = process(opened, setup, progress=share)
    lever = _metres(lever_mm)
    kept = aligned_track(
        opened, motion, track, file.name, sensor=sensor, lever_m=lever, within_s=within_s
    )
    save_track(take, kept)
    root = root_of(opened, setup, motion)
    fates = np.zeros(0, dtype=np.uint8) if root is None else root.fates
    faults = told_faults(fates, kept.track.time_us)
    if json:
        found = [
            {"what": fate.name.lower(), "start_s": begin, "end_s": end, "poses": count}
            for fate, begin, end, count in faults
        ]
        facts: dict[str, Any] = msgspec.to_builtins(kept.facts)
        print_json(facts | {"faults": found})
        return 0
    _tell(kept.facts, faults)
    return 0


def reader_of(
    capture: Capture,
    address: str | None,
    terminal: str,
    sensor: str,
    lever_mm: tuple[float, float, float] | None,
) -> TrackerReader | None:
    """Whoever reads a tracker into the takes of a capture; started. None where none is named.

    Raises:
        DeviceError: that is no tracker's address.
    """
    if address is None:
        return None
    facts = TrackerFacts(address, terminal, sensor, _metres(lever_mm))
    reader = TrackerReader(facts, capture)
    capture.send(SetTracker(facts))
    reader.start()
    return reader


def await_poses(reader: TrackerReader) -> None:
    """Wait until a tracker tells something.

    Raises:
        DeviceError: it is not there.
    """
    end = time.monotonic() + _FOUND_S
    while reader.newest.phase is not TrackerPhase.STREAMING:
        if time.monotonic() > end:
            raise reader.newest.problem or DeviceError(
                "The tracker {address} tells nothing.",
                "Start its streaming, or record without --tracker.",
                address=reader.newest.facts.source,
            )
        time.sleep(0.02)


def tracks_in_words(take: Take) -> list[str]:
    """What a take knows of a tracker: what lies beside it, else what was recorded with it."""
    kept, told = load_track(take.path), take.header.tracker
    if kept is not None:
        return [f"{kept.facts.terminal} on {kept.facts.sensor}, added from {kept.facts.source}"]
    if told is None:
        return []
    on = f" on {told.sensor}" if told.sensor else ""
    count = "" if take.summary is None else f", {take.summary.poses} poses"
    return [f"{told.terminal or 'terminal'}{on} from {told.source}{count}"]


def tell_place(take: Take, setup: Setup, motion: Motion) -> None:
    """Say where the hand's place in the room comes from, or why there is none."""
    root = root_or_why(take, setup, motion)
    if isinstance(root, HandstudioError):
        err.print(f"No place in the tracker's room: {root.what} {root.remedy}")
    elif isinstance(root, Root):
        _tell(root.facts, told_faults(root.fates, root.pose_us))


def _metres(mm: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
    return None if mm is None else (mm[0] * 1e-3, mm[1] * 1e-3, mm[2] * 1e-3)


def _tell(facts: TrackFacts, faults: list[tuple[Fate, float, float, int]]) -> None:
    lever = ", ".join(f"{1e3 * x:.1f}" for x in facts.t_sensor_terminal)
    out.print(
        f"{facts.terminal} sits on {facts.sensor}, at {lever} mm "
        f"({facts.lever_source}); told {facts.offset_s:+.3f} s after the take's clock, "
        f"attitudes agree within {np.rad2deg(facts.residual_rad):.1f} deg."
    )
    for fate, begin, end, count in faults:
        out.print(f"  {begin:.2f} to {end:.2f} s of the track, {count} poses: {_SAID[fate]}")


def _chosen(tracks: tuple[Track, ...], terminal: str | None) -> Track:
    names = [track.name for track in tracks]
    if terminal is None and len(tracks) == 1:
        return tracks[0]
    if terminal not in names:
        raise TrackError(
            "No one terminal of the file was named.",
            "Name it: --terminal NAME. It has {names}.",
            names=", ".join(names),
        )
    return tracks[names.index(terminal)]
