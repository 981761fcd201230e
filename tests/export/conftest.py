"""Takes to export: of a left hand, of no hand, and one with a gap; and other people's readers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from handstudio.export.export import export
from handstudio.export.formats import FORMATS
from handstudio.export.part import Content, Processed, Window
from handstudio.kinematics import pose_of
from handstudio.layout import JointPlace, Layout, SensorPlace
from handstudio.pipeline import Motion, unsure
from handstudio.process import process
from handstudio.recording.header import Header
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import Take, open_take
from handstudio.recording.writer import TakeWriter
from handstudio.setup import HandModel, Setup


@pytest.fixture(scope="session")
def recorded(tmp_path_factory) -> Take:
    """Six seconds of a left virtual glove: rest, then the forearm raised and a fist begun."""
    folder = tmp_path_factory.mktemp("recorded")
    hand = HandModel(hand_length_m=0.175)
    return open_take(
        simulate(
            folder,
            rehearse(seed=1, side="left", hand_length_m=hand.hand_length_m),
            seconds=6.0,
            health=True,
        )
    )


@pytest.fixture(scope="session")
def motion(recorded) -> Motion:
    return process(recorded)


@pytest.fixture
def door(tmp_path) -> tuple[Take, Motion]:
    """A take without a hand: two sensors of a door, one joint; the motion is made up."""
    places = (SensorPlace("leaf, inner", "door"), SensorPlace("frame", "wall"))
    layout = Layout("unknown", places, (JointPlace("hinge", "wall", "door", 1),))
    header = Header("door", "S01", 10**18, Setup(layout, 50.0), "samples", "by hand")
    take = open_take(TakeWriter(tmp_path / "door.mcap", header).close())
    rng = np.random.default_rng(2)
    q = rng.normal(size=(5, 2, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    doubt = np.array([[0, 0], [1, 0], [3, 8], [0, 4], [0, 0]], dtype=np.uint8)
    time_us = np.array([5_000_000, 5_020_000, 5_040_001, 5_100_000, 5_120_000])
    return take, Motion(time_us, q, np.full((5, 4), np.nan), doubt, unsure(doubt))


GAP = slice(300, 340)
"""Instants that are missing in `gappy`."""


def without(motion: Motion, part: slice) -> Motion:
    """A motion without some of its instants."""
    kept = np.delete(np.arange(len(motion)), part)
    return Motion(*(np.asarray(getattr(motion, name))[kept] for name in Motion.__slots__))


@pytest.fixture(scope="session")
def whole(recorded, motion) -> Processed:
    """The left hand from its first instant to its last."""
    return Processed(recorded, recorded.header.setup, motion)


@pytest.fixture(scope="session")
def gappy(recorded, motion) -> Processed:
    """The same with four tenths of a second missing."""
    return Processed(recorded, recorded.header.setup, without(motion, GAP))


@pytest.fixture(scope="session")
def points(whole) -> np.ndarray:
    """Joints, then fingertips, by our own formula [mm], (n, p, 3)."""
    pose = pose_of(whole.setup, whole.motion.q_world_sensor)
    return np.concatenate([pose.t_world_joint, pose.t_world_tip], axis=1) * 1e3


@dataclass(frozen=True)
class Into:
    """``into("c3d", source)``: the file, written to a folder of the test's own."""

    folder: Path

    def __call__(
        self,
        name: str,
        source: Processed,
        content: Content | None = None,
        angles: tuple[str, ...] = (),
        **window: float,
    ) -> Path:
        """An export of a part, or of the whole."""
        target, part = self.folder / f"out.{name}", Window(**window)
        chosen = FORMATS[name]
        return export(source, target, chosen, content=content, window=part, angles=angles)


@pytest.fixture
def into(tmp_path) -> Into:
    return Into(tmp_path)
