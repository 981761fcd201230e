"""Raw import: what a folder holds becomes a take; what does not fit is named with its place."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from handstudio.errors import ImportFolderError, TakeError
from handstudio.kinematics import exported_angles, has_start
from handstudio.layout import JointPlace, glove
from handstudio.maths import so3
from handstudio.pipeline import Doubt
from handstudio.process import process
from handstudio.recording.notes import load_notes
from handstudio.recording.raw_import import BLOCK, import_folder, read_folder
from handstudio.recording.reference import load_reference
from handstudio.recording.take import open_take
from handstudio.samples import ImuSamples

N = 200
Columns = dict[str, np.ndarray]

LAYOUT = """
[sensors]
upper = "thigh"
lower = "shank"

[[joints]]
name = "knee"
parent = "thigh"
child = "shank"
axes = 1
"""


def columns(*sensors: str, n: int = N, mag: bool = True, first_s: float = 0.0) -> Columns:
    """Sensors that rest, with a little noise, at 100 Hz."""
    rng = np.random.default_rng(n)
    table = {"time_s": first_s + np.arange(n) / 100.0}
    for sensor in sensors:
        kinds = {"gyr": (0.0, 0.0, 0.01), "acc": (0.0, 0.0, 9.81), "mag": (31.0, 0.0, -35.0)}
        for kind, values in kinds.items():
            if kind == "mag" and not mag:
                continue
            for axis, value in zip("xyz", values, strict=True):
                table[f"{sensor}_{kind}_{axis}"] = value + 0.001 * rng.normal(size=n)
    return table


def rows_of(table: Columns) -> list[list[str]]:
    """As a person's own script would write it: an empty cell where there is nothing."""
    cells = [[("" if np.isnan(v) else repr(float(v))) for v in column] for column in table.values()]
    return [list(table), *map(list, zip(*cells, strict=True))]


def write(folder: Path, rows: list[list[str]], name: str = "samples.csv") -> Path:
    folder.mkdir(exist_ok=True)
    with (folder / name).open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)
    return folder


@pytest.fixture
def folder(tmp_path) -> Callable[..., Path]:
    """``folder(table, layout=..., NAME=[[...]])``: a raw import folder."""

    def make(table: Columns, layout: str | None = None, **others: list[list[str]]) -> Path:
        place = write(tmp_path / "foreign", rows_of(table))
        for name, rows in others.items():
            write(place, rows, f"{name}.csv")
        if layout is not None:
            (place / "layout.toml").write_text(layout, encoding="utf-8")
        return place

    return make


def samples_of(take: Path) -> ImuSamples:
    events = [event for events in open_take(take).events() for event in events]
    parts = [[getattr(event, name) for event in events] for name in ImuSamples.__slots__]
    return ImuSamples(*map(np.concatenate, parts))


# --- what fits --------------------------------------------------------------------------------


def test_a_csv_file_becomes_a_take_of_the_same_numbers(folder, tmp_path):
    table = columns("SN1", "SN11", n=2 * BLOCK + 7)
    place = folder(table)
    path = import_folder(place, tmp_path / "sessions", "S01")
    assert path.parent.parent == tmp_path / "sessions" / "S01"
    assert path.stem == "foreign"
    take = open_take(path)
    assert take.header.kind == "samples"
    assert take.header.setup.layout == glove("right", ["SN1", "SN11"])
    assert take.header.setup.rate_hz == pytest.approx(100.0)
    assert take.header.setup.magnetometer_rate_hz == pytest.approx(100.0)
    assert take.summary.duration_s == pytest.approx((2 * BLOCK + 6) / 100.0)
    samples = samples_of(path)
    for kind in ("gyr", "acc", "mag"):
        for s, sensor in enumerate(("SN1", "SN11")):
            for a, axis in enumerate("xyz"):
                np.testing.assert_array_equal(
                    getattr(samples, kind)[:, s, a], table[f"{sensor}_{kind}_{axis}"]
                )
    np.testing.assert_array_equal(samples.time_us, 10_000 * np.arange(2 * BLOCK + 7))
    assert samples.valid.all()
    assert samples.fresh.all()
    assert not samples.saturated.any()


