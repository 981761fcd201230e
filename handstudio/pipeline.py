"""The pipeline: events in, motion out. Live, replay and batch run this same code.

The state is one value. Cutting the events anywhere, or saving and resuming the state, changes no
digit of the motion. The only clock is the device's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import IntFlag
from itertools import pairwise
from typing import Any, Literal

import msgspec
import numpy as np
from jaxtyping import Bool, Float, Float32, Int64, UInt8

from handstudio.arrays import Array
from handstudio.calibration.correction import CorrectionState
from handstudio.calibration.device import corrected
from handstudio.calibration.rest import REST_S, Rest, first_rest
from handstudio.errors import SetupError
from handstudio.fusion.filter import ALIGNED_SD, COMPASS_SD, UNKNOWN_SD, Fused, sees_all
from handstudio.hand_fit import mechanism_of
from handstudio.maths import so3
from handstudio.samples import Event, Gap, ImuSamples, Why
from handstudio.setup import Setup

BRIDGE_S = 0.25
"""Longest gap that is bridged by interpolation; after a longer one attitudes begin anew. After a
longer silence of one sensor its attitude is in doubt until it rests."""

_JUMP = 1.5  # sample periods: a longer step means that instants are missing


class Doubt(IntFlag):
    """Why an orientation should not be taken at face value."""

    UNPLACED = 1  # not yet initialised at rest (start, or after a long gap or silence)
    AFTER_GAP = 2  # the first instant after missing ones
    SATURATED = 4
    SILENT = 8  # the sensor did not answer: its orientation is held


@dataclass(frozen=True, slots=True)
class Motion:
    """What comes out: orientations of all sensors with a time axis and doubts."""

    time_us: Int64[Array, " n"]  # device time, continued over restarts of the device
    q_world_sensor: Float[Array, "n s 4"]
    q_world_start: Float[Array, "n 4"]  # first placed attitude of the forearm's sensor; NaN before
    doubt: UInt8[Array, "n s"]
    sd_rad: Float32[Array, "n s 2"]  # as the filter has it, of an orientation and of it relative

    def __len__(self) -> int:
        return len(self.time_us)

    def __getitem__(self, part: slice) -> Motion:
        return Motion(
            self.time_us[part],
            self.q_world_sensor[part],
            self.q_world_start[part],
            self.doubt[part],
            self.sd_rad[part],
        )


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Everything the pipeline remembers between events."""

    filter: Any
    placed: Bool[Array, " s"]
    q_world_start: Float[Array, " 4"]
    recent: ImuSamples  # a window of samples, while a sensor still waits for its rest
    last: ImuSamples  # the newest sample, or none
    heard_us: Int64[Array, " s"]  # when each sensor answered last
    clock_offset_us: int  # what continues the time axis over restarts of the device
    resume_at_us: int | None  # after a restart: where on the time axis its first sample belongs
    correction: CorrectionState | None = None  # of a setup that corrects what sensors put out


def begin(setup: Setup) -> State:
    """State before the first event."""
    sensors = len(setup.layout.sensors)
    return State(
        filter=setup.filter.begin(sensors, setup.rate_hz, setup.magnetometer_rate_hz),
        placed=np.zeros(sensors, dtype=bool),
        q_world_start=np.full(4, np.nan),
        recent=_nothing(sensors),
        last=_nothing(sensors),
        heard_us=np.zeros(sensors, dtype=np.int64),
        clock_offset_us=0,
        resume_at_us=None,
        correction=_uncorrected(setup),
    )


def run(setup: Setup, state: State, events: Iterable[Event]) -> tuple[Motion, State]:
    """Turn events into motion.

    Returns:
        The motion of these events, one instant a sample, and the state to go on from.
    """
    sensors = len(setup.layout.sensors)
    motions = [empty(sensors)]
    for event in events:
        match event:
            case Gap(why=Why.RESTART, elapsed_us=elapsed):
                state = _after_restart(setup, state, elapsed)
            case Gap():
                pass  # the step in the clock tells the same, and how long it was
            case ImuSamples() if event.gyr.shape[1] == sensors:
                state = _run_samples(setup, state, _freed(setup, event), motions)
            case ImuSamples():
                pass  # of a device that restarted with other sensors: not this setup's motion
    return turned(setup, join(motions)), state


def unsure(doubt: UInt8[Array, "n s"]) -> Float32[Array, "n s 2"]:
    """How sure a filter is that does not tell."""
    return np.full((*doubt.shape, 2), np.inf, dtype=np.float32)


