"""A take measured as a whole or in part, against another; and takes that lack something."""

from __future__ import annotations

from datetime import UTC, datetime

import msgspec
import numpy as np
import pytest

from handstudio.analysis.measure import Measure
from handstudio.analysis.sides import against_other_side
from handstudio.errors import TakeError
from handstudio.export.part import Window
from handstudio.kinematics import angles_of
from handstudio.layout import Layout, SensorPlace
from handstudio.measure import Measured, band_of, measure
from handstudio.process import process
from handstudio.recording.notes import notes_path
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import Take, open_take
from handstudio.setup import Setup


@pytest.fixture(scope="module")
def takes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Take]:
    """Two visits of one person, and one of the other hand."""
    sessions = tmp_path_factory.mktemp("sessions")

    def made(name: str, side: str, month: int) -> Take:
        begin = datetime(2026, month, 4, 12, tzinfo=UTC)
        person = rehearse(seed=month, side=side)  # type: ignore[arg-type]
        path = simulate(sessions, person, seconds=9.0, code="S01", name=name, start=begin)
        return open_take(path)

    return {
        "before": made("before", "right", 3),
        "now": made("now", "right", 4),
        "left": made("left", "left", 5),
    }


def found(measured: Measured, kind: str, about: str) -> Measure:
    (one,) = (m for m in measured.measures if (m.kind, m.about) == (kind, about))
    return one


def test_what_is_measured_is_what_was_reached(takes):
    take = takes["now"]
    measured = measure(take)
    motion = process(take)
    angles = angles_of(take.header.setup, motion)
    names = [m.about for m in measured.measures if m.kind == "most"]
    assert "index_pip_flexion" in names
    assert np.rad2deg(np.nanmax(angles)) >= max(
        m.value for m in measured.measures if m.kind == "most"
    )
    visit = measured.visit
    assert (visit.subject, visit.side, visit.take) == ("S01", "right", "now")
    assert visit.visit == "2026-04-04"
    assert visit.raw_sha256 == take.sha256()
    assert visit.end_s == pytest.approx(9.0, abs=0.02)
    assert 90.0 < visit.known_percent < 100.0  # not known before the first rest
    assert found(measured, "kapandji", "thumb").why == "no_calibration"
    assert msgspec.json.decode(msgspec.json.encode(measured), type=Measured) == measured


def test_a_part_is_measured_alone(takes):
    whole, rest = measure(takes["now"]), measure(takes["now"], window=Window(0.6, 1.4))
    assert rest.visit.start_s == pytest.approx(0.6)
    assert rest.visit.end_s == pytest.approx(1.4)
    span = found(rest, "range", "index_pip_flexion").value
    assert span < 2.0 < found(whole, "range", "index_pip_flexion").value
    at_s = found(measure(takes["now"], window=Window(4.0, 8.0)), "most", "index_mcp_flexion").at_s
    assert 4.0 <= at_s <= 8.0  # of the take, not of the part
    with pytest.raises(TakeError, match="Nothing lies between"):
        measure(takes["now"], window=Window(20.0, 30.0))


def test_the_same_hand_twice_has_not_changed(takes):
    measured = measure(takes["now"], earlier=takes["before"])
    assert measured.earlier is not None
    assert measured.earlier.take == "before"
    ranges = [change for change in measured.changes if change.kind == "range"]
    assert len(ranges) > 20
    assert {change.verdict for change in ranges} == {"no detectable change"}


@pytest.mark.parametrize(
    ("take", "earlier", "what"), [("now", "left", "left"), ("before", "now", "was recorded after")]
)
def test_strangers_and_later_takes_are_not_compared(takes, take, earlier, what):
    with pytest.raises(TakeError, match=what):
        measure(takes[take], earlier=takes[earlier])


