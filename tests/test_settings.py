"""What the studio remembers: whole, within limits, and never a reason not to start."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from handstudio.errors import SettingsError
from handstudio.settings import (
    LIMITS,
    QUIET_S,
    Settings,
    SettingsStore,
    Shown,
    load_settings,
    save_settings,
    settings_path,
)

NOW = datetime(2026, 3, 4, 12, 30, 5, tzinfo=UTC)
ONE = Settings(language="ja", theme="light", subject="患者2", shown=Shown(skin=True))
TWO = Settings(countdown_s=5.0, sounds=False, last_address="tcp:glove:9000")

DAMAGE = [b"", b"{", b"[]", b"5", b"\xff\xfe", b'{"subject": "\xff"}', b'{"a":' * 5000]


@pytest.fixture
def file(tmp_path) -> Path:
    return tmp_path / "config" / "settings.json"


def stored(file: Path) -> dict[str, Any]:
    return dict(msgspec.json.decode(file.read_bytes()))


def test_at_the_first_start_there_are_defaults_and_no_notice(file):
    assert load_settings(file) == load_settings(file)
    assert load_settings(file).settings == Settings()
    assert load_settings(file).notice is None
    assert not file.parent.exists()


def test_settings_live_where_one_chose_or_the_environment_says_or_with_the_user(
    tmp_path, monkeypatch
):
    assert settings_path(tmp_path / "x") == tmp_path / "x"
    assert settings_path() == Path(os.environ["HANDSTUDIO_SETTINGS"])
    monkeypatch.delenv("HANDSTUDIO_SETTINGS")
    assert settings_path().parts[-2:] == ("handstudio", "settings.json")


defaults = {
    **{name: st.floats(*limits) for name, limits in LIMITS.items()},
    "language": st.sampled_from(["", "en", "ja", "pt_BR"]),
}


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.builds(Settings, **defaults))
def test_what_is_kept_is_what_comes_back(file, chosen):
    save_settings(file, chosen)
    loaded = load_settings(file)
    assert (loaded.settings, loaded.notice) == (chosen, None)


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_file_is_kept_aside_and_the_one_before_is_read(file, damage):
    save_settings(file, ONE)
    save_settings(file, TWO)
    file.write_bytes(damage)
    loaded = load_settings(file, NOW)
    assert loaded.settings == ONE
    assert loaded.notice is not None
    assert "damaged" in loaded.notice.what
    kept = file.with_name("settings.broken-20260304-123005.json")
    assert str(kept) in loaded.notice.remedy
    assert kept.read_bytes() == damage
    again = load_settings(file, NOW)  # said once
    assert (again.settings, again.notice) == (ONE, None)
    save_settings(file, TWO)
    assert load_settings(file).settings == TWO


@pytest.mark.parametrize("damage", DAMAGE)
def test_where_both_are_damaged_there_are_defaults_and_both_are_kept(file, damage):
    save_settings(file, ONE)
    save_settings(file, TWO)
    for path in list(file.parent.iterdir()):
        path.write_bytes(damage)
    loaded = load_settings(file, NOW)
    assert loaded.settings == Settings()
    assert loaded.notice is not None
    assert [path.read_bytes() for path in file.parent.iterdir()] == [damage] * 2
    assert load_settings(file).notice is None


def test_a_file_that_cannot_be_read_stays_where_it_is(file):
    file.mkdir(parents=True)  # which nobody can read as a file
    loaded = load_settings(file)
    assert loaded.settings == Settings()
    assert loaded.notice is not None
    assert "cannot be read" in loaded.notice.what
    assert file.is_dir()


@pytest.mark.parametrize(
    ("name", "value", "used"),
    [
        ("countdown_s", -1, 0.0),
        ("countdown_s", 1e300, 30.0),
        ("countdown_s", "3", 3.0),
        ("countdown_s", None, 3.0),
        ("hand_length_mm", 0.19, 50.0),
        ("plot_span_s", 0, 1.0),
        ("sounds", "yes", True),
        ("theme", "pink", "dark"),
        ("side", "both", "right"),
        ("language", "../../etc", ""),
        ("subject", 5, ""),
        ("take_name", "x" * 501, "take"),
        ("shown", {"skin": 1}, Shown()),
        ("shown", [], Shown()),
    ],
)
def test_one_value_that_makes_no_sense_costs_itself_only(file, name, value, used):
    save_settings(file, ONE)
    file.write_bytes(msgspec.json.encode(stored(file) | {name: value}))
    loaded = load_settings(file)
    assert loaded.settings == msgspec.structs.replace(ONE, **{name: used})
    assert loaded.notice is not None
    assert name in loaded.notice.what


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.dictionaries(
        st.sampled_from(Settings.__struct_fields__) | st.text(max_size=5),
        st.recursive(
            st.none() | st.booleans() | st.integers(-(2**60), 2**60) | st.floats() | st.text(),
            lambda inner: st.lists(inner) | st.dictionaries(st.text(max_size=5), inner),
            max_leaves=5,
        ),
    )
)
def test_whatever_is_in_the_file_the_studio_starts_within_limits(file, values):
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(msgspec.json.encode(values))
    loaded = load_settings(file).settings
    assert msgspec.convert(msgspec.to_builtins(loaded), Settings) == loaded
    for name, (least, most) in LIMITS.items():
        assert least <= getattr(loaded, name) <= most


def test_what_a_newer_version_keeps_stays(file):
    save_settings(file, ONE)
    newer = stored(file) | {"glasses": "3-D"}
    newer["shown"]["muscles"] = True
    file.write_bytes(msgspec.json.encode(newer))
    loaded = load_settings(file)
    assert (loaded.settings, loaded.notice) == (ONE, None)
    save_settings(file, TWO)
    assert load_settings(file).settings == TWO
    assert stored(file)["glasses"] == "3-D"
    assert stored(file)["shown"] == {**msgspec.to_builtins(TWO.shown), "muscles": True}


def test_what_an_older_version_kept_is_read(file):
    file.parent.mkdir()
    file.write_text('{"subject": "S07", "shown": {"axes": true}}')
    loaded = load_settings(file)
    assert loaded.settings == Settings(subject="S07", shown=Shown(axes=True))
    assert loaded.notice is None


@pytest.mark.parametrize("moment", ["fsync", "replace"])
def test_a_crash_while_writing_leaves_the_settings_before(file, monkeypatch, moment):
    save_settings(file, ONE)
    with monkeypatch.context() as patch:
        patch.setattr(os, moment, _crash)
        with pytest.raises(KeyboardInterrupt):
            save_settings(file, TWO)
    assert load_settings(file).settings == ONE


# --- the store ------------------------------------------------------------------------------------


def test_changes_are_written_once_it_is_quiet(file):
    store = SettingsStore.opened(file)
    for now_s in (0.0, 0.75 * QUIET_S, 1.5 * QUIET_S):
        store.put(msgspec.structs.replace(ONE, countdown_s=now_s), now_s)
        store.tick(now_s)
    store.tick(2.25 * QUIET_S)
    assert not file.exists()
    store.tick(2.5 * QUIET_S)
    assert load_settings(file).settings == store.settings
    written = file.stat().st_mtime_ns, file.stat().st_ino
    store.tick(100.0)
    store.flush()
    assert (file.stat().st_mtime_ns, file.stat().st_ino) == written


def test_what_did_not_change_is_not_written(file):
    store = SettingsStore.opened(file)
    store.put(Settings(), 0.0)
    store.flush()
    assert not file.exists()


def test_at_the_end_what_changed_is_written_at_once(file):
    store = SettingsStore.opened(file)
    store.put(ONE, 0.0)
    store.flush()
    assert SettingsStore.opened(file).settings == ONE


def test_a_folder_that_takes_nothing_is_told_of_once_and_the_settings_go_on(tmp_path):
    home = tmp_path / "home"
    home.write_text("no folder")
    store = SettingsStore.opened(home / "settings.json")
    assert store.settings == Settings()
    store.take_notice()
    for number in range(3):
        store.put(msgspec.structs.replace(ONE, countdown_s=float(number)), 0.0)
        store.flush()
        notice = store.take_notice()
        assert (notice is not None) == (number == 0)
    assert store.settings.countdown_s == 2.0
    home.unlink()
    store.put(ONE, 0.0)
    store.flush()
    assert load_settings(home / "settings.json").settings == ONE


def test_a_notice_is_given_once(file):
    file.parent.mkdir()
    file.write_bytes(b"{")
    store = SettingsStore.opened(file)
    assert isinstance(store.take_notice(), SettingsError)
    assert store.take_notice() is None


def _crash(*_: object) -> None:
    raise KeyboardInterrupt
