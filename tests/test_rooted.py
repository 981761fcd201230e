"""A take and the track of a tracker: the hand in the tracker's room."""

from __future__ import annotations

import csv
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from handstudio.cli import main
from handstudio.errors import CalibrationError
from handstudio.export.export import export
from handstudio.export.formats import FORMATS
from handstudio.export.part import Processed
from handstudio.kinematics import pose_of
from handstudio.maths import so3
from handstudio.process import process
from handstudio.recording.header import with_tracker
from handstudio.recording.naming import belongings
from handstudio.recording.parcel import pack, take_in
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take, pack_first_state
from handstudio.recording.take_track import load_track, save_track, track_path
from handstudio.recording.tracker_message import Poses, TrackerFacts
from handstudio.recording.truth import load_truth
from handstudio.recording.writer import TakeWriter
from handstudio.rooted import aligned_track, root_of, root_or_why
from handstudio.setup import smoothing
from handstudio.simulation.imperfections.strengths import IDEAL
from handstudio.trackers.late_align import attitude_at
from handstudio.trackers.track import Track
from handstudio.trim import trim
from handstudio.way import _filled, find_way, kept_way

ROOM = so3.about_z(1.1)
ORIGIN = np.array([0.3, -0.2, 0.1])
LEVER = (0.01, 0.0, 0.005)
BEGINS_S = 1.25  # of the tracker's clock, on the take's
SENSOR = "SN4"
MOTION = "tissue"
SECONDS = 14.0


@pytest.fixture(scope="module")
def take(tmp_path_factory) -> Path:
    """The ideal subject pulls a tissue and wipes with it, nothing wrong with the sensors."""
    sessions = tmp_path_factory.mktemp("sessions")
    start = datetime(2026, 3, 4, 12, tzinfo=UTC)
    return simulate(
        sessions,
        rehearse(0, MOTION, IDEAL),
        seconds=SECONDS,
        code="S01",
        name="tissue",
        start=start,
    )


@pytest.fixture(scope="module")
def track(take) -> Track:
    """A terminal beside the hand's sensor, by a tracker of 60 Hz whose clock began later."""
    return _track(take, SENSOR)


@pytest.fixture(scope="module")
def motion(take):
    return process(open_take(take))


@pytest.fixture(scope="module")
def kept(take, motion, track):
    found = aligned_track(open_take(take), motion, track, "t.csv", sensor=SENSOR, lever_m=LEVER)
    save_track(take, found)
    return found


@pytest.fixture(scope="module")
def root(take, motion, kept):
    return root_of(open_take(take), open_take(take).header.setup, motion)


def test_clock_and_attitude_are_found(kept):
    assert kept.facts.offset_s == pytest.approx(-BEGINS_S, abs=0.005)
    assert np.rad2deg(kept.facts.residual_rad) < 1.5


def test_the_hand_stands_where_it_was_in_the_room(take, motion, root):
    truth, setup = load_truth(take), open_take(take).header.setup
    pose = root.placing(pose_of(setup, motion.q_world_sensor), motion.time_us)
    wrist = pose.t_world_joint[:, 1]
    true = ORIGIN + so3.rotate(ROOM, truth.t_world_joint[: len(motion), 1].astype(float))
    off = np.linalg.norm(wrist - true, axis=-1)
    known = np.isfinite(off) & (motion.time_us > 5_000_000)
    assert known.sum() > 800
    assert np.sqrt(np.mean(off[known] ** 2)) < 0.004
    heading = so3.heading(so3.multiply(root.q_room_world[known], so3.conjugate(ROOM)))
    assert np.rad2deg(np.abs(heading)).max() < 3.0


def test_the_same_take_gives_the_same_digits_again(take, motion, root):
    again = root_of(open_take(take), open_take(take).header.setup, motion)
    np.testing.assert_array_equal(again.t_room_elbow, root.t_room_elbow)
    for kept in take.with_suffix(".motion").glob("root-*.npz"):
        kept.unlink()
    anew = root_of(open_take(take), open_take(take).header.setup, motion)
    np.testing.assert_array_equal(anew.t_room_elbow, root.t_room_elbow)


def test_positions_are_exported_in_the_room(take, motion, root, tmp_path):
    source = Processed(open_take(take), open_take(take).header.setup, motion)
    export(source, tmp_path / "p.csv", FORMATS["csv"], content="positions")
    rows = list(csv.DictReader((tmp_path / "p.csv").read_text().splitlines()))
    at = len(rows) // 2
    elbow = [float(rows[at][f"elbow_{axis}_mm"]) for axis in "xyz"]
    np.testing.assert_allclose(elbow, 1e3 * root.t_room_elbow[at], atol=1e-3)
    assert '"sensor": "SN4"' in (tmp_path / "p.csv.json").read_text()