def empty(sensors: int) -> Motion:
    """A motion of no instants."""
    return Motion(
        np.empty(0, dtype=np.int64),
        np.empty((0, sensors, 4)),
        np.empty((0, 4)),
        np.empty((0, sensors), dtype=np.uint8),
        np.empty((0, sensors, 2), dtype=np.float32),
    )


def join(motions: list[Motion]) -> Motion:
    """One motion after the other."""
    if len(motions) == 1:
        return motions[0]
    return Motion(*(np.concatenate([getattr(m, name) for m in motions]) for name in _FIELDS))


def turned(setup: Setup, motion: Motion) -> Motion:
    """Orientations whose headings agree (4.22): a turn of each sensor about the vertical.

    A filter that sees the sensors together has them so already.
    """
    if not setup.heading_rad or sees_all(setup.filter):
        return motion
    return with_headings(setup, motion)


def with_headings(setup: Setup, motion: Motion) -> Motion:
    """A motion with each sensor turned by the setup's heading."""
    turns = so3.about_z(np.array(setup.heading_rad))
    start = motion.q_world_start
    forearm = setup.layout.drivers.get("forearm")
    if forearm is not None:
        start = so3.multiply(turns[forearm], start)
    turned = so3.multiply(turns, motion.q_world_sensor)
    return replace(motion, q_world_sensor=turned, q_world_start=start)


def reheaded(before: Setup, after: Setup, state: State) -> State:
    """What a state becomes where nothing but the setup's headings changes."""
    if not sees_all(after.filter):
        return state
    sensors = len(after.layout.sensors)
    none = (0.0,) * sensors
    by = np.array(after.heading_rad or none) - np.array(before.heading_rad or none)
    turns = so3.about_z(by)
    start, forearm = state.q_world_start, after.layout.drivers.get("forearm")
    if forearm is not None:
        start = so3.multiply(turns[forearm], start)
    return replace(state, filter=after.filter.turned(state.filter, turns), q_world_start=start)


def rejoined(setup: Setup, state: State) -> State:
    """What a state becomes where the hand changes, or how the glove sits on it, to this setup's."""
    if not sees_all(setup.filter):
        return state
    return replace(state, filter=setup.filter.rejoined(state.filter))


_FIELDS = ("time_us", "q_world_sensor", "q_world_start", "doubt", "sd_rad")


def _freed(setup: Setup, samples: ImuSamples) -> ImuSamples:
    """Readings without the errors of the sensors, as far as they are known."""
    if setup.sensors is None:
        return samples
    return corrected(samples, setup.sensors, setup.layout.names)


def _run_samples(setup: Setup, state: State, samples: ImuSamples, motions: list[Motion]) -> State:
    if state.resume_at_us is not None:
        offset = state.resume_at_us - int(samples.time_us[0])
        state = replace(state, clock_offset_us=offset, resume_at_us=None)
    samples = replace(samples, time_us=samples.time_us + state.clock_offset_us)
    times = np.concatenate([state.last.time_us, samples.time_us])
    stretch = np.diff(times) * (setup.rate_hz * 1e-6)
    if len(state.last) == 0:
        stretch = np.concatenate([[1.0], stretch])
    cuts = [0, *(int(i) for i in np.flatnonzero(stretch > _JUMP) if i > 0), len(samples)]
    for start, end in pairwise(cuts):
        if end == start:
            continue
        part, state = _corrected(setup, state, samples[start:end], stretch[start:end])
        if stretch[start] > _JUMP:
            state, stretch[start] = _over_gap(setup, state, part, stretch[start])
            flag = Doubt.AFTER_GAP
        else:
            flag = Doubt(0)
        first = len(motions)
        state = _run_unbroken(setup, state, part, stretch[start:end], motions)
        motions[first].doubt[0] |= np.uint8(flag)
    return state


def _corrected(
    setup: Setup, state: State, samples: ImuSamples, stretch: Array
) -> tuple[ImuSamples, State]:
    """Signals as the thesis's filter of single outputs has them, where the setup asks for it."""
    if setup.correction is None or state.correction is None:
        return samples, state
    before = state.correction
    if stretch[0] > BRIDGE_S * setup.rate_hz:  # nothing is left of what was read before
        before = setup.correction.restart(before)
    samples, after = setup.correction.run(before, samples, stretch)
    return samples, replace(state, correction=after)


def _uncorrected(setup: Setup) -> CorrectionState | None:
    if setup.correction is None:
        return None
    return setup.correction.begin(len(setup.layout.sensors), setup.rate_hz)


