"""Commands about virtual subjects: what they can do, and takes of them."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import tyro

from handstudio.commands.arguments import Json
from handstudio.errors import SetupError
from handstudio.hand.skeleton import HandSide
from handstudio.recording import library
from handstudio.shell import out, print_json, print_table, progress


def motions(*, json: Json = False) -> int:
    """List what a virtual subject can do, how, and which imperfections there are.

    Args:
        json: Print JSON for a program instead of words.
    """
    from handstudio.recording.material import material  # noqa: PLC0415 - all of a virtual person
    from handstudio.simulation.imperfections.strengths import PRESETS  # noqa: PLC0415
    from handstudio.simulation.imperfections.table import TABLE  # noqa: PLC0415
    from handstudio.simulation.motions.catalogue import motions as all_motions  # noqa: PLC0415
    from handstudio.simulation.motions.manners import MANNERS  # noqa: PLC0415

    known = all_motions()
    recordings = sorted(material().recordings)
    if json:
        print_json(
            {
                "motions": {name: one.what for name, one in known.items()},
                "manners": {name: one.what for name, one in MANNERS.items()},
                "recordings": recordings,
                "imperfections": {one.name: one._asdict() for one in TABLE},
                "presets": list(PRESETS),
            }
        )
        return 0
    rows = [
        [one.described, f"{one.what} (:{one.argument})" if one.argument else one.what]
        for name, one in known.items()
    ]
    print_table("Motions", ["name", "what is done"], rows)
    if recordings:
        out.print(f"Recordings of real hands: {', '.join(recordings)}\n")
    print_table("Manners", ["~", "how"], [[name, one.what] for name, one in MANNERS.items()])
    errors = [[one.name, one.what, one.size] for one in TABLE]
    print_table("Imperfections", ["name", "what", "at strength 1"], errors)
    out.print(f"Sets of them: {', '.join(PRESETS)}")
    out.print(
        "\nOne after the other: calibration+open_close. At the same time: typing&elbow_moving. "
        "Again: 3*open_close.\nIn a manner: calibration~sloppy. "
        "Try: handstudio simulate --subject 7 --motion calibration+scissors "
        "--imperfections typical,magnet"
    )
    return 0


def simulate(
    *,
    subject: int = 0,
    motion: str = "showcase",
    imperfections: str = "plain",
    seed: int = 0,
    side: HandSide = "right",
    seconds: float | None = None,
    rate: int = 100,
    name: str = "",
    start: str = "",
    out_folder: Annotated[Path | None, tyro.conf.arg(name="out")] = None,
) -> int:
    """Write a take of a virtual subject, its labels, and the truth beside it.

    Args:
        subject: Number of the person; 0 is the ideal one.
        motion: What is done (handstudio motions lists what there is), such as
            calibration+scissors.
        imperfections: Of sensors, skin and room: ideal, plain, typical or harsh, and changes to it,
            such as typical,-wobble,scale=2.
        seed: Of the performance, the donning and the noise.
        side: Which hand.
        seconds: How long; as long as the motion unless given.
        rate: Samples a second.
        name: Of the take; as the motion unless given.
        start: When it begins, such as 2026-03-04T12:30:00, UTC; now unless given. The same seed,
            start and name give the same file to the last bit.
        out_folder: Folder of the takes (default: as the studio's).
    """
    from handstudio.recording import simulated  # noqa: PLC0415 - all of a virtual person
    from handstudio.simulation.imperfections.strengths import parse  # noqa: PLC0415

    strengths, begin = parse(imperfections), _begin(start)
    with progress("simulating", quiet=False) as share:
        path = simulated.simulate(
            library.sessions_folder(out_folder),
            simulated.rehearse(subject, motion, strengths, seed, side=side),
            seconds=seconds,
            rate_hz=rate,
            name=name,
            start=begin,
            progress=share,
        )
    out.print(str(path))
    return 0


def _begin(start: str) -> datetime | None:
    if not start:
        return None
    try:
        time = datetime.fromisoformat(start)
        time = time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
        since_1970 = time.timestamp()
    except (ValueError, OverflowError):
        since_1970 = -1.0
    if since_1970 < 0.0:
        raise SetupError(
            "{start}: no time a take can begin.",
            "Give day and time, 1970 or later, such as 2026-03-04T12:30:00.",
            start=start,
        )
    return time
