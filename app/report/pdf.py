"""A report on paper: the page printed to PDF by a Chromium that is on the machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from handstudio.errors import HandstudioError

VARIABLE = "HANDSTUDIO_CHROMIUM"
"""Environment variable that names the browser."""

_NAMES = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"),
    *("microsoft-edge", "msedge"),
)
_PATIENCE_S = 120.0


def save_pdf(page: Path, target: Path) -> Path:
    """Print a page that is on disk.

    Raises:
        HandstudioError: there is no browser to print with, or it does not print.
    """
    browser = find_browser()
    if browser is None:
        raise HandstudioError(
            "No Chromium, Chrome or Edge was found to print with; the page is {page}.",
            "Open it in any browser and print it to PDF, or name one in HANDSTUDIO_CHROMIUM.",
            page=page,
        )
    with tempfile.TemporaryDirectory(prefix="handstudio-print-") as profile:
        command = [
            browser,
            "--headless",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--no-pdf-header-footer",
            "--virtual-time-budget=4000",
            f"--user-data-dir={profile}",
            f"--print-to-pdf={target.resolve()}",
            *(["--no-sandbox"] if sys.platform != "win32" and os.geteuid() == 0 else []),
            page.resolve().as_uri(),
        ]
        reason = _run(command)
    if not target.is_file() or target.read_bytes()[:5] != b"%PDF-":
        raise HandstudioError(
            "{browser} did not print the report ({reason}).",
            "Open {page} in a browser and print it to PDF.",
            browser=browser,
            reason=reason,
            page=page,
        )
    return target


def find_browser() -> str | None:
    """The Chromium of this machine: the one that is named, else what is on the path."""
    named = os.environ.get(VARIABLE)
    if named:
        return shutil.which(named)
    return next((found for name in _NAMES if (found := shutil.which(name))), None)


def _run(command: list[str]) -> str:
    with suppress(OSError):
        Path(command[-2].removeprefix("--print-to-pdf=")).unlink(missing_ok=True)
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_PATIENCE_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    return (done.stderr.strip().splitlines() or [f"code {done.returncode}"])[-1]
