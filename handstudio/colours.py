"""One colour a finger, the same in 3-D, plots and exports; safe for colour-blind eyes.

After Okabe and Ito, Color Universal Design (2008), the green lightened for dark pages.
"""

from __future__ import annotations

THUMB = (230, 159, 0)
INDEX = (86, 180, 233)
MIDDLE = (0, 178, 130)
RING = (213, 94, 0)
LITTLE = (204, 121, 167)
WRIST = (226, 216, 178)
FOREARM = (150, 162, 184)

PARTS = {
    "thumb": THUMB,
    "index": INDEX,
    "middle": MIDDLE,
    "ring": RING,
    "little": LITTLE,
    "hand": WRIST,
    "wrist": WRIST,
    "forearm": FOREARM,
    "elbow": FOREARM,
}


def of_part(name: str) -> tuple[int, int, int]:
    """Colour of a segment, joint or angle, by the finger or part its name begins with."""
    return PARTS.get(name.split("_", maxsplit=1)[0], FOREARM)
