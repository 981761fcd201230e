"""A take of the showcase, processed once."""

from __future__ import annotations

from pathlib import Path

import pytest

from app import review as reviewing
from app.review import Review
from handstudio.process import process
from handstudio.recording.simulated import simulate
from handstudio.recording.take import Take, open_take


@pytest.fixture(scope="session")
def take(tmp_path_factory: pytest.TempPathFactory) -> Take:
    path: Path = simulate(tmp_path_factory.mktemp("sessions"), seconds=8.0, seed=2)
    return open_take(path)


@pytest.fixture(scope="session")
def review(take: Take) -> Review:
    return reviewing.opened(take, process(take))
