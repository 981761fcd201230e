from __future__ import annotations

import numpy as np
import pytest

from .hinges import Hinge, hinge


@pytest.fixture(scope="session")
def noisy() -> Hinge:
    return hinge(1e-4, np.deg2rad(0.1))