def test_a_take_without_a_track_is_as_it_was(take, motion, track, kept, tmp_path):
    file = tmp_path / "bare.mcap"
    file.write_bytes(take.read_bytes())
    assert root_of(open_take(file), open_take(file).header.setup, motion) is None


def test_a_track_goes_where_its_take_goes(take, kept, tmp_path):
    assert track_path(take) in belongings(take)
    parcel = pack(open_take(take), tmp_path / "tissue.take.zip")
    arrived = take_in(parcel, tmp_path / "other")
    assert load_track(arrived).facts == kept.facts


def test_the_way_to_look_at_is_the_room_turned_upright_and_has_no_holes(take, motion, root):
    find_way(open_take(take))
    way = kept_way(open_take(take))
    known = np.isfinite(root.t_room_elbow[:, 0])
    assert 0 < known.sum() < len(known)  # before the tracker began nothing is known
    stands = [way.at(i) for i in range(len(motion))]
    assert [stand.known for stand in stands] == known.tolist()
    q = np.array([stand.q_still_world for stand in stands])
    t = np.array([stand.t_still_elbow for stand in stands])
    assert np.isfinite(q).all()
    assert np.isfinite(t).all()
    first = np.argmax(known)
    q_room_still, origin = root.q_room_world[first], root.t_room_elbow[first]
    back = origin + so3.rotate(q_room_still, t[known])
    np.testing.assert_allclose(back, root.t_room_elbow[known], atol=1e-6)
    turned = so3.angle_between(so3.multiply(q_room_still, q[known]), root.q_room_world[known])
    assert turned.max() < 1e-5
    np.testing.assert_array_equal(t[:first], 0.0)
    assert (way.low <= t.min(axis=0) + 1e-6).all()
    assert isinstance(way.rows, np.memmap)
    assert kept_way(open_take(take), smoothing(open_take(take).header.setup)) is None


def test_where_the_place_is_lost_the_last_one_is_held(root):
    lost = replace(root, t_room_elbow=root.t_room_elbow.copy())
    at = np.argmax(np.isfinite(root.t_room_elbow[:, 0])) + 300
    lost.t_room_elbow[at : at + 50] = np.nan
    rows = _filled(lost)
    np.testing.assert_array_equal(rows[at : at + 50, :7], np.tile(rows[at - 1, :7], (50, 1)))
    assert rows[at : at + 50, 7].tolist() == [0.0] * 50
    nowhere = _filled(replace(root, t_room_elbow=np.full_like(root.t_room_elbow, np.nan)))
    assert np.isfinite(nowhere).all()


def test_a_part_of_a_take_has_the_same_places(take, root):
    part = trim(open_take(take), 6.0, 12.0, name="part")
    opened = open_take(part)
    again = root_of(opened, opened.header.setup, process(opened))
    first = np.searchsorted(root.time_us, again.time_us[0])
    off = again.t_room_elbow - root.t_room_elbow[first : first + len(again.time_us)]
    # it is aligned by less motion, and the elbow is a forearm away from the terminal
    assert np.nanmax(np.linalg.norm(off[200:], axis=-1)) < 0.012


def test_the_sensor_is_found_where_none_is_named(take, motion, track):
    found = aligned_track(open_take(take), motion, track, "t.csv", lever_m=LEVER)
    on = {p.sensor: p.segment for p in open_take(take).header.setup.layout.sensors}
    assert on[found.facts.sensor] in ("hand", "hand_ulnar")


def test_a_terminal_of_another_segment_is_refused_and_its_own_is_named(take, motion, track):
    with pytest.raises(CalibrationError, match="does not stay with SN1"):
        aligned_track(open_take(take), motion, track, "t.csv", sensor="SN1", lever_m=LEVER)


def test_the_command_reads_a_file(take, track, tmp_path, capsys):
    file = tmp_path / "tracker.csv"
    with file.open("w", newline="") as stream:
        rows = csv.writer(stream)
        names = [f"hand_{axis}_m" for axis in "xyz"] + [f"hand_q{part}" for part in "wxyz"]
        rows.writerow(["time_s", *names])
        for us, t, q in zip(
            track.time_us, track.t_room_terminal, track.q_room_terminal, strict=True
        ):
            rows.writerow([us * 1e-6, *t, *q])
    copy = tmp_path / "again.mcap"
    copy.write_bytes(take.read_bytes())
    with pytest.raises(SystemExit) as ended:
        main(["add-track", str(copy), str(file), "--sensor", SENSOR, "--lever-mm", "10", "0", "5"])
    assert ended.value.code == 0
    assert "hand sits on SN4" in capsys.readouterr().out
    assert load_track(copy).facts.lever_source == "measured"


