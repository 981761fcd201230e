"""Compiling aside."""

from __future__ import annotations

import os
import subprocess
import sys

from app.work.preparing import Preparation

_AT_START = """
import sys, app.__main__, app.studio, app.server
assert "numba" not in sys.modules
"""


def test_the_page_starts_without_the_compiler() -> None:
    subprocess.run([sys.executable, "-c", _AT_START], check=True, env=dict(os.environ))


def test_it_gets_ready_by_itself() -> None:
    preparation = Preparation()
    try:
        assert not preparation.ready
        preparation.process.join(120.0)
        assert not preparation.failed
        assert preparation.ready or preparation.loaded.wait(60.0)
        assert preparation.ready
    finally:
        preparation.close()
