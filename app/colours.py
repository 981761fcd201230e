"""One colour a finger, the same in 3-D, plots and exports; safe for colour-blind eyes.

After Okabe and Ito, Color Universal Design (2008), the green lightened for dark pages.
"""

from __future__ import annotations

THUMB = (230, 159, 0)
THUMB_PALE = (255, 211, 120)  # a second curve of the thumb
INDEX = (86, 180, 233)
MIDDLE = (0, 178, 130)
RING = (213, 94, 0)
LITTLE = (204, 121, 167)
WRIST = (226, 216, 178)
FOREARM = (150, 162, 184)
ALARM = (226, 75, 74)
DEAD = (104, 108, 116)
BOARD = (70, 92, 120)
GHOST = (138, 146, 158)
SKIN = (255, 233, 214)  # nobody's: it is to be told from every finger's colour
SECOND = (132, 184, 255)  # the skin of a hand to compare with
DOUBT = (96, 102, 112)  # hatching on skin
LIT = (255, 236, 92)

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

_CYCLE = (INDEX, THUMB, MIDDLE, LITTLE, RING, WRIST, FOREARM)


def of_part(name: str) -> tuple[int, int, int]:
    """Colour of a segment, joint or angle, by the finger or part its name begins with."""
    return PARTS.get(name.split("_", maxsplit=1)[0], FOREARM)


def of_index(index: int) -> tuple[int, int, int]:
    """Colours for things that are no part of a hand."""
    return _CYCLE[index % len(_CYCLE)]


def css(colour: tuple[int, int, int], dark: bool = True) -> str:
    """A colour as a page writes it; on a light page pale ones are deepened to be seen."""
    brightness = (299 * colour[0] + 587 * colour[1] + 114 * colour[2]) / 255_000
    share = 1.0 if dark else min(1.0, 0.55 / brightness)
    return "#{:02x}{:02x}{:02x}".format(*(round(share * channel) for channel in colour))


def apart(colour: tuple[int, int, int], dark: bool) -> tuple[int, int, int]:
    """The same colour for a second curve over the first: lighter on dark pages, else darker."""
    towards = 255 if dark else 0
    red, green, blue = ((channel + towards) // 2 for channel in colour)
    return red, green, blue


def pale(colour: tuple[int, int, int]) -> tuple[int, int, int]:
    """The same colour in doubt: half way to grey."""
    red, green, blue = ((channel + 2 * 120) // 3 for channel in colour)
    return red, green, blue
