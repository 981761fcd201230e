"""What all tests share: shape checks, long and real tests, seeded hypotheses."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import hypothesis
import jaxtyping
import pytest

DATA_VARIABLE = "HANDSTUDIO_DATA"

_SHAPES, _SHAPES_VARIABLE = "--shapes", "HANDSTUDIO_TEST_SHAPES"
if _SHAPES in sys.argv:
    os.environ[_SHAPES_VARIABLE] = "1"  # for the processes that share the work
if os.environ.get(_SHAPES_VARIABLE):
    # Here, as conftests in folders below are read before pytest is configured, and import much.
    # From here on every annotated call into handstudio is checked; a compiled kernel (numba) opts
    # out with ``@typing.no_type_check`` below ``@compiled``.
    jaxtyping.install_import_hook("handstudio", "beartype.beartype")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="also run the tests that take minutes")
    parser.addoption(
        _SHAPES,
        action="store_true",
        help="also check every call against the shapes and types it declares (twice the time)",
    )


def pytest_configure(config: pytest.Config) -> None:
    # The same examples everywhere and every time: a failure in CI is a failure at the desk.
    hypothesis.settings.register_profile(
        "everywhere",
        derandomize=True,
        deadline=None,  # a busy machine is no bug
        max_examples=100 if config.getoption("--long") else 25,
    )
    hypothesis.settings.load_profile("everywhere")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        if item.get_closest_marker("long") and not config.getoption("--long"):
            item.add_marker(pytest.mark.skip(reason="takes minutes: run with --long"))
        if item.get_closest_marker("real") and not os.environ.get(DATA_VARIABLE):
            item.add_marker(pytest.mark.skip(reason=_no_data()))


@pytest.fixture(scope="session", autouse=True)
def settings_of_tests(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """No test touches what the studio remembers for the person who runs it."""
    with pytest.MonkeyPatch.context() as patch:
        file = tmp_path_factory.mktemp("settings") / "settings.json"
        patch.setenv("HANDSTUDIO_SETTINGS", str(file))
        yield


@pytest.fixture(scope="session", autouse=True)
def log_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """No test writes into the log of the person who runs it; where those of the tests are."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("log")
        patch.setenv("HANDSTUDIO_LOG", str(folder))
        yield folder


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of recordings of real sensors (they are not part of the project)."""
    chosen = os.environ.get(DATA_VARIABLE)
    if not chosen:
        pytest.skip(_no_data())
    folder = Path(chosen)
    if not folder.is_dir():
        pytest.fail(f"{DATA_VARIABLE} is {folder}, which is no folder. Correct or unset it.")
    return folder


def _no_data() -> str:
    return f"needs recordings of real sensors: set {DATA_VARIABLE} to their folder"


@pytest.fixture
def limit_of_file_size() -> Callable[[int], AbstractContextManager[None]]:
    """As long as it lasts no file may grow beyond so many bytes; not on Windows."""
    return _limited


@contextmanager
def _limited(size: int) -> Iterator[None]:
    import resource  # noqa: PLC0415 - not on Windows

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
