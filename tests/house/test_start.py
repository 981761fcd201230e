"""What a start of the shell or of the studio does not wait for."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("scipy", "numba", "trimesh", "pyarrow", "matplotlib")
"""Libraries that take a tenth of a second to two seconds to load; they come where they are used."""


@pytest.mark.parametrize("module", ["handstudio.cli", "app.__main__"])
def test_a_start_loads_no_heavy_library(module):
    code = f"import sys, {module}; print(*sorted({set(HEAVY)} & set(sys.modules)))"
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert told.stdout.split() == []
