"""A part of a take: the same instants to the last bit, in a file that is a take like any other."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from handstudio.errors import TakeError
from handstudio.fusion.tree_filter import TreeFilter
from handstudio.pipeline import Motion
from handstudio.process import process
from handstudio.recording.header import Header
from handstudio.recording.notes import Label, Mark, Notes, load_notes, save_notes
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import Take, open_take
from handstudio.recording.take_health import recomputed_health
from handstudio.recording.writer import TakeWriter
from handstudio.samples import ImuSamples
from handstudio.simulation.imperfections.strengths import parse
from handstudio.trim import trim

PACKETS = parse("typical,packets=5")  # one in two hundred is lost or damaged


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Take:
    """Five seconds of which packets were lost."""
    rehearsed = rehearse(seed=3, imperfections=PACKETS)
    return open_take(simulate(tmp_path_factory.mktemp("whole"), rehearsed, seconds=5.0))


def assert_is_part(take: Take, part: Take, first: int, stop: int) -> None:
    motion, own = process(take)[first:stop], process(part)
    for name in Motion.__slots__:
        np.testing.assert_array_equal(getattr(own, name), getattr(motion, name), name)


@pytest.mark.parametrize(("begin_s", "end_s"), [(0.0, 1.0), (1.234, 3.456), (2.0, None)])
def test_the_motion_of_a_part_is_that_part_of_the_motion(whole, begin_s, end_s):
    part = open_take(trim(whole, begin_s, end_s))
    time_s = (process(whole).time_us - process(whole).time_us[0]) * 1e-6
    inside = np.flatnonzero((time_s >= begin_s) & (time_s <= (end_s or np.inf)))
    assert 90 < len(inside) < 310
    assert_is_part(whole, part, inside[0], inside[-1] + 1)
    assert part.summary is not None
    assert part.summary.health == recomputed_health(part)
    assert part.summary.packets == len(inside)
    assert part.header.setup == whole.header.setup
    assert part.header.start_utc_ns == pytest.approx(
        whole.header.start_utc_ns + time_s[inside[0]] * 1e9, abs=1e6
    )


def test_a_part_of_a_part_is_a_part_by_the_filter_of_the_hand_too(whole, tmp_path):
    setup = msgspec.structs.replace(whole.header.setup, filter=TreeFilter())
    header = msgspec.structs.replace(whole.header, setup=setup)
    writer = TakeWriter(tmp_path / "tree.mcap", header)
    for arrival_ns, chunk in whole.chunks():
        writer.write(arrival_ns, chunk)
    take = open_take(writer.close())
    part = open_take(trim(take, 1.0, 3.0, name="first cut"))
    assert part.path.name == "first_cut.mcap"
    again = open_take(trim(part, 0.5, 1.0))
    first = int(np.searchsorted(process(take).time_us, process(again).time_us[0]))
    assert first > 100
    assert_is_part(take, again, first, first + len(process(again)))


def test_an_import_is_cut_between_its_samples(whole, tmp_path):
    setup = msgspec.structs.replace(whole.header.setup, decoder=None)
    header = Header("import", "S", whole.header.start_utc_ns, setup, "samples", "folder")
    writer = TakeWriter(tmp_path / "import.mcap", header)
    for run in whole.runs():
        assert isinstance(run, ImuSamples)
        writer.write_samples(run, header.start_utc_ns)
    take = open_take(writer.close())
    part = open_take(trim(take, 1.5, 2.5))
    first = int(np.searchsorted(process(take).time_us, process(part).time_us[0]))
    assert_is_part(take, part, first, first + len(process(part)))


def test_what_was_written_inside_comes_along(whole, tmp_path):
    save_notes(
        whole.path,
        Notes(
            (Label(0.1, 0.5, "static"), Label(1.5, 4.0, "work"), Label(4.2, 4.5, "rest")),
            "left hand",
            (Mark(0.2), Mark(2.5, "here")),
        ),
    )
    part = trim(whole, 2.0, 3.0)
    kept = load_notes(part)
    assert kept.text == "left hand"
    ((mark,), (label,)) = kept.marks, kept.labels
    assert (label.label, mark.text) == ("work", "here")
    assert (label.start_s, label.end_s) == pytest.approx((0.0, 1.0), abs=0.02)
    assert mark.at_s == pytest.approx(0.5, abs=0.02)


def test_where_nothing_is_no_file_is_left(whole):
    before = sorted(whole.path.parent.iterdir())
    with pytest.raises(TakeError, match="no instant"):
        trim(whole, 3.001, 3.002)
    assert sorted(whole.path.parent.iterdir()) == before


def test_the_whole_take_stays_as_it_is_and_names_stay_apart(whole):
    digest = whole.sha256()
    one, other = trim(whole, 0.0, 0.5), trim(whole, 0.0, 0.5)
    assert one != other
    assert Path(whole.path).exists()
    assert whole.sha256() == digest
