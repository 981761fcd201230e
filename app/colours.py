"""Colours of the page: those of the fingers, and of all that is no part of a hand."""

from __future__ import annotations

from handstudio.colours import (
    FOREARM,
    INDEX,
    LITTLE,
    MIDDLE,
    PARTS,
    RING,
    THUMB,
    WRIST,
    of_part,
)

__all__ = ["FOREARM", "INDEX", "LITTLE", "MIDDLE", "PARTS", "RING", "THUMB", "WRIST", "of_part"]

THUMB_PALE = (255, 211, 120)  # a second curve of the thumb
ALARM = (226, 75, 74)
DEAD = (104, 108, 116)
BOARD = (70, 92, 120)
GHOST = (138, 146, 158)
SKIN = (255, 233, 214)  # nobody's: it is to be told from every finger's colour
SECOND = (132, 184, 255)  # the skin of a hand to compare with
DOUBT = (96, 102, 112)  # hatching on skin
HELD = (120, 190, 150)  # a thing in the hand
LIT = (255, 236, 92)

_CYCLE = (INDEX, THUMB, MIDDLE, LITTLE, RING, WRIST, FOREARM)


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
