#!/usr/bin/env python3
"""Start, test or otherwise use handstudio from a checkout.

  python3 run.py studio [options]        the studio in the browser (alone: with the virtual glove)
  python3 run.py test [pytest options]   style, types, room contract and all tests
  python3 run.py COMMAND [options]       any other command of handstudio, e.g. `--help` or `devices`

The first start makes `.venv` here, with the locked packages; that takes a minute or two and a few
hundred MB. Later starts take no time, until the lock changes. Needs Python 3.11 or newer.
"""

# This file alone must also be understood by an old Python, to be able to say so or to find a newer
# one: standard library only, nothing newer than Python 3.7 outside annotations.
from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
WINDOWS = os.name == "nt"
BIN = VENV / ("Scripts" if WINDOWS else "bin")
PYTHON = BIN / ("python.exe" if WINDOWS else "python")

# Written last and removed first: where it stands, the installation below it is whole.
MARKER = VENV / "handstudio-setup.json"
LOCKS = {"run": "requirements.txt", "dev": "requirements-dev.txt"}

OLDEST = (3, 11)
NEWER_PYTHONS = ("python3.13", "python3.12", "python3.11")

CHROMIUM_COMMANDS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "msedge",
)
CHROMIUM_PLACES = (
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"%ProgramFiles%\Google\Chrome\Application\chrome.exe",
    r"%ProgramFiles(x86)%\Google\Chrome\Application\chrome.exe",
    r"%LocalAppData%\Google\Chrome\Application\chrome.exe",
    r"%LocalAppData%\Chromium\Application\chrome.exe",
    r"%ProgramFiles(x86)%\Microsoft\Edge\Application\msedge.exe",
    r"%ProgramFiles%\Microsoft\Edge\Application\msedge.exe",
)


class SetupError(Exception):
    """Nothing more can be done here; the sentence says what the person can do."""


def main(arguments: list[str]) -> int:
    """Do what the command line asks and return the exit code."""
    if not arguments or arguments[0] in ("-h", "--help"):
        print(__doc__.strip())
        return 0
    try:
        if sys.version_info < OLDEST:  # an old Python is why this line is here
            return run_with_a_newer_python(arguments)
        command, options = arguments[0], arguments[1:]
        if command == "test":
            set_up("dev")
            return test(options)
        set_up("run")
        if command == "studio" and not options:
            options = ["--virtual"]
        return become([BIN / ("handstudio.exe" if WINDOWS else "handstudio"), command, *options])
    except SetupError as reason:
        print(f"run.py: {reason}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nrun.py: interrupted.", file=sys.stderr)
        return 130


# --- the right Python -----------------------------------------------------------------------------


def run_with_a_newer_python(arguments: list[str]) -> int:
    """Start over with the first Python on PATH that is new enough."""
    for name in NEWER_PYTHONS:
        found = shutil.which(name)
        if found and is_new_enough(found):
            return become([found, __file__, *arguments])
    here, wanted = (".".join(map(str, version[:2])) for version in (sys.version_info, OLDEST))
    raise SetupError(
        f"this is Python {here}, handstudio needs {wanted} or newer, and none of "
        f"{', '.join(NEWER_PYTHONS)} is on PATH.\n"
        f"Install one of them (your package manager, or python.org), then run this again."
    )


def is_new_enough(python: str) -> bool:
    """Ask the interpreter itself: a name on PATH may be an empty shim."""
    question = f"import sys; sys.exit(sys.version_info < {OLDEST})"
    return quiet([python, "-c", question]).returncode == 0


# --- .venv ----------------------------------------------------------------------------------------


def set_up(kind: str) -> None:
    """Make `.venv` hold the locked packages of this kind ("run" or "dev") and the project."""
    marker = read_marker()
    wanted = {"root": str(ROOT), **{each: digest(lock) for each, lock in LOCKS.items()}}
    if marker.get("root") == wanted["root"] and marker.get(kind) == wanted[kind]:
        return

    print(f"Setting up {VENV} (once; a minute or two) ...", flush=True)
    # A venv without a marker was interrupted, one with another root was moved: neither is trusted.
    if marker.get("root") != wanted["root"]:
        make_venv()
    if MARKER.exists():
        MARKER.unlink()
    install(LOCKS[kind])
    if kind == "run":
        del wanted["dev"]  # the development lock holds all of the other one, not the reverse
    write_marker(wanted)
    print("Set up.", flush=True)


