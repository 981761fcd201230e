"""Short sounds for people whose eyes are elsewhere, as pages can play them."""

from __future__ import annotations

import base64
import io
import wave
from enum import Enum
from functools import cache

import numpy as np

_RATE_HZ = 16_000
_RAMP_S = 0.008  # a tone that starts or ends at once clicks


class Sound(Enum):
    """What is to be heard: tones as (pitch [Hz], length [s])."""

    TICK = ((660.0, 0.08),)
    START = ((990.0, 0.28),)
    STOP = ((660.0, 0.12), (440.0, 0.22))
    MARK = ((1320.0, 0.06),)
    ALARM = ((330.0, 0.18), (0.0, 0.07), (330.0, 0.18), (0.0, 0.07), (330.0, 0.18))


@cache
def as_html(sound: Sound) -> str:
    """An element that plays a sound as soon as a page holds it."""
    data = base64.b64encode(wav(sound)).decode()
    return f'<audio autoplay src="data:audio/wav;base64,{data}"></audio>'


def wav(sound: Sound) -> bytes:
    """A sound as a WAV file, one channel of 16 bit."""
    samples = np.concatenate([_tone(pitch, length) for pitch, length in sound.value])
    out = io.BytesIO()
    with wave.open(out, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(_RATE_HZ)
        file.writeframes((samples * 0.35 * 32767).astype("<i2").tobytes())
    return out.getvalue()


def _tone(pitch_hz: float, length_s: float) -> np.ndarray:
    at = np.arange(int(_RATE_HZ * length_s)) / _RATE_HZ
    ramp = np.clip(np.minimum(at, length_s - at) / _RAMP_S, 0.0, 1.0)
    return np.sin(2 * np.pi * pitch_hz * at) * ramp
