"""The formats: one value each, used alike by the studio and the shell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from handstudio.errors import SetupError, TakeError
from handstudio.export import bvh, c3d, csv, glb, mcap, opensim, parquet, svg, trc
from handstudio.export.frames import frames_of
from handstudio.export.part import Content, Part
from handstudio.layout import Layout
from handstudio.recording.naming import VIEW


@dataclass(frozen=True, slots=True)
class Format:
    """How a motion becomes a file.

    Attributes:
        name: What a person calls it, which is also what the file's name ends in but for ``ending``.
        contents: What of a motion it can hold; the first where a person does not say.
        write: Writes the whole file.
        axes: The world of the file; empty: it holds none.
        even: Whether its frames follow one another at an even rate.
        fills_gaps: Whether the pose is held where instants are missing.
        ending: What is added to the take's name.
        more: What else it tells.
    """

    name: str
    contents: tuple[Content, ...]
    write: Callable[[Part, BinaryIO], None]
    axes: str = ""
    even: bool = False
    fills_gaps: bool = False
    ending: str = ""
    more: Callable[[Part], dict[str, Any]] = lambda _part: {}

    def content(self, asked: Content | None, layout: Layout) -> Content:
        """What of a motion it will hold: what is asked for, or all a take of this layout has.

        Raises:
            TakeError: it holds nothing of the kind, or the take has no hand and it needs one.
        """
        if asked is not None and asked not in self.contents and len(self.contents) > 1:
            raise TakeError(
                "{format} holds no {content}.",
                "Choose one of: {known}.",
                format=self.name,
                content=asked,
                known=", ".join(self.contents),
            )
        one = asked if asked in self.contents else None
        chosen = one or self._first(layout)
        if not layout.is_hand and chosen not in _WITHOUT_A_HAND:
            raise TakeError(
                "This take has no joint angles or positions. {why}",
                "Export orientations instead (csv, parquet, sto, mcap): they hold every sensor, "
                "tables also the rotation across each joint.",
                why=layout.no_hand,
            )
        return chosen

    def target(self, take: Path, content: Content) -> Path:
        """Where the file of a take lies unless somebody says otherwise: beside it."""
        if self.ending:
            return take.with_name(take.stem + self.ending)
        several = len(self.contents) > 1
        return take.with_suffix(f".{content}.{self.name}" if several else f".{self.name}")

    def facts(self, part: Part) -> dict[str, Any]:
        """What the file tells of how the format holds the motion."""
        told: dict[str, Any] = {"format": self.name}
        if self.axes:
            told["axes"] = self.axes if part.root is None else _in_a_room(self.axes)
        if self.even:
            told |= frames_of(part).facts()
        if self.fills_gaps:
            told["in_gaps"] = "the pose before is held: the format knows no gaps"
            if part.root is not None:
                told["without_a_place"] = "the place before is held, at first the first one"
        return told | self.more(part)

    def _first(self, layout: Layout) -> Content:
        possible = [each for each in self.contents if layout.is_hand or each in _WITHOUT_A_HAND]
        return possible[0] if possible else self.contents[0]


_WITHOUT_A_HAND: tuple[Content, ...] = ("orientations", "motion")
_TABLES: tuple[Content, ...] = ("angles", "orientations", "segments", "positions")
_OURS = "z up, x to magnetic north, y to the west"
_Y_UP = "y up, x to magnetic north, z to the east"


def _in_a_room(axes: str) -> str:
    """What is told of axes that are a tracker's."""
    turned = "the tracker's room turned: its (x, y, z) is written as (x, z, -y)"
    return axes.replace(_OURS, "the tracker's room").replace(_Y_UP, turned)


FORMATS: dict[str, Format] = {
    each.name: each
    for each in (
        Format("csv", _TABLES, csv.write),
        Format("parquet", _TABLES, parquet.write),
        Format("mot", ("angles",), opensim.write_mot, more=opensim.left_out),
        Format("sto", ("orientations",), opensim.write_sto, axes=f"{_OURS} ({opensim.TO_OPENSIM})"),
        Format("trc", ("positions",), trc.write, axes=f"{_OURS}; millimetres", even=True),
        Format("c3d", ("positions",), c3d.write, axes=f"{_OURS}; millimetres", even=True),
        Format(
            "bvh",
            ("skeleton",),
            bvh.write,
            axes=f"{_Y_UP}; centimetres",
            even=True,
            fills_gaps=True,
        ),
        Format("glb", ("skeleton",), glb.write, axes=f"{_Y_UP}; metres", fills_gaps=True),
        Format(
            "glb-skin",
            ("skeleton",),
            glb.write_skin,
            axes=f"{_Y_UP}; metres",
            fills_gaps=True,
            ending=".skin.glb",
        ),
        Format(
            "mcap", ("motion",), mcap.write, axes=f"{_OURS}; metres", ending=VIEW, more=mcap.places
        ),
        Format("svg", ("angles",), svg.write),
    )
}


def format_named(name: str) -> Format:
    """A format by its name.

    Raises:
        SetupError: there is none of this name.
    """
    if name not in FORMATS:
        raise SetupError(
            "There is no format {name!r}.",
            "Choose one of: {known}.",
            name=name,
            known=", ".join(FORMATS),
        )
    return FORMATS[name]