def test_a_parquet_file_becomes_the_same_take(folder, tmp_path):
    table = columns("SN1", "SN11")
    by_csv = samples_of(import_folder(folder(table), tmp_path / "a", "S"))
    place = tmp_path / "parquet"
    place.mkdir()
    whole = pa.table({name: pa.array(values) for name, values in table.items()})
    pa.parquet.write_table(whole, place / "samples.parquet")
    assert samples_of(import_folder(place, tmp_path / "b", "S")) == by_csv


def test_whole_numbers_and_single_precision_are_numbers_too(tmp_path):
    table = {name: pa.array(values.astype("f4")) for name, values in columns("SN1").items()}
    table["time_s"] = pa.array(np.arange(N))
    (tmp_path / "f").mkdir()
    pa.parquet.write_table(pa.table(table), tmp_path / "f" / "samples.parquet")
    assert read_folder(tmp_path / "f").rate_hz == pytest.approx(1.0)


def test_the_order_of_the_columns_does_not_matter(folder):
    table = columns("SN1")
    turned = dict(reversed(table.items()))
    assert read_folder(folder(turned)).samples == read_folder(folder(table)).samples


def test_the_folder_is_not_changed_and_no_take_is_overwritten(folder, tmp_path):
    place = folder(columns("SN1"))
    before = {path.name: path.read_bytes() for path in place.iterdir()}
    paths = [import_folder(place, tmp_path / "sessions", "S01") for _ in range(3)]
    assert [path.name for path in paths] == ["foreign.mcap", "foreign-2.mcap", "foreign-3.mcap"]
    assert {path.name: path.read_bytes() for path in place.iterdir()} == before


@pytest.mark.parametrize("hand_type", [1, 2, 3])
def test_a_glove_whose_palm_is_divided_otherwise(folder, tmp_path, hand_type):
    text = f'side = "left"\nhand_type = {hand_type}\n'
    names = ("SN1", "SN4", "SN8", "SN11")
    take = open_take(import_folder(folder(columns(*names), text), tmp_path, "S01"))
    assert take.header.setup.layout == glove("left", names, hand_type)
    motion = process(take)
    names = {angle.name for angle in exported_angles(take.header.setup, motion)}
    assert ("ulnar_cmc_flexion" in names) == (hand_type == 3)
    assert "ring_mcp_flexion" in names


def test_a_tree_of_ones_own_says_the_hand_type_by_its_joints(folder, tmp_path):
    text = """
side = "right"
[sensors]
A = "forearm"
B = "hand"
C = "hand_ulnar"
D = "ring_proximal"
[[joints]]
name = "wrist"
parent = "forearm"
child = "hand"
axes = 2
[[joints]]
name = "wrist_ulnar"
parent = "forearm"
child = "hand_ulnar"
axes = 2
[[joints]]
name = "ring_mcp"
parent = "hand_ulnar"
child = "ring_proximal"
axes = 2
"""
    place = folder(columns("A", "B", "C", "D"), text)
    layout = open_take(import_folder(place, tmp_path, "S01")).header.setup.layout
    assert layout.is_hand
    assert layout.hand_type == 2


def test_a_layout_of_ones_own_names(folder, tmp_path):
    place = folder(columns("upper", "lower", "left_over", mag=False), LAYOUT)
    take = open_take(import_folder(place, tmp_path / "sessions", "S01", name="knee bend"))
    layout = take.header.setup.layout
    assert layout.names == ("upper", "lower")
    assert layout.joints == (JointPlace("knee", "thigh", "shank", 1),)
    assert not layout.is_hand
    assert take.path.stem == "knee_bend"
    motion = process(take)
    assert motion.q_world_sensor.shape == (N, 2, 4)
    assert not has_start(motion)
    assert (motion.doubt[-1] == 0).all()