def recorded(take: Path, track: Track, target: Path, own_us=None, facts=None) -> Path:
    """The take as if a tracker 50 ms late had been connected while it was recorded."""
    opened = open_take(take)
    facts = facts or TrackerFacts("lsl:room", "hand", SENSOR, LEVER)
    header = with_tracker(opened.header, facts)
    writer = TakeWriter(target, header, pack_first_state(opened.first_state))
    late_us = track.time_us + round(1e6 * (BEGINS_S + 0.05))
    arrival_ns = opened.header.start_utc_ns + 1000 * late_us
    own_us = arrival_ns // 1000 if own_us is None else own_us(late_us)
    poses = Poses(arrival_ns, own_us, track.t_room_terminal, track.q_room_terminal, track.quality)
    told = 0
    for arrived_ns, chunk in opened.chunks():
        while told < len(poses) and arrival_ns[told] < arrived_ns:
            writer.write_poses(poses[told : told + 1])
            told += 1
        writer.write(arrived_ns, chunk)
    return writer.close(opened.summary)


def test_a_track_that_was_recorded_with_the_take_gives_the_same_places(
    take, track, motion, root, tmp_path
):
    opened = open_take(recorded(take, track, tmp_path / "with.mcap"))
    assert opened.summary.poses == len(opened.poses()) > 500
    setup = opened.header.setup
    np.testing.assert_array_equal(process(opened).q_world_sensor, motion.q_world_sensor)
    mine = root_of(opened, setup, motion)
    assert mine.facts.offset_s == pytest.approx(0.05, abs=0.005)
    assert mine.facts.source == "lsl:room"
    off = np.linalg.norm(mine.t_room_elbow - root.t_room_elbow, axis=-1)
    assert np.nanmax(off[motion.time_us > 5_000_000]) < 0.004
    save_track(opened.path, load_track(take))  # what somebody added counts
    assert root_of(opened, setup, motion).facts.source == "t.csv"


@pytest.mark.parametrize("own_us", [np.zeros_like, lambda late: late + 987_654_321_000])
def test_a_tracker_without_a_clock_or_with_its_own_is_aligned(take, track, root, tmp_path, own_us):
    opened = open_take(recorded(take, track, tmp_path / "clocks.mcap", own_us))
    mine = root_of(opened, opened.header.setup, process(opened))
    off = np.linalg.norm(mine.t_room_elbow - root.t_room_elbow, axis=-1)
    assert np.nanmax(off[root.time_us > 5_000_000]) < 0.005


def test_what_cannot_be_aligned_is_said_and_stops_nothing(take, track, motion, tmp_path):
    frozen = replace(
        track, q_room_terminal=np.tile(track.q_room_terminal[:1], (len(track.q_room_terminal), 1))
    )
    opened = open_take(recorded(take, frozen, tmp_path / "frozen.mcap"))
    assert root_of(opened, opened.header.setup, motion) is None
    why = root_or_why(opened, opened.header.setup, motion)
    assert "does not turn as the sensor does" in why.what
    again = root_or_why(opened, opened.header.setup, motion)  # as it was kept
    assert (again.what, again.remedy) == (why.what, why.remedy)
    swapped = TrackerFacts("lsl:room", "hand", "SN1")
    opened = open_take(recorded(take, track, tmp_path / "swapped.mcap", facts=swapped))
    assert "does not stay with SN1" in root_or_why(opened, opened.header.setup, motion).what


def test_a_part_of_a_take_has_its_poses(take, track, root, tmp_path):
    part = open_take(trim(open_take(recorded(take, track, tmp_path / "long.mcap")), 6.0, 12.0))
    again = root_of(part, part.header.setup, process(part))
    first = np.searchsorted(root.time_us, again.time_us[0])
    off = again.t_room_elbow - root.t_room_elbow[first : first + len(again.time_us)]
    assert np.nanmax(np.linalg.norm(off[200:], axis=-1)) < 0.012


def _track(take: Path, sensor: str) -> Track:
    truth, rng = load_truth(take), np.random.default_rng(2)
    k, time_s = truth.sensors.index(sensor), truth.time_us * 1e-6
    time_s = time_s - time_s[0]
    at = np.arange(BEGINS_S, time_s[-1] - 0.1, 1.0 / 60.0)
    q = attitude_at(time_s, truth.q_world_sensor[:, k].astype(float), at)
    t = CubicSpline(time_s, truth.t_world_sensor[:, k].astype(float))(at)
    t = ORIGIN + so3.rotate(ROOM, t + so3.rotate(q, np.array(LEVER)))
    q = so3.multiply(so3.multiply(ROOM, q), so3.exp(rng.normal(0.0, 0.0026, (len(at), 3))))
    time_us = np.round((at - BEGINS_S) * 1e6).astype(np.int64)
    t = t + rng.normal(0.0, 0.001, t.shape)
    return Track("hand", time_us, t, q, np.ones(len(at)))
