"""The house itself: papers, locks and the wheel are as promised."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from handstudio import __version__

ROOT = Path(__file__).resolve().parents[2]
LOCKS = ["requirements.txt", "requirements-dev.txt"]

# Put together here, so that this file does not name them either.
REGISTRIES = [
    "pypi" + ".org",
    "pypi" + ".python.org",
    "python" + "hosted.org",
    "pypa" + ".io",
    "conda" + ".anaconda.org",
    "npmjs" + ".com",
    "npmjs" + ".org",
    "unpkg" + ".com",
    "jsdelivr" + ".net",
]


@pytest.mark.parametrize("name", ["LICENSE", "CHANGELOG.md", "CONTRIBUTING.md"])
def test_the_papers_are_there(name: str) -> None:
    assert (ROOT / name).stat().st_size > 500


def test_no_committed_file_names_a_registry() -> None:
    found = [
        f"{path}: {registry}"
        for path in _committed_files()
        for registry in REGISTRIES
        if registry.encode() in (ROOT / path).read_bytes()
    ]
    assert not found


@pytest.mark.parametrize("lock", LOCKS)
def test_every_locked_requirement_has_an_exact_version_and_hashes(lock: str) -> None:
    requirements = _requirements(lock)
    assert len(requirements) > 20
    for requirement in requirements:
        assert re.match(r"[a-z0-9-]+==\d", requirement), requirement
        assert "--hash=sha256:" in requirement, requirement


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_names_no_place(lock: str) -> None:
    text = (ROOT / lock).read_text()
    assert "://" not in text
    assert " @ " not in text
    assert not re.search(r"^\s*-(?!-hash)", text, re.MULTILINE), "an option such as --index-url"


def test_the_development_lock_holds_the_whole_other_one() -> None:
    plain, development = (set(map(_name_and_version, _requirements(lock))) for lock in LOCKS)
    assert plain <= development


def test_the_locks_hold_what_the_project_asks_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    for lock, asked in [
        ("requirements.txt", project["dependencies"] + extras["build"]),
        ("requirements-dev.txt", project["dependencies"] + extras["build"] + extras["dev"]),
    ]:
        locked = {line.split("==")[0] for line in _requirements(lock)}
        missing = {_normal_name(each) for each in asked} - locked
        assert not missing, f"{lock} is stale: run .ci/lock"


def test_the_newest_heading_of_the_changelog_fits_the_version() -> None:
    headings = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    released = [heading for heading in headings if heading != "Unreleased"]
    assert headings[0] in ("Unreleased", __version__)
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", heading) for heading in released)
    assert not released or _version(released[0]) <= _version(__version__)
    assert sorted(released, key=_version, reverse=True) == released


@pytest.mark.long
def test_the_wheel_holds_the_packages_and_every_mesh(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"]
    subprocess.run([*command, "--wheel-dir", tmp_path, ROOT], check=True, stdin=subprocess.DEVNULL)
    (wheel,) = tmp_path.glob("handstudio-*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())

    meshes = {f"app/assets/meshes/{mesh.name}" for mesh in (ROOT / "assets/meshes").glob("*.ply")}
    assert meshes
    assert meshes <= names
    assert "handstudio/assets/meshes/hand.npz" in names
    assert {"handstudio/__init__.py", "app/__init__.py"} <= names
    assert not [name for name in names if name.startswith("assets") or "make_" in name]
    assert any(name.endswith("/licenses/LICENSE") for name in names)


def _committed_files() -> list[str]:
    listing = subprocess.run(
        ["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, text=True, check=False
    )
    if listing.returncode != 0:
        pytest.skip("not a git checkout, so there is no list of committed files")
    return [name for name in listing.stdout.split("\0") if name and (ROOT / name).is_file()]


def _requirements(lock: str) -> list[str]:
    """One string a requirement, its hashes included."""
    text = (ROOT / lock).read_text().replace("\\\n", " ")
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def _name_and_version(requirement: str) -> str:
    return requirement.split(maxsplit=1)[0]


def _normal_name(requirement: str) -> str:
    name = re.match(r"[A-Za-z0-9._-]+", requirement)
    assert name, requirement
    return re.sub(r"[._-]+", "-", name[0]).lower()


def _version(text: str) -> tuple[int, ...]:
    return tuple(map(int, text.split(".")))
