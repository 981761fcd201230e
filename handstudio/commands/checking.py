"""The command that says whether a calibration still holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from handstudio.check import check as check_takes
from handstudio.commands.arguments import Json
from handstudio.commands.calibration import read_calibration
from handstudio.commands.readings import sentence, told
from handstudio.errors import CalibrationError
from handstudio.recording.take import open_take
from handstudio.shell import out, print_json


def check(
    takes: Annotated[tuple[Path, ...], tyro.conf.Positional] = (),
    *,
    calibration: str | None = None,
    json: Json = False,
) -> int:
    """Say whether a calibration still holds, from takes of the course that checks it.

    Args:
        takes: The takes; their labels say what was done when.
        calibration: File of the subject calibration in question; the one the take carries unless
            given.
        json: Print JSON for a program instead of words.
    """
    if not takes:
        raise CalibrationError("No take was named.", "Name them: handstudio check TAKE.mcap ...")
    known = None if calibration is None else read_calibration(calibration)
    checked = check_takes([open_take(path) for path in takes], known)
    if json:
        print_json({"calibration": checked.calibration.id, "verdicts": told([checked.verdict])})
    else:
        for reading in checked.verdict.readings:
            out.print(sentence(reading))
        still = "still holds" if checked.verdict.ok else "does not hold any more"
        out.print(f"The calibration {checked.calibration.id} {still}.")
    return 0 if checked.verdict.ok else 1
