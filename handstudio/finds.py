"""What was written and grasped in a take, searched for once and kept beside its motion."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import msgspec
import numpy as np

from handstudio.analysis.grasps import GraspSegment
from handstudio.analysis.object_size import Form, ObjectSize
from handstudio.analysis.pen_tip import Plane
from handstudio.analysis.take_grasps import TakenGrasp, can_tell_grasps, grasps_in
from handstudio.analysis.take_writing import can_tell_writing, writings_in
from handstudio.analysis.writing import Writing
from handstudio.arrays import Array
from handstudio.pipeline import Motion
from handstudio.process import Progress, kept_folder, process
from handstudio.recording.take import Take
from handstudio.setup import Setup

_VERSION = 1
_ARRAYS = ("time_s", "tip", "direction", "down", "axes", "flat", "origin", "tip_sd_m")


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Times are in seconds from the take's first instant."""

    writings: tuple[Writing, ...] = ()
    grasps: tuple[TakenGrasp, ...] = ()

    def writing_at(self, seconds: float) -> Writing | None:
        """The one that is going on, else the last one that was written."""
        begun = [writing for writing in self.writings if writing.time_s[0] <= seconds]
        return begun[-1] if begun else None

    def grasp_at(self, seconds: float) -> TakenGrasp | None:
        """The one that is going on."""
        for grasp in self.grasps:
            if grasp.segment.start_s <= seconds <= grasp.segment.end_s:
                return grasp
        return None


def finds(
    take: Take, setup: Setup | None = None, progress: Progress = lambda _share: None
) -> Found:
    """What was written and grasped in a take, as its motion by its own setup or another tells.

    Raises:
        TakeError: the take is damaged, or the disk does not take the motion.
        SetupError: the stored state does not fit this version.
    """
    motion = process(take, setup, progress=progress)
    kept = kept_finds(take, setup)
    if kept is not None:
        return kept
    found = found_in(setup or take.header.setup, motion)
    with suppress(OSError):  # a full disk: it is searched for again the next time
        _keep(_path(take, setup), found)
    return found


def kept_finds(take: Take, setup: Setup | None = None) -> Found | None:
    """What was found where it was searched for before, else None."""
    try:
        with _path(take, setup).open("rb") as stream, np.load(stream) as file:
            told = msgspec.json.decode(file["told"].tobytes(), type=_Told)
            if told.version != _VERSION:
                return None
            writings = tuple(_writing(one, i, file) for i, one in enumerate(told.writings))
    except (OSError, KeyError, ValueError, EOFError, BadZipFile):
        return None
    return Found(writings, tuple(one.grasp for one in told.grasps))


def found_in(setup: Setup, motion: Motion) -> Found:
    """All of it; nothing of what the layout cannot tell."""
    writings = writings_in(setup, motion) if can_tell_writing(setup.layout) else []
    if not can_tell_grasps(setup.layout):
        return Found(tuple(writings))
    return Found(tuple(writings), tuple(grasps_in(setup, motion, writings=writings)))


class _Size(msgspec.Struct):
    form: Form
    diameter_m: float
    sd_m: float
    residual_m: float
    t_hand_middle: list[float]
    axis: list[float]


class _Grasp(msgspec.Struct):
    segment: GraspSegment
    size: _Size | None

    @property
    def grasp(self) -> TakenGrasp:
        size = self.size
        if size is None:
            return TakenGrasp(self.segment, None)
        middle, axis = np.array(size.t_hand_middle), np.array(size.axis)
        figures = size.diameter_m, size.sd_m, size.residual_m
        return TakenGrasp(self.segment, ObjectSize(size.form, *figures, middle, axis))


class _Written(msgspec.Struct):
    """What is no array of a writing; these stand beside it under its number."""

    normal: list[float]
    distance_m: float
    height_sd_m: float
    rigid_sd_m: float


class _Told(msgspec.Struct):
    writings: list[_Written]
    grasps: list[_Grasp]
    version: int = _VERSION


def _keep(path: Path, found: Found) -> None:
    written = [
        _Written(one.plane.normal.tolist(), one.plane.distance_m, one.height_sd_m, one.rigid_sd_m)
        for one in found.writings
    ]
    told = msgspec.json.encode(_Told(written, [_of(grasp) for grasp in found.grasps]))
    arrays = {
        f"{name}-{i}": getattr(one, name)
        for i, one in enumerate(found.writings)
        for name in _ARRAYS
    }
    fresh = path.with_name(path.name + ".new")
    with fresh.open("wb") as file:
        np.savez(file, told=np.frombuffer(told, dtype=np.uint8), **arrays)
    fresh.replace(path)


def _of(grasp: TakenGrasp) -> _Grasp:
    size = grasp.size
    if size is None:
        return _Grasp(grasp.segment, None)
    figures = size.diameter_m, size.sd_m, size.residual_m
    places = size.t_hand_middle.tolist(), size.axis.tolist()
    return _Grasp(grasp.segment, _Size(size.form, *figures, *places))


def _writing(told: _Written, number: int, file: dict[str, Array]) -> Writing:
    return Writing(
        plane=Plane(np.array(told.normal), told.distance_m),
        height_sd_m=told.height_sd_m,
        rigid_sd_m=told.rigid_sd_m,
        **{name: file[f"{name}-{number}"] for name in _ARRAYS},
    )


def _path(take: Take, setup: Setup | None) -> Path:
    return kept_folder(take, setup) / "finds.npz"
