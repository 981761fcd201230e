"""A report is one page that needs nothing else, says what is missing, and draws what was done."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
import pytest

from app import words
from app.report.certificate import certificate_of
from app.report.make import report_of, report_path, save_report
from app.report.replay import is_cut, points_of, replay_of
from app.report.tables import tables_of
from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.subject import Axis, Centre, Segment, SubjectCalibration, Tip
from handstudio.calibration.verdict import Reading, Verdict
from handstudio.errors import TakeError
from handstudio.export.part import Window
from handstudio.hand.skeleton import FINGERS, JOINTS, SEGMENTS, nominal_skeleton
from handstudio.kinematics import pose_of
from handstudio.layout import Layout, SensorPlace
from handstudio.process import process
from handstudio.recording.notes import Notes, save_notes
from handstudio.recording.take import Take
from handstudio.setup import Setup, calibrated


@pytest.fixture(autouse=True)
def language_again() -> Iterator[None]:
    """A report sets the language of its process."""
    kept = {name: getattr(words, name) for name in ("_catalogue", "_errors", "_language")}
    yield
    for name, value in kept.items():
        setattr(words, name, value)


def known_hand(setup: Setup, device: str = "VG-0") -> SubjectCalibration:
    """A calibration that says the nominal hand was measured."""
    skeleton = nominal_skeleton("right")
    drivers, names = setup.layout.drivers, setup.layout.names
    sensors = [names[drivers[segment]] for segment in SEGMENTS]
    identity, nothing = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    segments = tuple(
        Segment(
            name,
            sensor,
            identity,
            tuple(skeleton.q_parent_rest[k].tolist()),
            tuple(skeleton.t_parent_joint[k].tolist()),
            (0.001, 0.001, 0.001),
            float(skeleton.length_m[k]),
            0.0012,
            "measured",
            "measured",
            -0.5,
        )
        for k, (name, sensor) in enumerate(zip(SEGMENTS, sensors, strict=True))
    )
    tips = tuple(
        Tip(finger, tuple(tip.tolist()), 0.002, "measured")
        for finger, tip in zip(FINGERS, skeleton.t_distal_tip, strict=True)
    )
    centres = tuple(
        Centre(j.name, s, nothing, (0.002, 0.001, 0.002), nothing, 0.31, (62.0, 5.0), 9.0)
        for j, s in zip(JOINTS, sensors, strict=True)
    )
    axes = tuple(
        Axis(j.name, s, (1.0, 0.0, 0.0), 0.02) for j, s in zip(JOINTS, sensors, strict=True)
    )
    steps = (
        Verdict("rest", (Reading("stillness", 0.1, 1.0, "deg/s", at_least=False),)),
        Verdict("wrist:flexion", (Reading("range", 20.0, 60.0, "deg"),)),
    )
    return SubjectCalibration(
        "C1", "2026-03-01T10:00:00+00:00", "handstudio 0", "virtual-0", "right", 0.187, 3, device,
        segments, tips, centres, axes, (), steps, (("cal.mcap", "aa"),),
    )  # fmt: skip


def test_the_page_needs_nothing_but_itself(take: Take) -> None:
    html = report_of(take).html
    assert not re.search(r"""(src|href|url)\s*[=(]\s*["']?(https?:)?//""", html)
    assert "http" not in re.sub(r"(?s)<script.*?</script>", "", html).replace("http-equiv", "")
    assert "default-src 'none'" in html
    for svg in re.findall(r"(?s)<svg.*?</svg>", html):
        ET.fromstring(svg)
    assert html.count("<svg") >= 5
    assert take.sha256() in html
    assert "Without a calibration of the hand" in html


def test_it_is_told_in_japanese_too(take: Take) -> None:
    if not (Path(words.__file__).parent / "locale/ja/LC_MESSAGES/handstudio.mo").exists():
        pytest.skip("the catalogues are not compiled here")
    html = report_of(take, language="ja").html
    assert '<html lang="ja">' in html
    assert "手の計測報告書" in html
    assert "Active range of motion" not in html


def test_what_people_typed_stays_text(take: Take) -> None:
    named = msgspec.structs.replace(take.header, subject="<script>alert(1)</script>")
    save_notes(take.path, Notes(text="<b>better</b> & well"))
    try:
        html = report_of(Take(take.path, named, take.first_state, take.summary)).html
    finally:
        save_notes(take.path, Notes())
    assert "<script>alert" not in html
    assert "&lt;script&gt;alert(1)" in html
    assert "&lt;b&gt;better&lt;/b&gt; &amp; well" in html


def test_the_replay_is_the_hand_to_a_tenth_of_a_millimetre(take: Take) -> None:
    motion, setup = process(take), take.header.setup
    replay = replay_of(setup, motion, int(motion.time_us[0]))
    assert json.loads(msgspec.json.encode(replay)) == replay
    points = points_of(replay)
    assert len(points) == replay["frames"] == 201  # 25 a second for eight seconds
    pose = pose_of(setup, motion.q_world_sensor[::4])
    true = np.concatenate([pose.t_world_joint, pose.t_world_tip], axis=1)
    apart = [np.linalg.norm(a[:, :, None] - a[:, None], axis=-1) for a in (points, true)]
    assert np.abs(apart[0] - apart[1]).max() < 1.8e-4  # both ends rounded to 0.1 mm
    assert np.abs(points[:, 1]).max() == 0.0  # seen from the wrist
    assert points[:, len(SEGMENTS) + 2, 1].mean() > 0.1  # fingers point away
    assert not is_cut(replay)
    assert is_cut(replay | {"end": replay["end"] + 600.0})


def test_a_certificate_says_where_from_how_old_and_how_well(take: Take) -> None:
    setup = calibrated(take.header.setup, subject=known_hand(take.header.setup))
    recorded = datetime(2026, 3, 31, 12, tzinfo=UTC)
    hand, joints, segments, sensors = certificate_of(setup, recorded)
    facts = dict(hand.facts)
    assert facts["Calibration"] == "C1"
    assert facts["Made"] == "2026-03-01 (30 d before this take)"
    assert facts["Steps"] == "1 of 2 steps were good"
    assert "wrist:flexion" in hand.warning
    wrist = next(row for row in joints.rows if row[0] == "Wrist")
    assert wrist[2:] == ("3.0", "1.1", "0.31", "62")
    assert len(segments.rows) == len(SEGMENTS)
    assert segments.rows[1][3] == "measured"
    assert "No calibration of the sensors" in sensors.warning
    other = calibrated(setup, subject=known_hand(setup, device="another"))
    assert "another" in certificate_of(other, recorded)[0].warning
    kept = DeviceCalibration("VG-0", "2026-02-01T00:00:00+00:00", "handstudio", (), ())
    assert certificate_of(calibrated(setup, sensors=kept), None)[-1].facts[0] == ("Glove", "VG-0")


def test_a_calibrated_hand_has_its_certificate_in_the_report(take: Take) -> None:
    setup = calibrated(take.header.setup, subject=known_hand(take.header.setup))
    made = report_of(take, setup, Window(1.0, 7.0))
    assert "Joint centres and axes" in made.html
    assert "Without a calibration" not in made.html
    opposition = next(t for t in tables_of(made.measured) if t.title == "Opposition of the thumb")
    assert re.match(r"\d+ \(\d+–\d+\)", opposition.rows[0][1])


def test_a_take_of_no_hand_has_a_report_that_says_so(take: Take) -> None:
    setup = take.header.setup
    places = tuple(SensorPlace(s.sensor, f"part_{s.sensor}") for s in setup.layout.sensors)
    bare = msgspec.structs.replace(setup, layout=Layout("unknown", places, ()))
    html = report_of(take, bare).html
    assert "no hand is shown" in html
    assert "<canvas" not in html
    assert take.sha256() in html


def test_a_report_that_cannot_be_written_says_so(take: Take, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(TakeError, match="cannot be written"):
        save_report("", tmp_path / "file" / "r.html")
    assert report_path(take.path, "ja").name.endswith(".report.ja.html")
