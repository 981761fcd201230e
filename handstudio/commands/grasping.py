"""The command that tells the grasps of a take."""

from __future__ import annotations

from typing import Any

from handstudio.analysis.take_grasps import TakenGrasp, grasps_in
from handstudio.analysis.take_writing import can_tell_writing, writings_in
from handstudio.commands.arguments import Json, TakeFile
from handstudio.commands.preparing import prepared
from handstudio.export.part import Window, cut
from handstudio.shell import out, print_json, print_table


def grasps(
    take: TakeFile,
    *,
    start_s: float = 0.0,
    end_s: float | None = None,
    calibration: str | None = None,
    sensors: str | None = None,
    align: bool = False,
    json: Json = False,
) -> int:
    """Tell which grasps a take holds, when, and how large what was held is.

    Args:
        take: The take.
        start_s: Begin of the window, seconds from the take's first instant.
        end_s: End of the window; the end of the take unless given.
        calibration: File of another subject calibration than the take carries, or none.
        sensors: File of another calibration of the sensors than the take carries, or none.
        align: Align the headings by the take's own quick start.
        json: Print JSON for a program instead of words.
    """
    ready = prepared(take, calibration, sensors, align=align, quiet=json)
    setup, motion = ready.setup, ready.motion
    part, begin_us = cut(motion, Window(start_s, end_s)), int(motion.time_us[0])
    writings = writings_in(setup, part, begin_us) if can_tell_writing(setup.layout) else []
    found = grasps_in(setup, part, begin_us, writings=writings)
    rows = [told(grasp) for grasp in found]
    if json:
        print_json(rows)
        return 0
    if not rows:
        out.print("No grasp was held.")
        return 0
    columns = ["holds", "grasp", "after Feix", "confidence", "size"]
    print_table("Grasps", columns, [_shown(row) for row in rows])
    return 0


def told(grasp: TakenGrasp) -> dict[str, Any]:
    """For a program: seconds, millimetres."""
    segment, size = grasp.segment, grasp.size
    return {
        "grasp": segment.found.name,
        "feix": segment.found.feix,
        "confidence": round(segment.found.confidence, 3),
        "distance": round(segment.found.distance, 2),
        "next": segment.found.second,
        "start_s": segment.start_s,
        "hold_s": segment.hold_s,
        "release_s": segment.release_s,
        "end_s": segment.end_s,
        "size": None
        if size is None
        else {
            "form": size.form,
            "diameter_mm": round(1e3 * size.diameter_m, 2),
            "sd_mm": round(1e3 * size.sd_m, 2),
            "residual_mm": round(1e3 * size.residual_m, 2),
        },
    }


def _shown(row: dict[str, Any]) -> list[str]:
    size = row["size"]
    diameter = "" if size is None else f"{size['form']}, {size['diameter_mm']:.0f} mm"
    return [
        f"{row['hold_s']:.2f} to {row['release_s']:.2f} s",
        row["grasp"],
        row["feix"],
        f"{100.0 * row['confidence']:.0f} %",
        diameter,
    ]
