"""Setups: what a device says becomes what decides the output; equal setups have equal keys."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from handstudio import setup as setups
from handstudio.calibration.correction import CorrectionFilter
from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.subject import SubjectCalibration
from handstudio.errors import LayoutError, SetupError
from handstudio.fusion.vqf_filter import VqfFilter
from handstudio.layout import glove
from handstudio.protocol.packets import Description
from handstudio.samples import STANDARD_GRAVITY
from handstudio.setup import HandModel, JointGeometry, Setup, filter_named, for_device

ABOUT = Description(
    protocol=1,
    epoch=7,
    name="手袋",
    serial_number="42",
    firmware="1.2",
    side="left",
    sensors=(1, 11, 21),
    rate_hz=500,
    max_rate_hz=1000,
    magnetometer_rate_hz=100,
    accelerometer_range_g=8.0,
    gyroscope_range_dps=1000.0,
    magnetometer_range_ut=4912.0,
)

HAND = SubjectCalibration(
    id="20260203-040506-000",
    made_utc="2026-02-03T04:05:06Z",
    software="handstudio",
    subject="S01",
    side="left",
    hand_length_m=0.18,
    hand_type=3,
    device="42",
    segments=(),
    tips=(),
)


def test_a_device_that_described_itself_is_set_up():
    setup = for_device(ABOUT, "handstudio-1", HandModel(hand_length_m=0.17))
    assert setup.layout.names == ("SN1", "SN11", "Tip")
    assert setup.layout.side == "left"
    assert (setup.rate_hz, setup.magnetometer_rate_hz) == (500.0, 100.0)
    assert setup.decoder == "handstudio-1"
    assert setup.hand.hand_length_m == 0.17
    assert setup.ranges.acc == 8.0 * STANDARD_GRAVITY
    assert setup.ranges.gyr == pytest.approx(np.deg2rad(1000.0))
    assert (setup.device.name, setup.device.serial_number) == ("手袋", "42")


def test_a_device_without_magnetometers_has_no_rate_of_them():
    blind = replace(ABOUT, magnetometer_rate_hz=0, magnetometer_range_ut=0.0)
    assert for_device(blind, "handstudio-1").magnetometer_rate_hz is None


@pytest.mark.parametrize(
    ("said", "chosen", "expected"),
    [
        ("unknown", "right", "right"),
        ("unknown", None, "unknown"),
        ("left", "right", "left"),  # what the device knows stands
    ],
)
def test_a_person_says_which_hand_only_where_the_device_does_not_know(said, chosen, expected):
    setup = for_device(replace(ABOUT, side=said), "handstudio-1", side=chosen)
    assert setup.layout.side == expected


def test_a_device_with_a_sensor_no_glove_has_is_refused():
    with pytest.raises(LayoutError, match="SN30"):
        for_device(replace(ABOUT, sensors=(1, 30)), "handstudio-1")


def test_a_setup_survives_json():
    for setup in (
        for_device(ABOUT, "handstudio-1"),
        Setup(glove(), 285.714, filter=VqfFilter(tau_mag_s=30.0, use_magnetometer=False)),
    ):
        assert msgspec.json.decode(setups.encode(setup), type=Setup) == setup


def test_the_key_tells_every_change_and_nothing_else():
    setup = for_device(ABOUT, "handstudio-1")
    assert setup.key == for_device(ABOUT, "handstudio-1").key
    other = {
        "layout": glove("left"),
        "rate_hz": 501.0,
        "magnetometer_rate_hz": 50.0,
        "ranges": None,
        "decoder": None,
        "filter": VqfFilter(tau_acc_s=3.1),
        "hand": HandModel(hand_length_m=0.16),
        "device": None,
        "zero": "functional axes",
        "calibration": "S01-3",
        "sensors": DeviceCalibration("42", "2026-02-03T04:05:06Z", "handstudio", (), ()),
        "heading_rad": (0.1, 0.0, -0.1),
        "subject": HAND,
        "joints": (JointGeometry("elbow", (0.1, 0.0, 0.0), (0.0, 0.1, 0.0)),),
        "mean_rates": True,
        "smooth": True,
        "correction": CorrectionFilter(),
    }
    assert other.keys() == set(Setup.__struct_fields__)
    keys = {
        name: msgspec.structs.replace(setup, **{name: value}).key for name, value in other.items()
    }
    assert len({setup.key, *keys.values()}) == len(other) + 1


def test_filters_go_by_name():
    for name, default in setups.FILTERS.items():
        assert filter_named(name) == default
        assert msgspec.json.decode(msgspec.json.encode(default))["type"] == name
    with pytest.raises(SetupError, match=r"no filter 'kalman'.*\n.*vqf"):
        filter_named("kalman")
