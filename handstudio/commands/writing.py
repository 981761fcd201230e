"""The command that shows what was written in a take."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from handstudio.analysis.take_writing import writings_in
from handstudio.analysis.writing import Writing
from handstudio.commands.arguments import Json, TakeFile
from handstudio.commands.preparing import prepared
from handstudio.errors import TakeError
from handstudio.export.metadata import of_part, of_take
from handstudio.export.part import Window, cut
from handstudio.export.trace import FORMATS, csv_sidecar, save, told
from handstudio.pipeline import Motion
from handstudio.recording.take import Take
from handstudio.setup import Setup
from handstudio.shell import out, print_json, print_table


def trace(
    take: TakeFile,
    *,
    svg: bool = False,
    png: bool = False,
    csv: bool = False,
    to: Path | None = None,
    start_s: float = 0.0,
    end_s: float | None = None,
    calibration: str | None = None,
    sensors: str | None = None,
    align: bool = False,
    json: Json = False,
) -> int:
    """Find what was written with a pen in a take, and draw it. The elbow must have rested.

    Args:
        take: The take.
        svg: Write the strokes as SVG, in true size.
        png: Write them as PNG.
        csv: Write every instant as CSV, with a sidecar JSON.
        to: Folder to write into; beside the take unless given.
        start_s: Begin of the window, seconds from the take's first instant.
        end_s: End of the window; the end of the take unless given.
        calibration: File of another subject calibration than the take carries, or none.
        sensors: File of another calibration of the sensors than the take carries, or none.
        align: Align the headings by the take's own quick start.
        json: Print JSON for a program instead of words.
    """
    ready = prepared(take, calibration, sensors, align=align, quiet=json)
    opened, setup, motion = ready.take, ready.setup, ready.motion
    part = cut(motion, Window(start_s, end_s))
    found = writings_in(setup, part, int(motion.time_us[0]))
    if not found:
        raise TakeError(
            "{path}: no pen was seen to write.",
            "Hold it with thumb, index and middle finger for 2 s or longer, the elbow resting; "
            "calibrate the hand, align the headings (--align), or tell where to look (--start-s).",
            path=take,
        )
    wanted = [name for name, yes in (("svg", svg), ("png", png), ("csv", csv)) if yes]
    folder = take.parent if to is None else to
    rows: list[dict[str, Any]] = []
    for number, writing in enumerate(found, start=1):
        name = f"{take.stem}.trace" + (f"-{number}" if len(found) > 1 else "")
        files = _saved(
            writing, wanted, folder / name, (opened, setup, part, int(motion.time_us[0]))
        )
        rows.append(told(writing) | {"files": files})
    if json:
        print_json(rows)
    else:
        _show(rows)
    return 0


def _saved(
    writing: Writing, wanted: list[str], target: Path, of: tuple[Take, Setup, Motion, int]
) -> list[str]:
    files = []
    for name in wanted:
        path = target.with_name(f"{target.name}.{name}")
        files.append(str(save(path, FORMATS[name](writing))))
        if name == "csv":
            take, setup, part, start_us = of
            about = of_take(take, setup) | of_part(setup, part, start_us, "trace")
            sidecar = csv_sidecar(writing, about)
            save(path.with_name(f"{path.name}.json"), sidecar)
    return files


def _show(rows: list[dict[str, Any]]) -> None:
    shown = [
        [
            f"{row['start_s']:.2f} to {row['end_s']:.2f} s",
            str(row["strokes"]),
            f"{row['width_mm']:.0f} x {row['height_mm']:.0f} mm",
            f"{row['length_mm']:.0f} mm",
            f"{row['plane_tilt_deg']:.1f} deg",
            f"{row['off_plane_sd_mm']:.2f} mm",
        ]
        for row in rows
    ]
    columns = ["when", "strokes", "size", "length", "plane's tilt", "off the plane, SD"]
    print_table("Writing", columns, shown)
    for row in rows:
        for path in row["files"]:
            out.print(path)
