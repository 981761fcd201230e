"""The command that puts the track of a tracker beside a take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import tyro

from handstudio.commands.arguments import Json, TakeFile
from handstudio.errors import TrackError
from handstudio.process import process
from handstudio.recording.take import open_take
from handstudio.recording.take_track import save_track
from handstudio.recording.tracks import read_tracks
from handstudio.rooted import WITHIN_S, aligned_track, root_of
from handstudio.shell import out, print_json, progress
from handstudio.trackers.late_faults import Fate, told_faults
from handstudio.trackers.track import Track

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
    x, y, z = lever_mm or (0.0, 0.0, 0.0)
    lever = None if lever_mm is None else (x * 1e-3, y * 1e-3, z * 1e-3)
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
    facts_of = kept.facts
    lever_shown = ", ".join(f"{1e3 * x:.1f}" for x in facts_of.t_sensor_terminal)
    out.print(
        f"{facts_of.terminal} sits on {facts_of.sensor}, at {lever_shown} mm "
        f"({facts_of.lever_source}); told {facts_of.offset_s:+.3f} s after the take's clock, "
        f"attitudes agree within {np.rad2deg(facts_of.residual_rad):.1f} deg."
    )
    for fate, begin, end, count in faults:
        out.print(f"  {begin:.2f} to {end:.2f} s of the track, {count} poses: {_SAID[fate]}")
    return 0


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
