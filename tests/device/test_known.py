"""Calibrations and headings on a stream: used at once, never in the middle of a take."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest

from handstudio import pipeline
from handstudio.calibration.device import UNITY, DeviceCalibration, Residuals, SensorErrors
from handstudio.calibration.subject import SubjectCalibration
from handstudio.device.capture import Capture, _Wanted
from handstudio.device.known import Known
from handstudio.device.orders import (
    Connect,
    HeadingTaken,
    ResetHeading,
    SetFilter,
    SetHand,
    SetHeading,
    SetSensors,
    SetSubject,
)
from handstudio.errors import CalibrationError, DeviceError
from handstudio.fusion.raw import RawFilter
from handstudio.fusion.tree_filter import TreeFilter
from handstudio.fusion.vqf_filter import VqfFilter
from handstudio.layout import glove as glove_layout
from handstudio.setup import NO_CALIBRATION, HandModel, Setup, calibrated
from handstudio.warming import warm

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

HAND = SubjectCalibration(
    id="20260203-040506-000",
    made_utc="2026-02-03T04:05:06Z",
    software="handstudio",
    subject="S01",
    side="right",
    hand_length_m=0.18,
    hand_type=3,
    device="VG-0",
    segments=(),
    tips=(),
)
KNOWN = msgspec.structs.replace(HAND, id="20260203-040506-001", hand_length_m=0.19)
LEFT = msgspec.structs.replace(HAND, side="left")
BIAS = 0.01  # so little that the sensor still rests without it


def errors(serial: str) -> DeviceCalibration:
    one = SensorErrors(
        "SN1", UNITY, (0.0, 0.0, 0.0), UNITY, (0.0, 0.0, BIAS), Residuals(0.0, 0.0), 9
    )
    return DeviceCalibration(serial, "2026-02-03T04:05:06Z", "handstudio", (), (one,))


@pytest.fixture
def connected(studio: Any, glove: Any) -> Any:
    studio.connect(glove("tcp").address)
    studio.until(lambda newest: not newest.motion.doubt.any(), "every sensor is placed")
    return studio


def test_a_wearers_calibration_is_used_at_once_and_nothing_waits_for_a_rest(connected):
    connected.send(SetSubject(HAND))
    newest = connected.until(lambda newest: newest.setup.subject == HAND, "it is used")
    assert newest.setup.calibration == HAND.id
    connected.go_on(20)
    assert not connected.newest.motion.doubt.any()
    connected.send(SetSubject(None))
    connected.until(lambda newest: newest.setup.calibration == NO_CALIBRATION, "it is not")


def test_errors_of_sensors_are_taken_off_from_the_next_instant_on(connected):
    serial = connected.newest.setup.device.serial_number
    connected.send(SetSensors(errors("another")))
    connected.send(SetSensors(errors(serial)))
    connected.until(lambda newest: newest.setup.sensors is not None, "they are used")
    assert connected.newest.setup.sensors.device == serial
    connected.go_on(5)
    connected.until(lambda newest: not newest.motion.doubt.any(), "all were placed anew")
    assert not connected.reports


def test_a_take_keeps_the_calibration_it_began_with_and_the_other_comes_after(connected):
    connected.start_take()
    connected.send(SetSubject(HAND))
    connected.until(lambda _: connected.reports, "it is told")
    assert "keeps the one" in str(connected.reports[0])
    connected.go_on(30)
    assert connected.newest.setup.subject is None
    take = connected.stop_take()
    assert take.header.setup.subject is None
    connected.check(take)
    connected.until(lambda newest: newest.setup.subject == HAND, "it is used")


def test_a_take_with_calibration_and_headings_gives_the_motion_that_was_shown(connected):
    serial, count = connected.newest.setup.device.serial_number, 20
    connected.send(SetSubject(HAND))
    connected.send(SetSensors(errors(serial)))
    connected.send(SetHeading(tuple(np.linspace(-0.3, 0.3, count).tolist())))
    connected.until(
        lambda newest: newest.setup.heading_rad and newest.setup.sensors is not None, "all is used"
    )
    connected.go_on(30)
    connected.start_take()
    connected.go_on(100)
    take = connected.stop_take()
    assert take.header.setup == connected.newest.setup
    connected.check(take)


def test_the_calibration_of_the_other_hand_is_told_and_not_used(connected):
    connected.send(SetSubject(LEFT))
    connected.until(lambda _: connected.reports, "it is told")
    assert "left hand" in str(connected.reports[0])
    connected.go_on(20)
    assert connected.newest.setup.subject is None


def test_what_is_known_before_a_device_is_there_is_used_when_it_comes(studio, glove):
    studio.send(SetSubject(HAND))
    assert studio.connect(glove("tcp").address).setup.subject == HAND


def test_a_reset_turns_headings_without_a_rest_and_twice_is_as_once(connected):
    connected.send(SetHeading(tuple(np.linspace(-0.3, 0.3, 20).tolist())))
    connected.until(lambda newest: newest.setup.heading_rad, "they are used")
    connected.send(ResetHeading(None))
    connected.until(lambda newest: abs(newest.setup.heading_rad[3]) < 0.2, "it was turned back")
    once = np.array(connected.newest.setup.heading_rad)
    hand = connected.newest.setup.layout.drivers["hand"]
    assert once[hand] == pytest.approx(np.linspace(-0.3, 0.3, 20)[hand])
    connected.send(ResetHeading("SN1"))
    connected.until(lambda _: len(connected.reports) == 2, "both are told")
    connected.go_on(5)
    assert not connected.newest.motion.doubt.any()
    assert connected.reports == [HeadingTaken(None), HeadingTaken("SN1")]


def test_the_heading_stays_while_a_take_is_recorded(connected):
    before = connected.newest.setup
    connected.start_take()
    connected.send(ResetHeading(None))
    connected.send(SetHeading((0.1,) * 20))
    connected.until(lambda _: len(connected.reports) == 2, "both are told")
    for report in connected.reports:
        assert isinstance(report, DeviceError)
        assert "heading stays" in str(report)
    assert connected.newest.setup == before
    connected.stop_take()


def test_a_reset_of_a_sensor_that_is_not_there_is_told(connected):
    connected.send(ResetHeading("SN99"))
    connected.until(lambda _: connected.reports, "it is told")
    assert isinstance(connected.reports[0], CalibrationError)


def test_headings_are_of_the_device_that_they_were_found_on(connected, glove):
    connected.send(SetHeading((0.1,) * 20))
    connected.until(lambda newest: newest.setup.heading_rad, "they are used")
    assert connected.connect("virtual:?seed=4").setup.heading_rad == ()


def test_headings_of_so_many_other_sensors_are_left_out(connected):
    setup = connected.newest.setup
    assert Known(heading_rad=(0.1,)).on(setup)[0].heading_rad == ()


def test_another_filter_begins_anew_and_calibrations_stay(connected):
    connected.send(SetSubject(HAND))
    connected.send(SetFilter(RawFilter()))
    connected.until(lambda newest: newest.setup.filter == RawFilter(), "it is used")
    assert connected.newest.setup.subject == HAND
    connected.until(lambda newest: not newest.motion.doubt.any(), "all were placed anew")
    connected.send(SetSubject(None))
    connected.until(lambda newest: newest.setup.subject is None, "the filter was not touched")
    assert connected.newest.setup.filter == RawFilter()
    assert not connected.reports


def test_a_take_keeps_the_filter_it_began_with_and_the_other_comes_after(connected):
    connected.start_take()
    connected.send(SetFilter(RawFilter()))
    connected.until(lambda _: connected.reports, "it is told")
    assert "Another filter" in str(connected.reports[0])
    connected.go_on(30)
    take = connected.stop_take()
    assert take.header.setup.filter == VqfFilter()
    connected.check(take, unheard=10)
    connected.until(lambda newest: newest.setup.filter == RawFilter(), "it is used")


@pytest.mark.parametrize(
    "another", [SetSubject(HAND), SetSubject(None), SetHand(HandModel(hand_length_m=0.2))]
)
def test_of_another_hand_the_joints_are_learnt_anew_and_attitudes_stay(another):
    setup = calibrated(Setup(glove_layout(), 100.0, filter=TreeFilter()), subject=KNOWN)
    learnt = pipeline.begin(setup)
    learnt = replace(learnt, filter=replace(learnt.filter, turn=np.ones((20, 3))))
    capture = Capture()
    capture.newest = replace(capture.newest, setup=setup)
    capture._known = Known(subject=KNOWN, filter=setup.filter)
    capture._wanted = _Wanted(Connect("nowhere"))
    capture._state = learnt
    capture._follow(SetSubject(KNOWN))
    assert capture._state is learnt, "the same hand"
    capture._follow(another)
    assert capture.newest.setup != setup
    assert not capture._state.filter.turn.any()
    assert capture._state.filter.q is learnt.filter.q


@pytest.mark.long
def test_a_take_by_the_whole_hand_filter_gives_the_motion_that_was_shown(connected):
    warm()
    connected.send(SetFilter(TreeFilter()))
    connected.until(lambda newest: newest.setup.filter == TreeFilter(), "it is used")
    connected.until(lambda newest: np.isfinite(newest.motion.sd_rad).all(), "it tells how sure")
    connected.start_take()
    connected.go_on(60)
    connected.check(connected.stop_take())
