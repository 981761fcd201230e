"""A take as commands that analyse it want it: opened, with the setup that is asked for, fused."""

from __future__ import annotations

from pathlib import Path

from handstudio.commands.calibration import chosen
from handstudio.export.part import Processed
from handstudio.process import aligned_setup, process
from handstudio.recording.take import open_take
from handstudio.shell import progress


def prepared(
    path: Path, calibration: str | None, sensors: str | None, *, align: bool, quiet: bool
) -> Processed:
    """A take and its motion; a bar tells how far it is, unless ``quiet``.

    Args:
        path: Of the take.
        calibration: File of another subject calibration than the take carries, or none.
        sensors: File of another calibration of the sensors than the take carries, or none.
        align: Align the headings by the take's own quick start.
        quiet: Show no bar.

    Raises:
        TakeError: the take cannot be read, or the disk does not take its motion.
        CalibrationError: a file holds none, or there is no quick start.
    """
    take = open_take(path)
    setup = chosen(take.header.setup, calibration, sensors)
    if align:
        setup, _ = aligned_setup(take, setup)
    with progress(path.name, quiet=quiet) as share:
        return Processed(take, setup, process(take, setup, progress=share))
