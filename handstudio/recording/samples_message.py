"""Imported samples as messages: float64 little endian, never squeezed through int16."""

from __future__ import annotations

import numpy as np

from handstudio.samples import ImuSamples

_FIELDS = (("time_us", "<i8"), ("gyr", "<f8"), ("acc", "<f8"), ("mag", "<f8"))
_FLAGS = ("fresh", "valid", "saturated")


def encode_samples(samples: ImuSamples) -> bytes:
    """One message: instants (u32), sensors (u32), then the arrays one after the other."""
    size = np.array([len(samples), samples.gyr.shape[1]], dtype="<u4").tobytes()
    arrays = [getattr(samples, name).astype(kind).tobytes() for name, kind in _FIELDS]
    flags = [getattr(samples, name).astype("u1").tobytes() for name in _FLAGS]
    return b"".join([size, *arrays, *flags])


def decode_samples(data: bytes) -> ImuSamples:
    """Inverse of `encode_samples`.

    Raises:
        ValueError: the message has another length than its sizes say.
    """
    count, sensors = (int(x) for x in np.frombuffer(data, "<u4", 2))
    at = 8
    parts: list[np.ndarray] = []
    shapes = [(count,), *[(count, sensors, 3)] * 3, *[(count, sensors)] * 3]
    kinds = [kind for _, kind in _FIELDS] + ["u1"] * len(_FLAGS)
    for shape, kind in zip(shapes, kinds, strict=True):
        items = int(np.prod(shape))
        parts.append(np.frombuffer(data, kind, items, at).reshape(shape))
        at += items * np.dtype(kind).itemsize
    if at != len(data):
        raise ValueError(f"{len(data)} bytes where {at} were announced")
    time, gyr, acc, mag, *flags = parts
    return ImuSamples(time.astype(np.int64), gyr, acc, mag, *(flag.astype(bool) for flag in flags))