def _run_unbroken(
    setup: Setup, state: State, samples: ImuSamples, stretch: Array, motions: list[Motion]
) -> State:
    """Fuse samples without a gap; a sensor that was silent for long waits for its rest anew."""
    answered = np.where(samples.valid, samples.time_us[:, None], 0)
    heard = np.maximum.accumulate(np.concatenate([state.heard_us[None], answered]))
    silence = samples.time_us[:, None] - heard[:-1]
    back = samples.valid & (silence > BRIDGE_S * 1e6)
    cuts = [0, *(int(i) for i in np.flatnonzero(back.any(axis=1)) if i > 0), len(samples)]
    for start, end in pairwise(cuts):
        state = replace(state, placed=state.placed & ~back[start])
        state = _run_placing(setup, state, samples[start:end], stretch[start:end], motions)
    return replace(state, heard_us=heard[-1])


def _run_placing(
    setup: Setup, state: State, samples: ImuSamples, stretch: Array, motions: list[Motion]
) -> State:
    """Fuse samples, placing each sensor at its first rest."""
    if state.placed.all():
        return _fuse(setup, state, samples, stretch, motions)
    window = max(2, round(REST_S * setup.rate_hz))
    known = len(state.recent)
    recent = _concatenate(state.recent, samples)
    rests = {
        int(sensor): found
        for sensor in np.flatnonzero(~state.placed)
        if (found := first_rest(recent, int(sensor), window, known)) is not None
    }
    done = 0
    for end in sorted({end for end, _ in rests.values()}):
        here = end - known
        part = slice(done, here)
        state = _fuse(setup, state, samples[part], stretch[part], motions)
        for sensor, (at, rest) in rests.items():
            if at == end:
                state = _place(setup, state, sensor, rest)
        done = here
    state = _fuse(setup, state, samples[done:], stretch[done:], motions)
    # nobody waits any more: nothing to keep, nothing to save with the state
    kept = 0 if state.placed.all() else min(len(recent), window - 1)
    return replace(state, recent=recent[len(recent) - kept :])


def _place(setup: Setup, state: State, sensor: int, rest: Rest) -> State:
    placed, attitude = state.placed.copy(), rest.q_world_sensor
    placed[sensor] = True
    fused: Any
    if not sees_all(setup.filter):
        fused = setup.filter.place(state.filter, sensor, attitude, rest.gyr_bias)
    else:
        heading_sd = COMPASS_SD if rest.compass else UNKNOWN_SD
        if setup.heading_rad:
            attitude = so3.multiply(so3.about_z(np.array(setup.heading_rad[sensor])), attitude)
            heading_sd = ALIGNED_SD
        fused = setup.filter.place(state.filter, sensor, attitude, rest.gyr_bias, heading_sd)
    start = state.q_world_start
    if sensor == setup.layout.drivers.get("forearm") and not np.isfinite(start).all():
        start = attitude
    return replace(state, filter=fused, placed=placed, q_world_start=start)


def _fuse(
    setup: Setup, state: State, samples: ImuSamples, stretch: Array, motions: list[Motion]
) -> State:
    if len(samples) == 0:
        return state
    given = (state.filter, samples, stretch, samples.valid, mechanism_of(setup))
    if sees_all(setup.filter):
        result: Fused[Any] = setup.filter.fused(*given)
    else:
        orientation, after = setup.filter.run(*given)
        unknown = np.full((*samples.valid.shape, 2), np.inf)
        result = Fused(orientation, unknown, after)
    doubt = (
        np.where(state.placed, 0, Doubt.UNPLACED)
        | np.where(samples.saturated, Doubt.SATURATED, 0)
        | np.where(samples.valid, 0, Doubt.SILENT)
    ).astype(np.uint8)
    start = np.tile(state.q_world_start, (len(samples), 1))
    sure = result.sd_rad.astype(np.float32)
    motions.append(Motion(samples.time_us, result.q_world_sensor, start, doubt, sure))
    return replace(state, filter=result.state, last=samples[-1:])


def _over_gap(setup: Setup, state: State, after: ImuSamples, periods: float) -> tuple[State, float]:
    """Carry the filter over missing instants, or begin anew where they are too many.

    Returns:
        The state, and the length of the step that is left to the first sample after the gap.
    """
    if periods > BRIDGE_S * setup.rate_hz:
        return _unplaced(state, setup.filter.restart(state.filter)), 1.0
    missing = round(periods) - 1
    share = (np.arange(1, missing + 1) / (missing + 1))[:, None, None]
    first, last = after[:1], state.last
    bridge = ImuSamples(
        time_us=np.full(missing, last.time_us[0]),
        gyr=(1 - share) * last.gyr + share * first.gyr,
        acc=(1 - share) * last.acc + share * first.acc,
        mag=np.repeat(last.mag, missing, axis=0),
        fresh=np.zeros((missing, last.gyr.shape[1]), dtype=bool),
        valid=np.repeat(last.valid & first.valid, missing, axis=0),
        saturated=np.zeros((missing, last.gyr.shape[1]), dtype=bool),
    )
    step = periods / (missing + 1)
    steps = np.full(missing, step)
    _, fused = setup.filter.run(state.filter, bridge, steps, bridge.valid, mechanism_of(setup))
    # a rest may not reach over a gap: nobody knows what happened in it
    return replace(state, filter=fused, recent=_nothing(len(state.placed))), step