def test_without_a_magnetometer_there_is_no_fresh_reading_and_no_rate_of_them(folder, tmp_path):
    place = folder(columns("SN1", mag=False))
    read = read_folder(place)
    assert np.isnan(read.samples.mag).all()
    assert not read.samples.fresh.any()
    assert read.magnetometer_rate_hz is None
    motion = process(open_take(import_folder(place, tmp_path / "s", "S")))
    assert np.isfinite(motion.q_world_sensor).all()


def test_a_slower_magnetometer_leaves_cells_empty_and_its_rate_is_found(folder, tmp_path):
    table = columns("SN1", "SN11")
    stale = np.arange(N) % 4 != 0
    for axis in "xyz":
        table[f"SN1_mag_{axis}"][stale] = np.nan
        del table[f"SN11_mag_{axis}"]
    place = folder(table)
    read = read_folder(place)
    np.testing.assert_array_equal(read.samples.fresh[:, 0], ~stale)
    assert not read.samples.fresh[:, 1].any()
    assert read.magnetometer_rate_hz == pytest.approx(25.0)
    motion = process(open_take(import_folder(place, tmp_path / "s", "S")))
    error = so3.angle_between(motion.q_world_sensor[-1, 0], so3.IDENTITY)
    assert np.rad2deg(error) < 1.0


def test_labels_and_reference_count_from_where_the_take_begins(folder, tmp_path):
    """In the folder they share the time of the samples, which may begin anywhere."""
    table = columns("SN1", first_s=1000.0)
    half = float(np.sqrt(0.5))
    reference = [
        ["time_s", "SN1_qw", "SN1_qx", "SN1_qy", "SN1_qz"],
        ["1000.0", "1", "0", "0", "0"],
        ["1000.01", "", "", "", ""],
        ["1000.02", repr(half), "0", "0", repr(half)],
    ]
    labels = [["start_s", "end_s", "label"], ["1000.5", "1001", "static"], ["1001", "1002", "静止"]]
    path = import_folder(
        folder(table, labels=labels, reference=reference), tmp_path / "sessions", "S01"
    )
    notes = load_notes(path)
    assert [label.label for label in notes.labels] == ["static", "静止"]
    spans = [(label.start_s, label.end_s) for label in notes.labels]
    np.testing.assert_allclose(spans, [(0.5, 1.0), (1.0, 2.0)], atol=1e-9)
    found = load_reference(path)
    assert found.sensors == ("SN1",)
    np.testing.assert_array_equal(found.time_us, 1_000_000_000 + np.array([0, 10_000, 20_000]))
    assert np.isnan(found.q_world_sensor[1]).all()
    np.testing.assert_allclose(found.q_world_sensor[2, 0], [half, 0, 0, half])
    take = open_take(path)
    (first_ns, _), *_ = take.chunks()
    assert first_ns == take.header.start_utc_ns
    assert samples_of(path).time_us[0] == found.time_us[0]


def test_a_take_without_a_reference_says_so(folder, tmp_path):
    path = import_folder(folder(columns("SN1")), tmp_path / "sessions", "S01")
    assert load_notes(path).labels == ()
    with pytest.raises(TakeError, match=r"no reference.*\n.*reference\.csv"):
        load_reference(path)


def test_missing_rows_are_a_gap(folder, tmp_path):
    table = {name: np.delete(values, np.s_[100:150]) for name, values in columns("SN1").items()}
    motion = process(open_take(import_folder(folder(table), tmp_path / "s", "S")))
    flagged = np.flatnonzero(motion.doubt[:, 0] & Doubt.AFTER_GAP)
    assert flagged.tolist() == [100]


# --- what does not ----------------------------------------------------------------------------


def refused(folder: Path, what: str, remedy: str = "") -> None:
    """It is refused with these words, and nothing is written."""
    sessions = folder.parent / "sessions"
    with pytest.raises(ImportFolderError, match=what) as caught:
        import_folder(folder, sessions, "S01")
    assert caught.value.remedy
    assert remedy in caught.value.remedy
    assert not sessions.exists()


