"""Every fault raises the finding it should, of the sensor it should, and no other one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handstudio.health.findings import PER_SENSOR, UNITS, Finding, Kind
from handstudio.health.limits import LIMITS, OFF_S
from handstudio.protocol.packets import (
    Corruption,
    Health,
    Packet,
    Reason,
    Restart,
    Temperature,
)
from handstudio.samples import FULL_SCALE

from .conftest import Glove, Seen, glove, watched, with_missing

BAD = 7  # index of the sensor that is spoilt


def spoilt(
    seen: Seen, kind: Kind, level: str = "act", sensors: tuple[int, ...] = (BAD,)
) -> Finding:
    """The worst finding of this kind; there is no other kind, and it is of these sensors."""
    assert seen.kinds() == {kind}
    found = max((finding for _, finding in seen.of(kind)), key=lambda one: one.value)
    worst = {"act"} if level == "act" else {"note"}
    assert worst <= {finding.level for _, finding in seen.of(kind)} <= {"note", level}
    assert found.sensors == sensors
    assert found.value > LIMITS[kind].note
    return found


def test_every_kind_has_a_limit_and_a_unit():
    assert set(LIMITS) == set(UNITS) == set(Kind)
    assert set(Kind) > PER_SENSOR


# --- a sensor -------------------------------------------------------------------------------------


FAST = pytest.param(1000, marks=pytest.mark.long)


@pytest.mark.parametrize("motion", ["rest", "showcase"])
@pytest.mark.parametrize("rate_hz", [100, FAST])
def test_a_stuck_sensor(rate_hz, motion):
    one = glove(rate_hz, 6.0, motion=motion)
    at = 2 * rate_hz
    one.counts[at:, BAD, :6] = one.counts[at, BAD, :6]
    found = spoilt(watched(one, one.chunks(at_once=4)), Kind.STUCK)
    assert found.value == pytest.approx(4.0, abs=1.0)
    assert found.since == pytest.approx(2.0, abs=0.5)


@pytest.mark.parametrize("part", [slice(0, 3), slice(3, 6)])
def test_a_sensor_of_which_one_half_is_stuck_while_it_moves(part):
    one = glove(seconds=9.0, motion="showcase")
    one.counts[:, BAD, part] = one.counts[0, BAD, part]
    spoilt(watched(one, one.chunks()), Kind.STUCK)


def test_half_of_the_sensors_may_be_stuck():
    one = glove(seconds=4.0)
    one.counts[:, :12, :6] = one.counts[0, :12, :6]
    spoilt(watched(one, one.chunks()), Kind.STUCK, sensors=tuple(range(12)))


@pytest.mark.parametrize("rate_hz", [100, FAST])
@pytest.mark.parametrize("part", [slice(0, 3), slice(3, 6), slice(4, 5)])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_a_noisy_sensor(part, rate_hz, seed):
    one = glove(rate_hz, 6.0, seed)
    usual = np.diff(one.counts[:, 0, part].astype(float), axis=0).std() / np.sqrt(2.0)
    noise = np.random.default_rng(seed).normal(0.0, 20.0 * usual, one.counts[:, BAD, part].shape)
    one.counts[:, BAD, part] += np.rint(noise).astype(np.int16)
    found = spoilt(watched(one, one.chunks(at_once=4)), Kind.NOISY)
    assert found.value == pytest.approx(20.0, rel=0.3)


def test_noise_is_not_judged_while_the_hand_moves_and_stays_told():
    one = glove(seconds=16.0, motion="showcase")  # at rest until 3.5 s
    noise = np.random.default_rng(1).normal(0.0, 40.0, one.counts[:, BAD, 3:6].shape)
    one.counts[:, BAD, 3:6] += np.rint(noise).astype(np.int16)
    seen = watched(one, one.chunks())
    assert spoilt(seen, Kind.NOISY).since == 0.0
    assert seen.watch.findings[0].kind is Kind.NOISY


def test_a_hand_that_trembles_is_not_noisy():
    """A tremor of 10 Hz in one finger, the others at rest."""
    one = glove(seconds=8.0)
    tremor = 25.0 * np.sin(2 * np.pi * 10.0 * np.arange(len(one.counts)) / 100.0)  # 1.5 deg/s
    one.counts[:, BAD, 3] += np.rint(tremor).astype(np.int16)
    assert watched(one, one.chunks()).findings == []


@pytest.mark.parametrize("column", [1, 4])
@pytest.mark.parametrize("limit", [-FULL_SCALE, FULL_SCALE - 1])
def test_a_saturated_sensor(column, limit):
    one = glove(seconds=6.0, motion="fast")
    one.counts[200:220, BAD, column] = limit
    seen = watched(one, one.chunks())
    assert spoilt(seen, Kind.SATURATED).value == pytest.approx(40.0, abs=20.0)
    health = seen.watch.end_take()
    assert [sensor.saturated for sensor in health.sensors] == [20 * (i == BAD) for i in range(20)]


def test_a_single_saturated_instant_is_worth_a_note():
    one = glove(seconds=6.0, motion="fast")
    one.counts[230, BAD, 3] = FULL_SCALE - 1
    spoilt(watched(one, one.chunks()), Kind.SATURATED, "note")


def test_a_silent_sensor():
    one = glove(seconds=6.0)
    one.answering[200:, BAD] = False
    one.counts[200:, BAD] = 0
    seen = watched(one, one.chunks())
    assert spoilt(seen, Kind.SILENT).value == 100.0
    assert seen.watch.view(0).silent == (BAD,)
    health = seen.watch.end_take()
    assert [sensor.silent for sensor in health.sensors] == [400 * (i == BAD) for i in range(20)]


def test_a_sensor_that_answers_now_and_then_is_silent_not_stuck_or_noisy():
    one = glove(seconds=6.0)
    one.answering[::10, BAD] = False
    one.counts[::10, BAD] = 0
    spoilt(watched(one, one.chunks()), Kind.SILENT, "note")


@pytest.mark.parametrize("motion", ["rest", "showcase"])
def test_a_magnet_comes_near_one_sensor(motion):
    one = glove(seconds=8.0, motion=motion)
    one.counts[300:, BAD, 6] += round(35.0 / one.ranges.mag * FULL_SCALE)
    found = spoilt(watched(one, one.chunks()), Kind.MAGNETIC)
    assert found.since == pytest.approx(3.0, abs=0.5)


def test_a_magnet_is_there_from_the_start():
    one = glove(seconds=6.0)
    one.counts[:, BAD, 6] += round(35.0 / one.ranges.mag * FULL_SCALE)
    spoilt(watched(one, one.chunks()), Kind.MAGNETIC)


def test_the_field_turns_but_keeps_its_size():
    """What a size alone does not show: 25 degrees more dip."""
    one = glove(seconds=8.0)
    mag = one.counts[300:, :17, 6:].astype(float)  # the thumb does not lie flat
    level = np.linalg.norm(mag[..., :2], axis=-1)
    size, dip = np.hypot(level, mag[..., 2]), np.arctan2(-mag[..., 2], level) + np.deg2rad(25.0)
    turned = np.stack(
        [*(mag[..., k] / level * size * np.cos(dip) for k in (0, 1)), -size * np.sin(dip)], axis=-1
    )
    one.counts[300:, :17, 6:] = np.rint(turned).astype(np.int16)
    found = spoilt(watched(one, one.chunks()), Kind.MAGNETIC, sensors=tuple(range(17)))
    assert found.value == pytest.approx(100.0 * 2.0 * np.sin(np.deg2rad(12.5)), rel=0.15)


def test_a_glove_that_warms_up():
    one = glove(seconds=6.0)
    packets: list[Packet] = list(one.packets())
    warm = np.full(20, 31.0)
    warm[BAD] += 6.5
    packets.insert(0, Temperature(0, np.full(20, 31.0)))
    packets.insert(300, Temperature(0, warm))
    seen = watched(one, one.chunks(packets))
    assert spoilt(seen, Kind.WARMED, "note").value == pytest.approx(6.5)
    assert seen.watch.view(0).sensors[BAD].warmed_celsius == pytest.approx(6.5)
    sensor = seen.watch.end_take().sensors[BAD]
    assert (sensor.celsius_first, sensor.celsius_last) == (31.0, 37.5)


# --- the stream -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("every", "level"), [(300, "note"), (25, "act")])
def test_loss(every, level):
    one = glove(seconds=8.0)
    packets = with_missing(p for k, p in enumerate(one.packets()) if k % every != 20)
    seen = watched(one, one.chunks(packets))
    spoilt(seen, Kind.LOSS, level, ())
    lost = len(range(20, 800, every))
    assert seen.watch.view(0).missing == lost
    assert seen.watch.end_take().loss_percent == pytest.approx(100.0 * lost / 800)


@pytest.mark.parametrize(("every", "level"), [(400, "note"), (20, "act")])
def test_damage(every, level):
    one = glove(seconds=6.0)
    packets: list[Packet] = []
    for k, packet in enumerate(one.packets()):
        packets += [packet] if k % every != 15 else [packet, Corruption(Reason.CHECKSUM, 80)]
    spoilt(watched(one, one.chunks(packets)), Kind.DAMAGED, level, ())


def test_instants_that_the_device_dropped():
    one = glove(seconds=6.0)
    packets: list[Packet] = list(one.packets())
    for second in range(1, 6):  # it tells every second, and had dropped 1000 before we came
        packets.insert(second * 101, Health(0, 0, 1000 + 10 * max(0, second - 2), 5000, (0,) * 20))
    seen = watched(one, one.chunks(packets))
    spoilt(seen, Kind.DROPPED, "act", ())
    assert seen.watch.view(0).dropped_by_device == 1030
    assert seen.watch.end_take().dropped_by_device == 30


def test_a_restart():
    one = glove(seconds=6.0)
    packets: list[Packet] = list(one.packets())
    for packet in one.packets()[300:]:
        packets[packet.sequence] = replace(packet, clock_us=packet.clock_us - 10_000_000)
    packets.insert(300, Restart(2))
    seen = watched(one, one.chunks(packets))
    found = spoilt(seen, Kind.RESTARTED, "note", ())
    assert found.value == 1.0
    assert seen.watch.end_take().restarts == 1


@pytest.mark.parametrize(("factor", "level"), [(1.05, "note"), (1.5, "act"), (0.97, "note")])
def test_a_device_whose_rate_is_not_what_it_told(factor, level):
    one = glove(seconds=6.0)
    slow = replace(
        one, clock_us=np.rint(7_300_000 + (one.clock_us - 7_300_000) * factor).astype(int)
    )
    seen = watched(slow, slow.chunks())
    spoilt(seen, Kind.RATE, level, ())
    assert seen.watch.view(0).measured_rate_hz == pytest.approx(100.0 / factor, rel=1e-3)


def late(one: Glove, share: float, ms: float) -> Seen:
    rng = np.random.default_rng(2)
    chunks = [
        (packets, events, arrival_ns + round(1e6 * (ms if rng.random() < share else rng.random())))
        for packets, events, arrival_ns in one.chunks()
    ]
    return watched(one, chunks)


def test_chunks_that_come_unevenly():
    found = spoilt(late(glove(seconds=8.0), 0.2, 120.0), Kind.JITTER, "note", ())
    assert found.value == pytest.approx(120.0, rel=0.06)
    assert late(glove(seconds=8.0), 0.01, 120.0).findings == []


@pytest.mark.parametrize(("ms", "level"), [(60.0, "note"), (150.0, "act")])
def test_poses_that_come_late(ms, level):
    one = glove(seconds=4.0)
    found = spoilt(watched(one, one.chunks(), ms), Kind.LATE, level, ())
    assert found.value == pytest.approx(ms, rel=0.05)


def test_a_clock_that_drifts():
    one = glove(50, 40.0)
    chunks = [
        (packets, events, arrival_ns + round((packets[0].clock_us - 7_300_000) * 1000 * 2e-3))
        for packets, events, arrival_ns in one.chunks()
    ]
    found = spoilt(watched(one, chunks), Kind.DRIFT, "note", ())
    assert found.value == pytest.approx(2000.0, rel=0.05)


@pytest.mark.long
def test_a_host_that_stood_still_is_not_a_clock_that_drifts():
    one = glove(50, 40.0)
    chunks = [
        (packets, events, max(arrival_ns, 1_800_000_002_000_000_000 + 34_000_000_000))
        if 1_800_000_031_000_000_000 < arrival_ns < 1_800_000_036_000_000_000
        else (packets, events, arrival_ns)
        for packets, events, arrival_ns in one.chunks()
    ]
    assert Kind.DRIFT not in watched(one, chunks).kinds()


# --- on and off -----------------------------------------------------------------------------------


def test_a_finding_goes_when_it_has_been_well_for_two_seconds():
    one = glove(seconds=10.0)
    one.answering[200:300, BAD] = False
    seen = watched(one, one.chunks())
    times = [at for at, _ in seen.of(Kind.SILENT)]
    assert 2.0 < times[0] <= 3.0
    assert times[-1] == pytest.approx(3.0 + OFF_S, abs=0.6)
    (episode,) = seen.watch.end_take().episodes
    assert (episode.kind, episode.level, episode.sensors) == ("silent", "act", (BAD,))
    assert episode.start_s == pytest.approx(2.0, abs=0.5)
    assert episode.end_s == pytest.approx(3.0, abs=0.5)
    assert episode.worst == 100.0


def test_a_finding_does_not_flicker():
    one = glove(seconds=12.0)
    for at in range(200, 900, 120):  # bad for a moment, well for a second
        one.answering[at : at + 10, BAD] = False
    seen = watched(one, one.chunks())
    times = [at for at, _ in seen.of(Kind.SILENT)]
    assert np.diff(times).max() < 0.02
    assert len(seen.watch.end_take().episodes) == 1
