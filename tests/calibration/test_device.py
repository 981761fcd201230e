"""Corrections: they undo errors, cut anywhere alike, and survive as text or are refused."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handstudio.calibration.device import (
    FORMAT,
    Deviations,
    DeviceCalibration,
    Residuals,
    SensorErrors,
    Source,
    corrected,
    decode,
    encode,
    matrix,
    vector,
)
from handstudio.errors import CalibrationError
from handstudio.samples import ImuSamples

NAMES = ("SN1", "SN2", "SN3")


def samples(n: int = 200, seed: int = 0) -> ImuSamples:
    normal = np.random.default_rng(seed).standard_normal((3, n, len(NAMES), 3))
    flags = np.ones((n, len(NAMES)), dtype=bool)
    return ImuSamples(
        np.arange(n) * 10_000, normal[0], 10.0 * normal[1], 40.0 * normal[2], flags, flags, ~flags
    )


def errors(name: str, seed: int) -> tuple[SensorErrors, dict[str, np.ndarray]]:
    """An entry, and the forward errors that it undoes."""
    normal = np.random.default_rng(seed).standard_normal((5, 3, 3))
    forward = {k: np.eye(3) + 0.05 * normal[i] for i, k in enumerate(("acc", "gyr", "mag"))}
    forward |= {"per_acc": 1e-3 * normal[3], "bias": normal[4]}
    undone = {k: matrix(np.linalg.inv(forward[k])) for k in ("acc", "gyr", "mag")}
    acc_bias, gyr_bias, mag_bias = (vector(row) for row in forward["bias"])
    entry = SensorErrors(
        name=name,
        acc_matrix=undone["acc"],
        acc_bias=acc_bias,
        gyr_matrix=undone["gyr"],
        gyr_bias=gyr_bias,
        gyr_per_acc=matrix(forward["per_acc"]),
        mag_matrix=undone["mag"],
        mag_bias=mag_bias,
        residuals=Residuals(0.002, 0.0005),
        poses=20,
        sds=Deviations((1e-4,) * 3, (1e-3,) * 3, (1e-4,) * 3, (1e-5,) * 3),
    )
    return entry, forward


def calibration(*sensors: SensorErrors) -> DeviceCalibration:
    source = (Source("tumble", "0" * 64),)
    return DeviceCalibration("glove 7", "2026-01-02T03:04:05Z", "handstudio 0", source, sensors)


def test_a_correction_undoes_the_errors_it_was_made_for() -> None:
    felt = samples()
    entry, forward = errors("SN2", 1)
    acc = felt.acc[:, 1] @ forward["acc"].T + forward["bias"][0]
    gyr = felt.gyr[:, 1] @ forward["gyr"].T + forward["bias"][1]
    gyr = gyr + felt.acc[:, 1] @ forward["per_acc"].T
    mag = felt.mag[:, 1] @ forward["mag"].T + forward["bias"][2]
    read = replace(felt, acc=felt.acc.copy(), gyr=felt.gyr.copy(), mag=felt.mag.copy())
    read.acc[:, 1], read.gyr[:, 1], read.mag[:, 1] = acc, gyr, mag
    back = corrected(read, calibration(entry), NAMES)
    for name in ("acc", "gyr", "mag"):
        np.testing.assert_allclose(getattr(back, name), getattr(felt, name), atol=1e-12)


@given(cut=st.integers(1, 199))
def test_cutting_anywhere_changes_no_digit(cut: int) -> None:
    known = calibration(errors("SN1", 1)[0], errors("SN3", 2)[0])
    whole = corrected(samples(), known, NAMES)
    assert corrected(samples()[:cut], known, NAMES) == whole[:cut]
    assert corrected(samples()[cut:], known, NAMES) == whole[cut:]


def test_sensors_without_an_entry_stay_as_they_are() -> None:
    entry, _ = errors("SN2", 1)
    back = corrected(samples(), calibration(entry), NAMES)
    for name in ("acc", "gyr", "mag"):
        assert np.array_equal(getattr(back, name)[:, [0, 2]], getattr(samples(), name)[:, [0, 2]])
        assert not np.array_equal(getattr(back, name)[:, 1], getattr(samples(), name)[:, 1])
    assert corrected(samples(), calibration(errors("elsewhere", 1)[0]), NAMES) == samples()


def test_a_magnetometer_without_an_entry_staysas_it_is() -> None:
    entry = msgspec.structs.replace(errors("SN2", 1)[0], mag_matrix=None, mag_bias=None)
    assert np.array_equal(corrected(samples(), calibration(entry), NAMES).mag, samples().mag)


def test_text_is_readable_and_comes_back_equal() -> None:
    known = calibration(errors("SN1", 1)[0], errors("SN3", 2)[0])
    text = encode(known)
    assert decode(text) == known
    assert decode(text.encode()) == known
    assert '\n  "device": "glove 7",\n' in text


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": "one"}', '{"format": 1}', b"\xff\xfe"])
def test_broken_and_foreign_texts_are_refused(text: str | bytes) -> None:
    with pytest.raises(CalibrationError, match="no calibration of sensors"):
        decode(text)


def test_half_a_text_is_refused() -> None:
    text = encode(calibration(errors("SN1", 1)[0]))
    with pytest.raises(CalibrationError):
        decode(text[: len(text) // 2])


def test_a_newer_format_says_so_whatever_else_is_in_it() -> None:
    with pytest.raises(CalibrationError, match=f"format {FORMAT + 1}.*{FORMAT} at most"):
        decode(f'{{"format": {FORMAT + 1}, "anything": 1}}')


def test_a_sensor_named_twice_is_refused() -> None:
    entry, _ = errors("SN1", 1)
    with pytest.raises(CalibrationError, match="twice"):
        decode(encode(calibration(entry, entry)))