def test_a_hand_is_held_against_the_other_one(takes):
    now, left = measure(takes["now"]), measure(takes["left"])
    measured = measure(takes["now"], earlier=takes["before"], other_side=takes["left"])
    assert measured.changes == measure(takes["now"], earlier=takes["before"]).changes
    assert measured.other_side.take == "left"
    shares = {(one.kind, one.about): one for one in measured.sides}
    for about in ("index", "little"):
        one = shares["tam", about]
        mine, theirs = found(now, "tam", about), found(left, "tam", about)
        assert one.percent == pytest.approx(100.0 * mine.value / theirs.value)
        assert one.percent == pytest.approx(100.0, abs=10.0)  # the same exercise with both
        assert one.sd > 100.0 * mine.sd / theirs.value
        assert one.grade in ("excellent", "good")
    assert {kind for kind, _ in shares} == {"range", "tam", "strickland"}
    assert msgspec.json.decode(msgspec.json.encode(measured), type=Measured) == measured
    with pytest.raises(TakeError, match="other hand of the same person"):
        measure(takes["now"], other_side=takes["before"])


def test_a_share_of_next_to_nothing_is_not_given_and_grades_follow_the_share():
    def tam(value, sd=2.0):
        return Measure("tam", "index", value, "deg", sd=sd)

    (half,) = against_other_side([tam(120.0)], [tam(240.0)])
    assert (half.percent, half.grade) == (50.0, "poor")
    assert half.sd == pytest.approx(100.0 * np.hypot(2.0, 1.0) / 240.0)
    assert against_other_side([tam(240.0)], [tam(239.9)])[0].grade == "excellent"
    assert against_other_side([tam(239.0)], [tam(240.0, None)])[0].sd is None
    assert against_other_side([tam(120.0)], [tam(4.0)]) == []
    assert against_other_side([Measure("mean_speed", "a", 30.0, "deg/s")] * 2, []) == []


def test_notes_that_cannot_be_read_do_not_keep_a_take_from_being_measured(tmp_path):
    path = simulate(tmp_path, rehearse(seed=1), seconds=2.0)
    notes_path(path).write_text("{")
    notes_path(path).with_name(notes_path(path).name + ".bak").unlink(missing_ok=True)
    assert found(measure(open_take(path)), "range", "wrist_flexion").value is not None


def test_a_layout_that_is_no_hands_says_so(takes):
    take = takes["now"]
    setup = take.header.setup
    places = tuple(SensorPlace(s.sensor, f"part_{s.sensor}") for s in setup.layout.sensors)
    bare: Setup = msgspec.structs.replace(setup, layout=Layout("unknown", places, ()))
    (only,) = measure(take, bare).measures
    assert (only.value, only.why) == (None, "no_hand")


def test_fingers_without_sensors_are_told_as_missing(takes):
    take = takes["now"]
    setup = take.header.setup
    places = tuple(
        SensorPlace(s.sensor, "forearm" if "little" in s.segment else s.segment)
        for s in setup.layout.sensors
    )
    fewer = msgspec.structs.replace(
        setup, layout=msgspec.structs.replace(setup.layout, sensors=places)
    )
    measured = measure(take, fewer)
    assert found(measured, "range", "little_pip_flexion").why == "no_sensor"
    assert found(measured, "tam", "little").why == "no_sensor"
    assert found(measured, "tam", "index").value is not None


@pytest.mark.parametrize(
    ("text", "above", "below"),
    [("bent=wrist_flexion:15:", 15.0, None), ("a=wrist_flexion:-5:5", -5.0, 5.0)],
)
def test_postures_are_typed(text, above, below):
    band = band_of(text)
    assert (band.angle, band.above_deg, band.below_deg) == ("wrist_flexion", above, below)


@pytest.mark.parametrize(
    "text",
    ["", "bent", "bent=wrist:1:", "=wrist_flexion:1:", "a=wrist_flexion::", "a=wrist_flexion:x:1"],
)
def test_what_is_no_posture_is_refused(text):
    with pytest.raises(TakeError, match="is no posture"):
        band_of(text)


def test_measuring_tells_how_far_it_is(takes):
    told: list[float] = []
    measure(takes["now"], earlier=takes["before"], progress=told.append)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)
