"""Where the hand is in a tracker's room, live: found from the motion first, then followed.

The last half minute of motion and poses is kept. Every now and then they are aligned, as a take's
are; once that is possible the filter of `late_root` goes through what is kept and then along with
what comes. No clock and no thread: what came goes in, and what is known comes out.
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field, replace
from enum import Enum

import msgspec
import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.device.moves import SPAN_S, Moves, Part
from handstudio.device.orders import Moved
from handstudio.errors import CalibrationError
from handstudio.recorded_track import LeastDelayed, on_axis, rising
from handstudio.recording.tracker_message import Poses, TrackerFacts, joined
from handstudio.rooted import BELIEVED_SD_M, TOLD_S, elbow_of
from handstudio.setup import Setup
from handstudio.terminal import AGAIN_S, best_sensor, filter_of, tells
from handstudio.trackers import late_root
from handstudio.trackers.clocks import FIRST, TrackerClock, clock_of
from handstudio.trackers.late_align import Alignment
from handstudio.trackers.late_faults import Fate
from handstudio.trackers.late_root import Felt, RootFilter, RootState
from handstudio.trackers.track import Track

LEAST_S = 6.0
"""Before so much motion was seen nothing is aligned."""

_AGAIN_S = 1.5, 8.0  # between two tries, at first and after so long: a try may take half a second
_LONG_S = 15.0
_BETTER_S, _BETTER = 8.0, 0.9  # so often it is aligned anew, and that is used where it is so good
_WARM_S = 6.0  # the filter then goes through so much again
_TRUSTED_RAD = 0.05  # attitudes that agree no better may be of a motion that was too small yet
_RECENT = 60  # poses: a second, of which faults are told
_LOST = 300  # poses in a row that do not fit: it is sought anew
_JUMP_US = 60_000_000  # a time axis that goes on so much later is another one


class RootPhase(Enum):
    """How far it is."""

    WAITING = "waiting"  # for glove or tracker
    LOOKING = "looking"  # for the tracker's motion among those of the sensors
    FOLLOWING = "following"


@dataclass(frozen=True, slots=True, eq=False)
class RootNow:
    """What is known now.

    Attributes:
        phase: How far it is.
        seconds: While looking: how much motion was seen by both.
        why: Why it could not be aligned at the last try.
        sensor: The sensor the terminal sits on.
        delay_s: By which its poses are late, ways included.
        residual_rad: By how much attitudes differed when it was aligned.
        trouble: What happens to most poses of the last second, where they are not simply taken.
        time_us: The instant the place is of.
        setup: What the attitudes are fused by.
        t_room_elbow: [m].
        q_room_world: What takes the motion's attitudes into the room.
        sd_m: How sure the place of the sensor is; the place is the last that was sure enough.
    """

    phase: RootPhase = RootPhase.WAITING
    seconds: float = 0.0
    why: CalibrationError | None = None
    sensor: str = ""
    delay_s: float = 0.0
    residual_rad: float = 0.0
    trouble: Fate | None = None
    time_us: int = 0
    setup: Setup | None = None
    t_room_elbow: Float[Array, "3"] | None = None
    q_room_world: Float[Array, "4"] | None = None
    sd_m: float = np.inf


@dataclass(slots=True)
class Following:
    """Everything it remembers; for one thread.

    Attributes:
        facts: What was chosen, and is known of how the terminal sits.
        newest: What is known.
    """

    facts: TrackerFacts
    newest: RootNow = RootNow()
    _moves: Moves = field(default_factory=Moves)
    _clock: LeastDelayed = field(default_factory=LeastDelayed)
    _told: TrackerClock | None = None
    _waiting: list[Poses] = field(default_factory=list)  # until both clocks are known
    _tracks: deque[Track] = field(default_factory=deque)
    _axis_us: int | None = None
    _tried_us: int = 0
    _found: Alignment | None = None
    _filter: RootFilter | None = None
    _state: RootState | None = None
    _fates: deque[int] = field(default_factory=lambda: deque(maxlen=_LOST))

    def step(self, moves: list[Moved], poses: list[Poses]) -> RootNow:
        """Take in what came since the last step.

        Args:
            moves: Of the glove, oldest first.
            poses: Of the tracker, likewise.
        """
        moves = self._of_one_axis(moves)
        self._waiting += poses
        part = self._moves.add(moves)
        for move in moves:
            if len(move.motion):
                self._clock.observe(int(move.motion.time_us[-1]), move.arrival_ns)
        track = self._on_axis()
        if part is None or self._moves.setup is None:
            if track is not None and self._state is not None:
                self._follow(self._moves.parts[-1:], track, felt=False)
            return self.newest
        if self._state is not None:
            self._follow([part], track)
            if self._state is not None:
                self._look_again()
        elif self._moves.setup.layout.is_hand and self._tracks:
            self._look()
        return self.newest

    def _of_one_axis(self, moves: list[Moved]) -> list[Moved]:
        """Only what is of the newest setup and time axis; what was of others is forgotten."""
        mine = list[Moved]()
        for move in moves:
            if not len(move.motion):
                continue
            known, first_us = self._moves.setup, int(move.motion.time_us[0])
            known = mine[-1].setup if mine else known
            goes_on = self._axis_us is not None and 0 < first_us - self._axis_us < _JUMP_US
            if known is not None and not (goes_on and move.setup == known):
                mine.clear()
                self._moves.forget()
                self._clock = LeastDelayed()
                self._begin_anew()
            mine.append(move)
            self._axis_us = int(move.motion.time_us[-1])
        return mine

    def _begin_anew(self) -> None:
        self._state = self._filter = None
        self._fates.clear()
        self._tracks.clear()
        self.newest = RootNow()

    def _on_axis(self) -> Track | None:
        """Poses that came, on the motion's axis, once both clocks are known."""
        if self._told is None:
            waiting = joined(self._waiting)
            self._told = clock_of(waiting.arrival_ns // 1000, waiting.own_us)
            self._waiting = [waiting[-4 * FIRST :]]
        if self._told is None or self._clock.offset_us is None or not self._waiting:
            return None
        poses, self._waiting = joined(self._waiting), []
        offset_us = np.array([round(self._clock.offset_us)], dtype=np.int64)
        track = on_axis(poses, self._told, offset_us, self.facts.terminal or "terminal")
        if not len(poses):
            return None
        self._tracks.append(track)
        while track.time_us[-1] - self._tracks[0].time_us[-1] > SPAN_S * 1e6:
            self._tracks.popleft()
        return track

    # --- looking ----------------------------------------------------------------------------------

    def _look(self) -> None:
        setup, track = self._moves.setup, _joined(self._tracks)
        assert setup is not None and self._axis_us is not None  # noqa: PT018 - motion came
        seconds = min(self._moves.seconds, float(np.ptp(track.time_us)) * 1e-6)
        self.newest = replace(self.newest, phase=RootPhase.LOOKING, seconds=seconds)
        pause_s = _AGAIN_S[0] if seconds < _LONG_S else _AGAIN_S[1]
        if seconds < LEAST_S or self._axis_us - self._tried_us < pause_s * 1e6:
            return
        self._tried_us = self._axis_us
        whole = self._moves.whole()
        try:
            wanted = self.facts.sensor or None
            found, sensor = best_sensor(_in_time(setup), whole.motion, track, wanted, TOLD_S)
        except CalibrationError as error:
            self.newest = replace(self.newest, why=error)
            return
        if found.residual_rad > _TRUSTED_RAD and seconds < 0.8 * SPAN_S:
            return
        self._begin(found)
        self.newest = RootNow(
            RootPhase.FOLLOWING,
            sensor=sensor,
            residual_rad=found.residual_rad,
            setup=setup,
            delay_s=found.delay_s,
        )
        self._follow([whole], track)

    def _begin(self, found: Alignment) -> None:
        self._found, self._filter = found, filter_of(found, self.facts.lever_m)
        self._state = late_root.begin(self._filter)

    def _look_again(self) -> None:
        """Align by what came since, and begin from there where it is known better by that.

        The first alignment is often of seconds in which headings still settled; how the world lies
        in the room, gravity above all, is nothing that the filter mends.
        """
        setup, before = self._moves.setup, self._found
        assert setup is not None and self._axis_us is not None  # noqa: PT018 - it was found
        assert before is not None
        if self._axis_us - self._tried_us < _BETTER_S * 1e6:
            return
        self._tried_us = self._axis_us
        whole, track = self._moves.whole(), _joined(self._tracks)
        late, wanted = (
            (before.delay_s + AGAIN_S[0], before.delay_s + AGAIN_S[1]),
            self.newest.sensor,
        )
        try:
            found, _ = best_sensor(_in_time(setup), whole.motion, track, wanted, late)
        except CalibrationError:
            return  # it rests: what is known is known
        if found.doubt < _BETTER * before.doubt:
            self._begin(found)
            last = whole.last(_WARM_S)
            since = np.searchsorted(track.time_us, last.motion.time_us[0])
            self._follow([last], track[since:])

    # --- following --------------------------------------------------------------------------------

    def _follow(self, parts: list[Part], track: Track | None, *, felt: bool = True) -> None:
        setup, filter, state = self._moves.setup, self._filter, self._state
        assert setup is not None  # it was found
        assert filter is not None
        assert state is not None
        k, part = setup.layout.names.index(self.newest.sensor), parts[-1]
        motion = part.motion if felt else part.motion[:0]
        known = tells(motion, k)
        acc = part.acc[: len(motion), k]
        told = Felt(motion.time_us, motion.q_world_sensor[:, k], acc, known)
        placed, state = late_root.run(filter, state, told, _nothing() if track is None else track)
        self._state = state
        self._fates.extend(placed.fates.tolist())
        if len(motion):
            self._place(part, k, placed, state.delay_s)
        if (
            len(self._fates) == _LOST
            and self._state is not None
            and all(f in _ASTRAY for f in self._fates)
        ):
            self._begin_anew()

    def _place(self, part: Part, k: int, placed: late_root.Placed, delay_s: float) -> None:
        setup = self._moves.setup
        assert setup is not None
        now, last = self.newest, part.motion[-1:]
        sd_m = float(placed.sd_m[-1])
        now = replace(now, sd_m=sd_m, delay_s=delay_s, trouble=self._trouble())
        if sd_m <= BELIEVED_SD_M:
            t, q = placed.t_room_sensor[-1:], placed.q_room_world[-1:]
            elbow = elbow_of(setup, last, k, t, q)[0]
            at = int(last.time_us[0])
            now = replace(now, time_us=at, t_room_elbow=elbow, q_room_world=q[0])
        self.newest = now

    def _trouble(self) -> Fate | None:
        recent = list(self._fates)[-_RECENT:]
        if not recent:
            return None
        fate, count = Counter(recent).most_common(1)[0]
        return None if Fate(fate) is Fate.TAKEN or count < len(recent) / 2 else Fate(fate)


_ASTRAY = (Fate.TURNED, Fate.JUMPED, Fate.AFRESH)


def _in_time(setup: Setup) -> Setup:
    """A setup whose attitudes are of their instants as they come: `Moves` has seen to it."""
    return msgspec.structs.replace(setup, mean_rates=True)


def _joined(tracks: deque[Track]) -> Track:
    names = ("time_us", "t_room_terminal", "q_room_terminal", "quality")
    parts = (np.concatenate([getattr(track, name) for track in tracks]) for name in names)
    time_us, *poses = parts
    return Track(tracks[0].name, rising(time_us), *poses)


def _nothing() -> Track:
    time_us = np.zeros(0, dtype=np.int64)
    return Track("", time_us, np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(0))