def test_a_folder_that_is_not_there(tmp_path):
    refused(tmp_path / "nowhere", r"nowhere: there is no such folder", "path")


def test_a_folder_without_samples(tmp_path):
    (tmp_path / "f").mkdir()
    refused(tmp_path / "f", r"no samples\.csv and no samples\.parquet", "docs/import.md")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("samples.csv", b""),
        ("samples.csv", b"a,b\n1,2\n1,2,3\n"),
        ("samples.parquet", b""),
        ("samples.parquet", b"time_s,SN1_gyr_x\n0,0\n"),
        ("labels.csv", b""),
        ("reference.csv", b"a,b\n1\n"),
    ],
)
def test_a_file_that_is_no_table(folder, name, content):
    place = folder(columns("SN1"))
    (place / name).write_bytes(content)
    refused(place, rf"{name}: cannot be read as a table", "header row")


def test_a_header_without_rows(folder):
    rows = [list(columns("SN1"))]
    place = folder(columns("SN1"))
    write(place, rows)
    refused(place, r"samples: 0 rows; at least 2")


def test_one_row_is_no_motion(folder):
    refused(folder(columns("SN1", n=1)), r"samples: 1 rows; at least 2")


@pytest.mark.parametrize("missing", ["time_s", "SN11_gyr_y", "SN1_acc_z", "SN1_mag_x"])
def test_a_missing_column(folder, missing):
    table = columns("SN1", "SN11")
    del table[missing]
    refused(folder(table), rf"samples: no column {missing}\.", "docs/import.md")


def test_a_column_twice(folder):
    table = columns("SN1")
    place = folder(table)
    rows = [[*row, row[1]] for row in rows_of(table)]
    write(place, rows)
    refused(place, r"samples\.csv: more than one column SN1_gyr_x", "one")


@pytest.mark.parametrize("cell", ["", "nan", "inf"])
def test_nothing_where_a_number_must_be(folder, cell):
    table = columns("SN1")
    place = folder(table)
    rows = rows_of(table)
    rows[8][1] = rows[40][1] = cell  # rows[0] is the header
    write(place, rows)
    refused(place, r"samples, row 8, column SN1_gyr_x: not a number \(2 such", "Leave out the rows")


def test_nothing_in_the_column_of_time(folder):
    table = columns("SN1")
    table["time_s"][6] = np.nan
    refused(folder(table), r"samples, row 7, column time_s: not a number")


@pytest.mark.parametrize("text", ["fast", "1,5", "0x10", "12:30"])
def test_text_where_a_number_must_be(folder, text):
    table = columns("SN1")
    place = folder(table)
    rows = rows_of(table)
    rows[8][2] = text
    write(place, rows)
    refused(place, rf"samples, row 8, column SN1_gyr_y: '{text}' is not a number", "decimal point")


def test_the_time_of_day_where_seconds_must_be(folder):
    table = columns("SN1")
    place = folder(table)
    rows = rows_of(table)
    for k, row in enumerate(rows[1:]):
        row[0] = f"2026-01-02 03:{k // 60:02d}:{k % 60:02d}"
    write(place, rows)
    refused(place, r"samples, row 1, column time_s: '2026-.*' is not a number", "plain numbers")


@pytest.mark.parametrize("back", [0.0, -0.005])
def test_time_that_stands_still_or_goes_back(folder, back):
    table = columns("SN1")
    table["time_s"][50] = table["time_s"][49] + back
    refused(folder(table), r"row 51: time does not move on: 0\.4\d+ s after 0\.490000 s", "Sort")


def test_time_in_nanoseconds_since_1970(folder):
    table = columns("SN1")
    table["time_s"] = 1.7e18 + 1e7 * np.arange(N)
    refused(folder(table), r"samples: time_s reaches 1\.7e\+18, which are no seconds", "in seconds")


def test_seconds_since_1970_are_seconds(folder, tmp_path):
    table = columns("SN1", first_s=1.7e9)
    path = import_folder(folder(table), tmp_path / "s", "S")
    motion = process(open_take(path))
    assert motion.time_us[-1] - motion.time_us[0] == 1_990_000


