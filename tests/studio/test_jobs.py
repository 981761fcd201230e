"""Long work in a process of its own: how far it is, and stopping it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from app.work.jobs import Jobs, Stopped
from handstudio.process import kept_motion
from handstudio.recording.simulated import simulate
from handstudio.recording.take import open_take


@pytest.fixture
def jobs() -> Iterator[Jobs]:
    jobs = Jobs()
    yield jobs
    jobs.close()


def test_work_is_done_and_kept(jobs: Jobs, tmp_path: Path) -> None:
    path = simulate(tmp_path, seconds=3.0)
    jobs.process(path).result(timeout=60)
    assert jobs.share_done == 1.0
    assert kept_motion(open_take(path)) is not None


def test_work_that_is_stopped_leaves_nothing_half_done(jobs: Jobs, tmp_path: Path) -> None:
    path = simulate(tmp_path, seconds=30.0)
    work = jobs.process(path)
    jobs.cancel()
    with pytest.raises(Stopped):
        work.result(timeout=60)
    assert kept_motion(open_take(path)) is None
    assert not list(path.parent.glob("*.motion/*"))
    jobs.process(path).result(timeout=60)  # and can be begun again
    assert kept_motion(open_take(path)) is not None
