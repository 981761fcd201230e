"""The command that finds the joint between two terminals of a tracker."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from handstudio.arrays import Array
from handstudio.commands.arguments import Json
from handstudio.errors import TrackError
from handstudio.recording.tracks import read_tracks
from handstudio.shell import err, out, print_json, print_table
from handstudio.trackers.methods import METHODS, method_named
from handstudio.trackers.said import said
from handstudio.trackers.study import REST_S, Found, JointStudy, study
from handstudio.trackers.track import Track

_AXES = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0], "z": [0.0, 0.0, 1.0]}


def joints(
    file: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="TRACKFILE")],
    *,
    terminals: tuple[str, ...] = (),
    cluster: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = (),
    method: str = next(iter(METHODS)),
    every_method: bool = False,
    straight_s: float = REST_S,
    start_s: float = 0.0,
    end_s: float | None = None,
    width: Literal["x", "y", "z"] = "y",
    json: Json = False,
) -> int:
    """Find the joint between two terminals of a tracker: held straight first, then bent for 20 s.

    Args:
        file: Poses (.csv), or markers (.trc, .c3d, .tsv); docs/trackers.md shows the columns.
        terminals: The one nearer to the hand, then the one beyond the joint; the first two of the
            file unless given.
        cluster: Which markers make a terminal: NAME=marker,marker,marker.
        method: How to find it: rolling, plane, steady, variance, symmetric or helical.
        every_method: Show what all methods find.
        straight_s: How long it was held straight, from the start.
        start_s: Begin of the window, seconds from the file's first instant.
        end_s: End of the window; the end of the file unless given.
        width: Which axis of the tracker lies across the finger while it is straight.
        json: Print JSON in SI for a program instead of words.
    """
    tracks = read_tracks(file, dict(_cluster(each) for each in cluster))
    upper, lower = (_windowed(each, start_s, end_s) for each in _two(file, tracks, terminals))
    time_s = 1e-6 * (upper.time_us - upper.time_us[:1])
    first = method_named(method)
    methods = (first, *(m for m in METHODS.values() if every_method and m is not first))
    found = study(
        upper,
        lower,
        rest=time_s < straight_s,
        moving=time_s >= straight_s,
        methods=methods,
        width=np.array(_AXES[width]),
    )
    if json:
        print_json(told(found))
    else:
        _show(found)
    return 0 if found.ok else 1


def told(found: JointStudy) -> dict[str, Any]:
    """A study as plain values, SI."""
    return {
        "terminals": [found.upper, found.lower],
        "frames": found.frames,
        "bend_rad": float(found.bend_rad),
        "ok": bool(found.ok),
        "joints": {name: _told(each) for name, each in found.found.items()},
        "refused": {name: _words(error) for name, error in found.refused.items()},
        "axis_classes": found.class_counts.tolist(),
        "findings": [
            {"kind": f.kind, "track": f.track, "amount": float(f.amount), "made_good": f.made_good}
            | _words(said(f))
            for f in found.findings
        ],
        "poor": [_words(error) for error in found.poor],
    }


def _told(found: Found) -> dict[str, Any]:
    estimate = found.estimate
    return {
        "p_upper_m": estimate.p_upper.tolist(),
        "p_upper_covariance_m2": estimate.upper_covariance.tolist(),
        "p_lower_m": estimate.p_lower.tolist(),
        "p_lower_covariance_m2": estimate.lower_covariance.tolist(),
        "axis_upper": estimate.axis_upper.tolist(),
        "axis_sd_rad": float(estimate.axis_sd_rad),
        "apart_m": float(found.apart_m),
        "frames": estimate.frames,
        "from_upper_m": found.from_upper_m.tolist(),
    }


def _words(error: TrackError) -> dict[str, str]:
    return {"what": error.what, "remedy": error.remedy}


def _show(found: JointStudy) -> None:
    rows = [
        [
            name,
            _place(each.estimate.p_upper, each.estimate.upper_covariance),
            _place(each.estimate.p_lower, each.estimate.lower_covariance),
            f"{1e3 * each.apart_m:.2f}",
            f"{np.rad2deg(each.estimate.axis_sd_rad):.2f}",
        ]
        for name, each in found.found.items()
    ]
    print_table(
        f"Joint between {found.upper} and {found.lower}: {found.frames} frames, bent by "
        f"{np.rad2deg(found.bend_rad):.0f} deg; x y z ± one standard deviation [mm]",
        ["method", f"from {found.upper}", f"from {found.lower}", "apart [mm]", "axis ± [deg]"],
        rows,
    )
    for error in (*found.refused.values(), *(said(each) for each in found.findings), *found.poor):
        err.print(f"{error.what}\n  {error.remedy}")
    out.print("The joint can be used." if found.ok else "The joint is doubtful.")


def _place(place: Array, covariance: Array) -> str:
    sd = np.sqrt(np.diag(covariance))
    return "  ".join(f"{1e3 * p:.1f} ± {1e3 * s:.1f}" for p, s in zip(place, sd, strict=True))


def _cluster(text: str) -> tuple[str, tuple[str, ...]]:
    name, equals, markers = text.partition("=")
    names = tuple(each.strip() for each in markers.split(",") if each.strip())
    if not (equals and name and names):
        raise TrackError(
            "{text!r} names no markers of a terminal.",
            "Write NAME=marker,marker,marker.",
            text=text,
        )
    return name, names


def _two(file: Path, tracks: tuple[Track, ...], names: tuple[str, ...]) -> list[Track]:
    known = {track.name: track for track in tracks}
    wanted = names or tuple(known)[:2]
    if len(wanted) != 2 or any(name not in known for name in wanted):
        raise TrackError(
            "{file} has the terminals {known}; two are needed, beside one joint.",
            "Name them, the one nearer to the hand first: --terminals UPPER LOWER.",
            file=file,
            known=", ".join(known),
        )
    return [known[name] for name in wanted]


def _windowed(track: Track, start_s: float, end_s: float | None) -> Track:
    time_s = 1e-6 * (track.time_us - track.time_us[:1])
    used = time_s >= start_s
    if end_s is not None:
        used &= time_s <= end_s
    if not used.any():
        raise TrackError(
            "The window from {start:.1f} s on holds no instant; the file is {seconds:.1f} s long.",
            "Choose another window.",
            start=start_s,
            seconds=float(time_s.max(initial=0.0)),
        )
    return track[used]