def _after_restart(setup: Setup, state: State, elapsed_us: int) -> State:
    newest = state.last.time_us
    state = _unplaced(state, setup.filter.restart(state.filter))
    state = replace(state, correction=_uncorrected(setup))
    if len(newest) == 0:
        return state
    # the new epoch has a clock of its own; only the host knows how long the device was away
    resume_at = int(newest[0]) + max(elapsed_us, round(1e6 / setup.rate_hz))
    return replace(state, last=_nothing(len(state.placed)), resume_at_us=resume_at)


def _unplaced(state: State, fused: object) -> State:
    sensors = len(state.placed)
    return replace(
        state, filter=fused, placed=np.zeros(sensors, dtype=bool), recent=_nothing(sensors)
    )


def _nothing(sensors: int) -> ImuSamples:
    vectors = np.empty((0, sensors, 3))
    flags = np.empty((0, sensors), dtype=bool)
    return ImuSamples(np.empty(0, dtype=np.int64), vectors, vectors, vectors, flags, flags, flags)


def _concatenate(a: ImuSamples, b: ImuSamples) -> ImuSamples:
    return ImuSamples(
        *(np.concatenate([getattr(a, name), getattr(b, name)]) for name in ImuSamples.__slots__)
    )


# --- saving and resuming ------------------------------------------------------------------------


class _PackedSamples(msgspec.Struct):
    arrays: dict[str, bytes]
    count: int
    sensors: int


class _Packed(msgspec.Struct):
    version: Literal[2]
    filter: bytes
    placed: list[bool]
    q_world_start: list[float]
    recent: _PackedSamples
    last: _PackedSamples
    heard_us: list[int]
    clock_offset_us: int
    resume_at_us: int | None
    correction: bytes | None = None


def pack(setup: Setup, state: State) -> bytes:
    """Serialise a state, to the last bit."""
    return msgspec.msgpack.encode(
        _Packed(
            2,
            setup.filter.pack(state.filter),
            state.placed.tolist(),
            state.q_world_start.tolist(),
            _pack_samples(state.recent),
            _pack_samples(state.last),
            state.heard_us.tolist(),
            state.clock_offset_us,
            state.resume_at_us,
            _packed_correction(setup, state.correction),
        )
    )


def unpack(setup: Setup, packed: bytes) -> State:
    """Inverse of `pack`.

    Raises:
        SetupError: these bytes are not a state of this version's pipeline.
    """
    try:
        got = msgspec.msgpack.decode(packed, type=_Packed)
    except msgspec.MsgspecError as error:
        raise SetupError(
            "The pipeline state stored with this recording cannot be read: {reason}.",
            "Process the take from its start instead: handstudio process --from-start.",
            reason=error,
        ) from error
    return State(
        setup.filter.unpack(got.filter),
        np.array(got.placed, dtype=bool),
        np.array(got.q_world_start),
        _unpack_samples(got.recent),
        _unpack_samples(got.last),
        np.array(got.heard_us, dtype=np.int64),
        got.clock_offset_us,
        got.resume_at_us,
        _unpack_correction(setup, got.correction),
    )


def _packed_correction(setup: Setup, state: CorrectionState | None) -> bytes | None:
    return None if setup.correction is None or state is None else setup.correction.pack(state)


def _unpack_correction(setup: Setup, packed: bytes | None) -> CorrectionState | None:
    if setup.correction is None or packed is None:
        return _uncorrected(setup)
    return setup.correction.unpack(packed)


def _pack_samples(samples: ImuSamples) -> _PackedSamples:
    arrays = {name: getattr(samples, name).tobytes() for name in ImuSamples.__slots__}
    return _PackedSamples(arrays, len(samples), samples.gyr.shape[1])


def _unpack_samples(packed: _PackedSamples) -> ImuSamples:
    like = _nothing(packed.sensors)
    return ImuSamples(
        *(
            np.frombuffer(packed.arrays[name], dtype=getattr(like, name).dtype).reshape(
                packed.count, *getattr(like, name).shape[1:]
            )
            for name in ImuSamples.__slots__
        )
    )