def digest(lock: str) -> str:
    """Identify what an installation is made from."""
    catalogues = sorted(ROOT.glob("app/locale/*/LC_MESSAGES/*.po"))  # they are compiled then
    parts = (ROOT / lock, ROOT / "pyproject.toml", *catalogues)
    for part in parts:
        if not part.is_file():
            raise SetupError(f"{part} is missing. Is this a whole checkout? `git status` tells.")
    return hashlib.sha256(b"\0".join(part.read_bytes() for part in parts)).hexdigest()


def read_marker() -> dict[str, str]:
    """What `.venv` was last set up from; nothing when it is not whole."""
    try:
        marker = json.loads(MARKER.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    # The link to an interpreter that has since been uninstalled does not count as existing.
    return marker if isinstance(marker, dict) and PYTHON.exists() else {}


def write_marker(marker: dict[str, str]) -> None:
    """Write it whole or not at all."""
    draft = MARKER.with_suffix(".new")
    draft.write_text(json.dumps(marker, indent=1), encoding="utf-8")
    draft.replace(MARKER)


def make_venv() -> None:
    """Make an empty `.venv`, with pip."""
    if importlib.util.find_spec("ensurepip") is None:
        install_ensurepip()
    # The interpreter below, should this one be that of a venv (perhaps the one to be cleared).
    python = getattr(sys, "_base_executable", None) or sys.executable
    must([python, "-m", "venv", "--clear", VENV], "no virtual environment could be made")


def install_ensurepip() -> None:
    """Debian and Ubuntu keep the part of Python that makes venvs in a package of its own."""
    package = "python{}.{}-venv".format(*sys.version_info[:2])
    if not can_apt():
        raise SetupError(
            f"this Python cannot make virtual environments (ensurepip is missing).\n"
            f"On Debian and Ubuntu: sudo apt-get install {package}\nThen run this again."
        )
    print(f"This Python lacks ensurepip: installing the Debian package {package}.", flush=True)
    apt_install(package)


def install(lock: str) -> None:
    """Install the locked packages, every file checked against its hash, then the project."""
    pip: list[str | Path] = [PYTHON, "-m", "pip", "--disable-pip-version-check", "--no-input"]
    pip.append("install")
    if not sys.stdout.isatty():
        pip += ["--progress-bar", "off"]
    advice = "is there a network? Run the same command again to go on"
    must([*pip, "--require-hashes", "-r", ROOT / lock], "the packages were not installed", advice)
    must(
        [*pip, "--quiet", "--no-deps", "--no-build-isolation", "-e", ROOT],
        "handstudio itself was not installed",
    )


# --- tests ----------------------------------------------------------------------------------------

NO_TESTS = 5
"""What pytest ends with where the options leave no test, which is no failure."""


def test(options: list[str]) -> int:
    """Run every check, also after one failed, and say at the end which did."""
    os.environ["HANDSTUDIO_CHROMIUM"] = find_chromium()
    # two workers on two cores: small equations take ten times as long where their threads wait
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    checks = {
        "ruff check": ["ruff", "check", "."],
        "ruff format": ["ruff", "format", "--check", "."],
        "mypy": ["mypy"],
        "lint-imports": ["lint-imports"],
        "pytest": ["pytest", "-n", "2", "-m", "not browser", *options],
        # by themselves: a software-rendered page leaves nothing to a test beside it
        "browser tests": ["pytest", "-m", "browser", *options],
    }
    failed = []
    for name, (program, *rest) in checks.items():
        print(f"\n=== {name}", flush=True)
        fine = {0, NO_TESTS} if program == "pytest" else {0}
        if run([BIN / program, *rest]) not in fine:
            failed.append(name)
    print(f"\nFAILED: {', '.join(failed)}" if failed else "\nAll checks passed.", flush=True)
    return 1 if failed else 0


def find_chromium() -> str:
    """A Chromium, Chrome or Edge for the browser tests; installs one if there is none."""
    chosen = os.environ.get("HANDSTUDIO_CHROMIUM")
    if chosen:
        if not Path(chosen).is_file():
            raise SetupError(
                f"HANDSTUDIO_CHROMIUM is {chosen}, and no such file exists. Correct it."
            )
        return chosen
    return present_chromium() or install_chromium()


def present_chromium() -> str | None:
    """The first one found: on PATH, in the usual places, then playwright's own."""
    for command in CHROMIUM_COMMANDS:
        found = shutil.which(command)
        if found:
            return found
    for place in CHROMIUM_PLACES:
        expanded = os.path.expandvars(place)
        if Path(expanded).is_file():
            return expanded
    return playwright_chromium()


def playwright_chromium() -> str | None:
    """The browser that playwright has downloaded, if it has."""
    question = (
        "from playwright.sync_api import sync_playwright\n"
        "with sync_playwright() as it: print(it.chromium.executable_path)"
    )
    answer = quiet([PYTHON, "-c", question]).stdout.strip()
    return answer if answer and Path(answer).is_file() else None


def install_chromium() -> str:
    """Get a browser from the system's packages as root, else from playwright."""
    print("No Chromium, Chrome or Edge found for the browser tests: installing one.", flush=True)
    if can_apt() and run_apt("chromium"):
        found = present_chromium()
        if found:
            return found
    run([PYTHON, "-m", "playwright", "install", "chromium"])
    found = playwright_chromium()
    if found:
        return found
    raise SetupError(
        "no browser for the tests was found, and none could be installed.\n"
        "Install Chromium, Chrome or Edge (Debian: sudo apt-get install chromium), or set\n"
        "HANDSTUDIO_CHROMIUM to the full path of one, then run this again."
    )


# --- commands -------------------------------------------------------------------------------------


def can_apt() -> bool:
    """Whether Debian packages can be installed without asking anybody."""
    return hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get") is not None


def apt_install(package: str) -> None:
    """Install a Debian package or stop."""
    if not run_apt(package):
        raise SetupError(
            f"`apt-get install {package}` failed; its reason is above. Then run this again."
        )


def run_apt(package: str) -> bool:
    """Install a Debian package; tell whether that worked."""
    os.environ["DEBIAN_FRONTEND"] = "noninteractive"
    run(["apt-get", "update", "-qq"])
    return run(["apt-get", "install", "-y", "-qq", "--no-install-recommends", package]) == 0


def run(command: list[str | Path]) -> int:
    """Run a command in the checkout and return its exit code."""
    process = subprocess.Popen([str(part) for part in command], cwd=str(ROOT))
    try:
        return process.wait()
    except KeyboardInterrupt:
        # The terminal has told the child as well: let it tidy up and speak before we go.
        process.wait()
        raise


def must(command: list[str | Path], problem: str, advice: str = "the reason is above") -> None:
    """Run a command that has to succeed."""
    code = run(command)
    if code != 0:
        raise SetupError(f"{problem} (exit code {code}): {advice}.")


def quiet(command: list[str | Path]) -> subprocess.CompletedProcess[str]:
    """Run a command for its answer only."""
    return subprocess.run(
        [str(part) for part in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=False,
    )


def become(command: list[str | Path]) -> int:
    """Hand over to a command, so that Ctrl-C and other signals reach it and nobody else."""
    words = [str(part) for part in command]
    if not Path(words[0]).exists():
        raise SetupError(f"{words[0]} is missing. Delete {VENV} and run this again.")
    if not WINDOWS:
        sys.stdout.flush()
        os.execv(words[0], words)
    # Windows cannot replace a process: wait, and leave Ctrl-C to the child.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return subprocess.call(words)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