def test_sensors_the_glove_does_not_have_need_a_layout(folder):
    refused(folder(columns("SN1", "SN99")), r"no layout\.toml names.*no sensor SN99", "layout.toml")
    refused(folder(columns("left_foot")), r"no layout\.toml names.*no sensor left_foot")


def test_samples_of_nobody_need_a_layout(folder):
    refused(
        folder({"time_s": np.arange(5.0), "x": np.ones(5)}), r"no layout\.toml names the sensors"
    )


def test_a_sensor_of_the_layout_without_columns(folder):
    place = folder(columns("upper"), LAYOUT)
    refused(place, r"samples: no column lower_gyr_x, lower_gyr_y", "take lower out of layout.toml")


@pytest.mark.parametrize(
    ("layout", "what"),
    [
        ("[sensors", r"layout\.toml: not a layout"),
        ("", r"layout\.toml: The layout has no sensors"),
        ("hand_type = 4", r"layout\.toml: not a layout.*hand_type"),
        ('hand_type = 1\n[sensors]\nupper = "a"', r"layout\.toml: hand_type divides"),
        ("sensors = 5", r"layout\.toml: not a layout.*\$\.sensors"),
        ("[sensors]\nupper = 3", r"layout\.toml: not a layout.*str"),
        ('side = 1\n[sensors]\nupper = "a"', r"layout\.toml: not a layout.*side"),
        ('side = "Right"\n[sensors]\nupper = "a"', r"layout\.toml: The side.*'Right'"),
        ("[sensors]", r"layout\.toml: The layout has no sensors"),
        (LAYOUT.replace("axes = 1", "axes = 9"), r"layout\.toml: Joint knee has 9 axes"),
        (LAYOUT.replace("axes = 1", 'axes = "one"'), r"not a layout.*axes"),
        (LAYOUT.replace('name = "knee"\n', ""), r"not a layout.*name"),
        (LAYOUT.replace('child = "shank"', 'child = "foot"'), r"lower sits on shank, which no"),
        ('[sensors]\nupper = "a"\nupper = "b"', r"layout\.toml: not a layout"),
    ],
)
def test_a_layout_that_is_none(folder, layout, what):
    refused(folder(columns("upper", "lower"), layout), what)


def test_a_layout_that_is_not_utf_8(folder):
    place = folder(columns("upper"))
    (place / "layout.toml").write_bytes('[sensors]\nupper = "脚"'.encode("shift_jis"))
    refused(place, r"layout\.toml: not a layout.*utf-8")


@pytest.mark.parametrize(
    ("rows", "what"),
    [
        ([["start_s", "end_s"], ["0", "1"]], r"labels: no column label"),
        ([["start_s", "label"], ["0", "x"]], r"labels: no column end_s"),
        ([["start_s", "end_s", "label"], ["0", "1", "a"], ["2", "1", "b"]], r"labels, row 2: ends"),
        ([["start_s", "end_s", "label"], ["", "1", "a"], ["0", "1", "b"]], r"labels, row 1: ends"),
        (
            [["start_s", "end_s", "label"], ["soon", "1", "a"]],
            r"labels, row 1, column start_s: 'soon'",
        ),
    ],
)
def test_labels_that_are_none(folder, rows, what):
    refused(folder(columns("SN1"), labels=rows), what)


@pytest.mark.parametrize(
    ("rows", "what"),
    [
        ([["time_s", "SN11_qw"], ["0", "1"], ["1", "1"]], r"reference: no column such as"),
        ([["time_s", "SN1_qw"], ["0", "1"], ["1", "1"]], r"reference: no column SN1_qx"),
        (
            [["time_s", "SN1_qw", "SN1_qx", "SN1_qy", "SN1_qz"], *[["0", "1", "0", "0", "0"]] * 2],
            r"reference, row 2: time does not move on",
        ),
    ],
)
def test_a_reference_that_is_none(folder, rows, what):
    refused(folder(columns("SN1"), reference=rows), what)
