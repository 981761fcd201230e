"""The health of takes: kept, absent in old and recovered ones, computed again."""

from __future__ import annotations

import msgspec
import pytest

from handstudio.health.record import TakeHealth
from handstudio.recording.header import Summary
from handstudio.recording.raw_import import import_folder
from handstudio.recording.recovery import recover
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take
from handstudio.recording.take_health import health_of_take, recomputed_health
from handstudio.recording.writer import TakeWriter


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    sessions = tmp_path_factory.mktemp("sessions")
    return open_take(simulate(sessions, rehearse(seed=4), seconds=3.0, health=True))


def test_a_simulated_take_keeps_its_health(take):
    health = take.summary.health
    assert health.instants == take.summary.packets == 301
    assert (health.missing, health.damaged, health.restarts) == (0, 0, 0)
    assert health.nominal_rate_hz == 100.0
    assert health.measured_rate_hz == pytest.approx(100.0)
    assert len(health.sensors) == 20
    assert health.sensors[0].celsius_last == 31.0
    assert health.episodes == ()
    assert health.latency is None
    assert health_of_take(take) is health


def test_the_bytes_tell_the_same_again(take):
    assert recomputed_health(take) == take.summary.health


def test_a_recovered_take_has_none_and_it_is_computed(take, tmp_path):
    broken = tmp_path / "broken.mcap.recording"
    broken.write_bytes(take.path.read_bytes()[:-400])
    recovered = open_take(recover(broken).path)
    assert recovered.summary is None
    health = health_of_take(recovered)
    assert 200 < health.instants <= 301
    assert health.measured_rate_hz == pytest.approx(100.0)


def test_a_summary_of_before_health_was_kept_is_still_read():
    old = b'{"chunks": 3, "bytes": 40, "duration_s": 0.5, "packets": 9, "missing": 1}'
    summary = msgspec.json.decode(old, type=Summary)
    assert summary.health is None
    assert summary.missing == 1


def test_a_kind_of_a_later_version_does_not_hide_a_take():
    later = msgspec.json.decode(
        b'{"chunks": 1, "bytes": 1, "duration_s": 1.0, "health": {"nominal_rate_hz": 100.0,'
        b'"measured_rate_hz": null, "instants": 3, "smell": 7, "episodes": [{"kind": "smelly",'
        b'"level": "act", "sensors": [2], "start_s": 1.0, "end_s": 2.5, "worst": 9.0}]}}',
        type=Summary,
    )
    assert isinstance(later.health, TakeHealth)
    (trouble,) = later.health.troubles
    assert (trouble.kind, trouble.unit, trouble.seconds) == ("smelly", "", 1.5)


def test_an_import_has_no_arrivals(tmp_path):
    folder = tmp_path / "foreign"
    folder.mkdir()
    header = ",".join(["time_s", *(f"SN1_{k}_{a}" for k in ("gyr", "acc") for a in "xyz")])
    rows = [f"{k / 100:.2f},{0.01 * (k % 3)},0,0,0,0,{9.81 + 0.01 * (k % 5)}" for k in range(200)]
    (folder / "samples.csv").write_text("\n".join([header, *rows]) + "\n")
    health = health_of_take(open_take(import_folder(folder, tmp_path, "S01", "foreign")))
    assert health.instants == 200
    assert health.jitter_p95_ms is None
    assert health.drift_ppm is None
    assert health.episodes == ()


def test_a_take_without_an_instant_has_a_health_too(header, tmp_path):
    writer = TakeWriter(tmp_path / "empty.mcap", header)
    health = health_of_take(open_take(writer.close(Summary(0, 0, 0.0))))
    assert (health.instants, health.measured_rate_hz, health.loss_percent) == (0, None, 0.0)
    assert health.troubles == ()
