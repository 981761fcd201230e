"""What was written and grasped in a take stays beside its motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from handstudio.analysis.grasps import GraspSegment, Recognised
from handstudio.analysis.object_size import ObjectSize
from handstudio.analysis.pen_tip import Plane
from handstudio.analysis.take_grasps import TakenGrasp
from handstudio.analysis.writing import Writing
from handstudio.finds import Found, finds, kept_finds
from handstudio.process import process
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take


def some() -> Found:
    """A line of writing, a thing of a known size and one of none."""
    rng = np.random.default_rng(3)
    time_s, down = np.linspace(1.0, 2.0, 21), rng.random(21) > 0.3
    axes, origin = rng.random((2, 3)), rng.random(3)
    wrote = Writing(
        *(time_s, rng.random((21, 3)), rng.random((21, 3)), down),
        *(Plane(rng.random(3), 0.1), axes, rng.random((21, 2)), origin),
        *(0.0004, 0.0003, rng.random(3)),
    )
    known = Recognised("power_sphere", "Power Sphere", 1.0 / 3.0, 0.4, "tripod")
    size = ObjectSize("sphere", 0.07, 0.001, 0.002, rng.random(3), rng.random(3))
    times = GraspSegment(known, 3.0, 3.1, 4.0, 4.1)
    return Found((wrote,), (TakenGrasp(times, size), TakenGrasp(times, None)))


def test_what_was_found_is_kept_to_the_last_bit_and_not_searched_for_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    take = open_take(simulate(tmp_path, rehearse(seed=5), seconds=2.0))
    process(take)
    assert kept_finds(take) is None
    expected = some()
    monkeypatch.setattr("handstudio.finds.found_in", lambda *_asked: expected)
    finds(take)
    monkeypatch.setattr("handstudio.finds.found_in", None)
    for found in (finds(take), kept_finds(take)):
        assert found is not None
        ((wrote,), (sized, bare)) = found.writings, found.grasps
        for name in Writing.__slots__:
            if name != "plane":
                np.testing.assert_array_equal(
                    getattr(wrote, name), getattr(expected.writings[0], name)
                )
        np.testing.assert_array_equal(wrote.plane.normal, expected.writings[0].plane.normal)
        assert bare == expected.grasps[1]
        assert sized.segment == bare.segment
        assert sized.size is not None
        np.testing.assert_array_equal(sized.size.axis, expected.grasps[0].size.axis)
        np.testing.assert_array_equal(
            sized.size.t_hand_middle, expected.grasps[0].size.t_hand_middle
        )
    (kept,) = take.path.with_suffix(".motion").glob("*/finds.npz")
    kept.write_bytes(kept.read_bytes()[:300])
    assert kept_finds(take) is None
