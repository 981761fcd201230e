"""The one owner of what the page shows: intents and reports go in, a state comes out.

Knows no viser; one thread calls `Studio.tick`, any thread may call `Studio.send`.
"""

from __future__ import annotations

import queue
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from app import comparison, diagnostics, intents, shaken, words
from app import live as live_history
from app import review as reviewing
from app.calibrating import Calibrator
from app.filtering import Chooser, Prepared
from app.holding import Holder
from app.jobs import Jobs, Stopped
from app.joint_finding import JointFinder
from app.keeping import Keeper
from app.look import LASTING, View, facing
from app.looking import Looked, Looker
from app.review import Review
from app.reviewer import Reviewer
from app.solving import Answer
from app.sounds import Sound
from app.state import Download, Message, State
from app.takes import Taker
from app.tracking import StreamsFound, Tracker, with_tracker
from app.words import _
from app.workshop import (
    Added,
    Computed,
    Exported,
    FoundIn,
    Gathered,
    MeasuredPart,
    OfJoint,
    Previewed,
    Solved,
    Surveyed,
    Trimmed,
    Uncomputed,
    Unseen,
    WayFound,
    Workshop,
    Written,
)
from handstudio.analysis.stretches import Stretch
from handstudio.calibrate import Calibrated
from handstudio.calibrate_sensors import SensorsFound
from handstudio.calibration.heading import HeadingAlignment
from handstudio.device.addresses import is_virtual
from handstudio.device.capture import Capture
from handstudio.device.orders import (
    Ask,
    Connect,
    Disconnect,
    HeadingTaken,
    NotePage,
    Phase,
    ResetHeading,
    SetHand,
    SetHeading,
    TakeDone,
)
from handstudio.errors import HandstudioError
from handstudio.export.part import Window
from handstudio.measure import band_from, bands_with
from handstudio.protocol.commands import PERFORM
from handstudio.protocol.packets import TIP_SENSOR, Command
from handstudio.recording import notes as noting
from handstudio.recording.recovery import recover
from handstudio.recording.take import Take, open_take
from handstudio.settings import SettingsStore
from handstudio.setup import HandModel, Setup
from handstudio.wizards.course import Next, Redo

_BLINK_MS = 3000
_ONCE_S = 0.4  # the space bar is a key of the page, and also presses the button clicked last


@dataclass
class Studio:
    """The studio behind the page."""

    capture: Capture
    jobs: Jobs
    store: SettingsStore
    state: State
    language: str | None = None  # asked for at the start; until another is chosen on the page
    _inbox: queue.SimpleQueue[intents.Intent | Looked | StreamsFound] = field(
        default_factory=queue.SimpleQueue
    )

    def __post_init__(self) -> None:
        self._keeper = Keeper(self.state.sessions)
        self._taker = Taker(self.capture, self.state.sessions)
        self._calibrator = Calibrator(self.capture, self._taker, self.state.sessions)
        self._holder = Holder(self.capture, self.state.sessions)
        self._chooser = Chooser(self.capture)
        self._stands_for: tuple[str, Setup | None, bool] | None = None
        self._looker = Looker(self._inbox.put)
        self._tracker = Tracker(self.capture, self._inbox.put)
        self._workshop = Workshop(self.jobs)
        self._reviewer = Reviewer(self._workshop)
        self._joints = JointFinder(self._workshop)
        self._now_s = 0.0
        self._solving = False  # a calibration was ordered
        self._toggled_s = self._guided_s = -1.0
        self._change()
        kept = [view for view in LASTING if view.value == self.store.settings.camera]
        self.state = replace(self.state, view=kept[0] if kept else View.DESK)
        self._speak(())

    def send(self, intent: intents.Intent) -> None:
        """Ask for something; returns at once. For any thread."""
        self._inbox.put(intent)

    def prepare(self, preparation: Prepared) -> None:
        """Use the whole-hand filter for hands once this has got it ready."""
        self._chooser.preparation = preparation

    def tick(self, elapsed_s: float) -> State:
        """Take in all that happened; the state afterwards."""
        told = replace(self.state, messages=(), downloads=(), sounds=())
        self.state = replace(told, asking=None, asking_for="")
        while True:
            try:
                item = self._inbox.get_nowait()
            except queue.Empty:
                break
            self._try(item)
        self._hear_capture()
        self._finish_work()
        self._take_on(elapsed_s)
        self._guide_on(elapsed_s)
        self._joints.tick(elapsed_s)
        self.state = replace(self.state, joint=self._joints.finding)
        self.state = replace(self.state, preparing=self._chooser.follow(self.state))
        idle = self.state.newest.phase in (Phase.IDLE, Phase.FAILED)
        self._looker.tick(elapsed_s, idle=idle and self.state.pages > 0)
        self.state = replace(self.state, searching=self._looker.busy)
        self.state = replace(self.state, tracker=self._tracker.follow(self.state))
        review = self.state.review
        if review is not None and review.playing:
            self.state = replace(self.state, review=reviewing.advanced(review, elapsed_s))
        self._face_once()
        self._keep_settings(elapsed_s)
        return self.state

    def end(self) -> None:
        """Let go of what threads of its own hold."""
        self._tracker.end()

    def refresh_takes(self) -> None:
        """Read the library again."""
        self._keeper.refresh()
        self._take_shelf()

    def _take_shelf(self) -> None:
        self.state = replace(self.state, shelf=self._keeper.shelf)

    # --- intents --------------------------------------------------------------------------------

    def _try(self, item: intents.Intent | Looked | StreamsFound) -> None:
        try:
            match item:
                case Looked():
                    self._hear_looker(item)
                case StreamsFound(problem=problem):
                    self._tracker.found(item)
                    if problem is not None:
                        self._say(problem)
                case _ if not any(
                    each(item)
                    for each in (
                        self._guide,
                        self._joints.hear,
                        self._obey,
                        self._keep,
                        self._prefer,
                    )
                ):
                    self._move(item)
        except HandstudioError as error:
            self._say(error)
        self._take_shelf()

    def _obey(self, intent: intents.Intent) -> bool:  # noqa: PLR0912, PLR0915 - a list
        """Devices, recording, opening; False: it is about something else."""
        match intent:
            case intents.FindDevices():
                self._find()
            case intents.ConnectDevice(address=address):
                self.state = replace(self.state, live=None, shaking=None, yaw=None, review=None)
                self._change(last_address=address)
                self._connect(address)
            case intents.DisconnectDevice():
                self.capture.send(Disconnect())
                self.state = replace(self.state, live=None, shaking=None)
            case intents.FindTrackers():
                self._tracker.look()
            case intents.ChooseTracker():
                self._choose_tracker(intent)
            case intents.BlinkSensor(name=name):
                self._blink(name)
            case intents.Perform(motions=motions):
                self.capture.send(Ask(PERFORM, motions.encode()))
            case intents.ToggleRecording(page=page):
                self._toggle_recording(page)
            case intents.GoOn(page=page):
                if self.state.review is not None:
                    self._move(intents.TogglePlay())
                else:
                    self._toggle_recording(page)
            case intents.PutMark(text=text):
                self._mark(text)
            case intents.OpenTake(path=path):
                self._open(path)
            case intents.RecoverTake(path=path):
                self._recover(path)
            case intents.ShowLive():
                self.state = replace(self.state, review=None, yaw=None)
            case intents.Export():
                self._export(intent)
            case intents.CompareVisits(earlier=earlier):
                self._compare(earlier=earlier)
            case intents.CompareSides(other=other):
                self._compare(other_side=other)
            case intents.MeasureHand() | intents.MakeReport():
                self._measure(intent)
            case intents.AddTake(name=name, content=content):
                self._workshop.add(name, content, self.state.sessions)
            case intents.ShareTake(page=page):
                if self.state.review is not None:
                    self._workshop.share(self.state.review.take, page)
            case intents.TrimTake(name=name):
                self._trim(name)
            case intents.Smooth(on=on):
                self._ask_of_review(smooth=on)
            case intents.Compare(name=name):
                self._ask_of_review(compare=name)
            case intents.ComputeRest():
                if self.state.review is not None:
                    rest = self._reviewer.completed(self.state.review)
                    self.state = replace(self.state, review=rest)
            case intents.CancelWork():
                self._workshop.cancel()
            case intents.SendDiagnostics(page=page):
                self._send_diagnostics(page)
            case intents.FaceForward():
                self._tracker.face_anew()
                self.state = replace(self.state, yaw=None, aimed=self.state.aimed + 1)
            case intents.SetView(view=view):
                self._change(camera=view.value if view in LASTING else "")
                self.state = replace(self.state, view=view, aimed=self.state.aimed + 1)
            case intents.PagesOpen(count=count, languages=languages):
                self.state = replace(self.state, pages=count)
                if languages:
                    self._speak(languages)
            case intents.PageShown(ms=ms):
                self.state = replace(self.state, page_ms=ms)
                if ms is not None:
                    self.capture.send(NotePage(ms))
            case _:
                return False
        return True

    def _keep(self, intent: intents.Intent) -> bool:  # noqa: PLR0912, PLR0915 - a list
        """The library; False: it is about something else."""
        keeper, review = self._keeper, self.state.review
        match intent:
            case intents.ChooseSubject(code=code):
                self._change(subject=code)
                self.capture.send(SetHand(self._hand()))
            case intents.SaveSubject(then_record=then_record, then_begin=course):
                saved = keeper.save_subject(intent)
                self._take_shelf()
                self._change(subject=saved.code)
                self.capture.send(SetHand(self._hand()))
                if course:
                    self._guide(intents.BeginCourse(course))
                if then_record:
                    self._record_or_stop(page=-1)
            case intents.DeleteSubject(code=code, typed=typed):
                self._refuse_while_working()
                if review is not None and review.take.header.subject == code:
                    self.state = replace(self.state, review=None, yaw=None)
                self._tell(keeper.delete_subject(code, typed))
                if self.store.settings.subject == code:
                    self._change(subject="")
            case intents.Search(text=text):
                keeper.search(text)
            case intents.RenameTake(path=path, name=name):
                self._refuse_while_working()
                self._reopen(path, keeper.rename(path, name))
            case intents.BinTake(path=path):
                self._refuse_while_working()
                if review is not None and review.take.path == path:
                    self.state = replace(self.state, review=None, yaw=None)
                self._tell(keeper.bin(path))
            case intents.Undo():
                undone = keeper.undo()
                if undone is not None:
                    self._tell(undone[0])
                    self._reopen_notes(undone[1])
                    if self.state.review is None:  # the one that was open when it went to the bin
                        self._open(undone[1])
            case intents.RestoreTake(key=key):
                self._tell(keeper.restore(key))
            case intents.EmptyBin():
                self._tell(keeper.empty_bin())
            case intents.SetNotes(text=text) if review is not None:
                self._write_notes(review, noting.with_text(review.notes, text))
            case intents.NamePart(label=label) if review is not None:
                named = noting.with_label(review.notes, review.in_s, review.end_s, label)
                self._write_notes(review, named)
            case intents.RemoveMark(at_s=at_s) if review is not None:
                for mark in [mark for mark in review.notes.marks if mark.at_s == at_s]:
                    self._write_notes(review, noting.without_mark(review.notes, mark))
            case _:
                return False
        return True

    def _refuse_while_working(self) -> None:
        if self._workshop.work is not None:
            raise HandstudioError(
                "A take is being computed or exported.", "Wait until it is done, or cancel it."
            )

    def _prefer(self, intent: intents.Intent) -> bool:  # noqa: PLR0912 - a list
        """Settings; False: it is about something else."""
        change, shown = self._change, self.store.settings.shown
        match intent:
            case intents.SetVisit(name=name):
                change(visit=name)
            case intents.SetTakeName(name=name):
                change(take_name=name)
            case intents.SetHandType(hand_type=hand_type):
                change(hand_type=hand_type)
            case intents.SetCountdown(seconds=seconds):
                change(countdown_s=seconds)
            case intents.SetSounds(on=on):
                change(sounds=on)
            case intents.SetFilter(name=name):
                change(filter=name)
            case intents.ChooseCurves(name=name, sensor=sensor):
                self._reviewer.sensor = sensor or self._reviewer.sensor
                change(curves=name)
                self._ask_of_review()
            case intents.SetTheme(dark=dark):
                change(theme="dark" if dark else "light")
            case intents.SetLanguage(language=language):
                change(language=language)
                self.language = None
                self._speak(())
            case intents.AddPosture() | intents.RemovePosture():
                self._change_postures(intent)
            case intents.SetShown(part=part, on=on):
                change(shown=msgspec.structs.replace(shown, **{part: on}))
            case intents.ToggleShown(part=part):
                on = not getattr(shown, part)
                change(shown=msgspec.structs.replace(shown, **{part: on}))
            case _:
                return False
        return True

    def _change_postures(self, intent: intents.AddPosture | intents.RemovePosture) -> None:
        """What was measured without the new one is measured anew."""
        kept = [band for band in self.store.settings.postures if band.name != intent.name.strip()]
        if isinstance(intent, intents.AddPosture):
            kept.append(band_from(intent.name, intent.angle, intent.above, intent.below))
        self._change(postures=tuple(kept))
        self._compare()

    def _move(self, move: intents.Intent) -> None:  # noqa: PLR0912 - a list
        review = self.state.review
        if review is None:
            return
        match move:
            case intents.TogglePlay():
                review = reviewing.toggled(review)
            case intents.Seek(at_s=at_s):
                review = reviewing.sought(review, at_s)
            case intents.Step(instants=instants):
                review = reviewing.stepped(review, instants)
            case intents.SetSpeed(factor=factor):
                review = replace(review, speed=factor)
            case intents.MarkIn():
                review = reviewing.marked_in(review)
            case intents.MarkOut():
                review = reviewing.marked_out(review)
            case intents.WholeTake():
                review = reviewing.whole(review)
            case intents.SetLoop(on=on):
                review = replace(review, loop=on)
            case intents.GoToMark(forward=forward):
                review = reviewing.at_next_mark(review, forward=forward)
            case intents.ZoomPlots(factor=factor):
                review = reviewing.zoomed(review, factor)
            case intents.PanPlots(share=share):
                review = reviewing.panned(review, share)
            case intents.ShiftComparison(later_s=later_s):
                review = reviewing.shifted(review, later_s)
            case intents.FitPlots():
                review = reviewing.fitted(review)
        self.state = replace(self.state, review=review)

    def _connect(self, address: str) -> None:
        try:
            address = with_tracker(address, self.store.settings.tracker)
        except HandstudioError as error:  # the glove is there all the same
            self._say(error)
        self.capture.send(Connect(address, self._hand(), self._side()))

    def _choose_tracker(self, chosen: intents.ChooseTracker) -> None:
        """The virtual one streams with the virtual glove, which begins anew for it."""
        newest = self.state.newest
        here = is_virtual(newest.address) and newest.phase is not Phase.FAILED
        anew = here and with_tracker(newest.address, chosen.source) != newest.address
        if anew and newest.recorder is not None:
            raise HandstudioError(
                "The virtual glove begins anew with its tracker, and a take is on.",
                "Stop the take, then choose the tracker.",
            )
        self._change(
            tracker=chosen.source,
            tracker_terminal=chosen.terminal,
            tracker_sensor=chosen.sensor,
        )
        if anew:
            self._connect(newest.address)

    def _find(self) -> None:
        newest = self.state.newest
        self._looker.look(newest.address if newest.phase is not Phase.IDLE else "")

    def _hear_looker(self, looked: Looked) -> None:
        self.state = replace(self.state, devices=looked.found)
        for glove in looked.new:
            self._tell(
                _("{glove} was plugged in: connect it under Device.").format(glove=glove.label)
            )

    def _blink(self, name: str) -> None:
        number = TIP_SENSOR if name == "Tip" else int(name.removeprefix("SN"))
        argument = bytes([number]) + _BLINK_MS.to_bytes(2, "little")
        self.capture.send(Ask(Command.BLINK, argument))

    def _hand(self) -> HandModel:
        """The hand of whoever is chosen now."""
        return HandModel(hand_length_m=self.state.hand_length_mm * 1e-3)

    def _side(self) -> str:
        """Which hand a device sits on that does not know it."""
        subject = self.state.subject
        return (subject.side if subject is not None else "") or self.store.settings.side

    # --- guided courses -------------------------------------------------------------------------

    def _guide(self, intent: intents.Intent) -> bool:  # noqa: PLR0912 - a list
        """Courses; False: it is about something else."""
        calibrator, settings = self._calibrator, self.store.settings
        on, over = calibrator.guided is not None, calibrator.result is not None
        match intent:
            case intents.BeginCourse():
                self._begin_course(intent)
            case intents.Guide(event=event) if not self._twice():
                self._hear_all(calibrator.hear(event, settings))
            case intents.RedoStep(index=index) if on:
                self._hear_all(calibrator.hear(Redo(index), settings))
            case intents.RedoStep(index=index):
                calibrator.redo(index, self.state, settings)
            case intents.GoOn() if on:
                self._guide(intents.Guide(Next()))
            case intents.GoOn() if over and not self._twice():
                self._guide(intents.CloseResult())
            case intents.ToggleRecording() | intents.LeaveCourse() if on:
                calibrator.leave()
                self._tell(_("The course waits under Calibrate; what was done is kept."))
            case intents.CloseResult():
                if calibrator.result is not None and not calibrator.result.solving:
                    calibrator.result = None
            case intents.UseCalibration(which=which):
                self._holder.use(which)
            case intents.ResetHeading(sensor=sensor):
                self.capture.send(ResetHeading(sensor))
            case intents.OpenTake() | intents.ChooseSubject() | intents.DeleteSubject() if on:
                raise HandstudioError(
                    "A course of calibration is on.", "Leave it first; it can be gone on with."
                )
            case intents.Guide():
                pass
            case _:
                return False
        self._show_guided()
        return True

    def _twice(self) -> bool:
        """Whether this is the space bar again, as the click of the button that has the focus."""
        twice = self._now_s - self._guided_s < _ONCE_S
        self._guided_s = self._guided_s if twice else self._now_s
        return twice

    def _begin_course(self, order: intents.BeginCourse) -> None:
        if self.state.can_record and self.state.subject is None:
            self.state = replace(self.state, asking=order.page, asking_for=order.name)
            return
        if self._calibrator.guided is not None:
            return
        self._calibrator.begin(order.name, self.state, self.store.settings, anew=order.anew)
        self.state = replace(self.state, review=None, yaw=None, aimed=self.state.aimed + 1)

    def _guide_on(self, elapsed_s: float) -> None:
        calibrator = self._calibrator
        try:
            self._hear_all(calibrator.tick(elapsed_s, self.state))
        except HandstudioError as error:
            self._sound(Sound.ALARM)
            self._say(error)
        takes, result = calibrator.to_solve(), calibrator.result
        if takes and result is not None and not self._solving:
            self._solving = True
            self._workshop.solve(
                result.course.name, takes, self.state.sessions, calibrator.hand_type
            )
        self._show_guided()
        for problem in self._holder.follow(self.state):
            self._say(problem)
        self.state = replace(self.state, in_use=self._holder.in_use)

    def _show_guided(self) -> None:
        calibrator, state = self._calibrator, self.state
        guided, result = calibrator.guided, calibrator.result
        if (guided is None) != (state.guided is None):
            state = replace(state, aimed=state.aimed + 1)
        code = state.subject.code if state.subject is not None else ""
        now = code, state.newest.setup, guided is not None or result is not None
        if now != self._stands_for:
            self._stands_for = now
            state = replace(state, stands=calibrator.stands(state))
        self.state = replace(state, guided=guided, result=result)

    def _hear_all(self, sounds: list[Sound]) -> None:
        for sound in sounds:
            self._sound(sound)

    # --- recording ------------------------------------------------------------------------------

    def _toggle_recording(self, page: int) -> None:
        if self._now_s - self._toggled_s < _ONCE_S:
            return
        self._toggled_s = self._now_s
        self._record_or_stop(page)

    def _record_or_stop(self, page: int) -> None:
        if self.state.newest.recorder is not None:
            self._taker.stop()
            self._sound(Sound.STOP)
            return
        if self._taker.countdown is not None:
            self._taker.cancel()
            return
        if not self.state.can_record:
            raise HandstudioError(
                "There is no device to record from.", "Connect one under Device, then record."
            )
        settings = self.store.settings
        if self.state.subject is None:
            self.state = replace(self.state, asking=page)
            return
        self._taker.begin(settings)
        if self.state.review is not None:
            self.state = replace(self.state, review=None, yaw=None)

    def _take_on(self, elapsed_s: float) -> None:
        """The countdown, the disk, and the end that comes by itself."""
        away_s = 0.0 if self.state.newest.ready else self.state.away_s + elapsed_s
        self.state = replace(self.state, away_s=away_s)
        try:
            for sound in self._taker.tick(elapsed_s, self.state, self.store.settings):
                self._sound(sound)
        except HandstudioError as error:
            self._sound(Sound.ALARM)
            self._say(error)
        taker = self._taker
        self.state = replace(
            self.state, countdown=taker.countdown, disk=taker.disk, marks=taker.marks
        )

    def _mark(self, text: str) -> None:
        review = self.state.review
        if self.state.newest.recorder is not None:
            if self._taker.mark(text):
                self._sound(Sound.MARK)
        elif review is not None:
            self._write_notes(review, noting.with_mark(review.notes, review.at_s, text))

    # --- takes ----------------------------------------------------------------------------------

    def _recover(self, path: Path) -> None:
        recovered = recover(path)
        text = _("Recovered {seconds:.1f} s as {name}.")
        self._tell(text.format(seconds=recovered.duration_s, name=recovered.path.stem))
        self.refresh_takes()
        self._open(recovered.path)

    def _open(self, path: Path) -> None:
        take = open_take(path)
        preview = self._chooser.serves(take.header.setup.filter)
        review = self._reviewer.opened(take, preview=preview)
        if review is not None:
            self._show(review)

    def _ask_of_review(self, **asked: Any) -> None:
        if self.state.review is not None:
            self._bring(replace(self.state.review, **asked))

    def _bring(self, review: Review) -> None:
        self._reviewer.curves = self.store.settings.curves
        try:
            review = self._reviewer.brought(review)
        except HandstudioError as error:  # what it is compared with is gone
            self._say(error)
            review = self._reviewer.brought(reviewing.settled(review))
        self.state = replace(self.state, review=review)

    def _show(self, review: Review) -> None:
        notes = noting.Notes()
        try:
            notes = noting.load_notes(review.take.path)
        except HandstudioError as error:
            self._say(error)
        self.state = replace(self.state, yaw=None)
        self._bring(replace(review, notes=notes))

    def _reopen(self, before: Path, path: Path) -> None:
        """A take that is open stays open where it is, under its other name."""
        review = self.state.review
        if review is not None and review.take.path == before:
            take = replace(review.take, path=path)
            self.state = replace(self.state, review=replace(review, take=take))

    def _reopen_notes(self, path: Path) -> None:
        """What was taken back may be a name or the notes of the take that is open."""
        review = self.state.review
        if review is None:
            return
        if not review.take.path.exists():
            self._reopen(review.take.path, path)
        review = self.state.review
        if review is not None and review.take.path == path:
            notes = noting.load_notes(path)
            self.state = replace(self.state, review=replace(review, notes=notes))

    def _write_notes(self, review: Review, notes: noting.Notes) -> None:
        if notes != review.notes:
            self._keeper.write_notes(review.take.path, notes)
            self.state = replace(self.state, review=replace(review, notes=notes))

    def _export(self, order: intents.Export) -> None:
        review = self.state.review
        if review is None:
            return
        window = Window(review.in_s, review.out_s)
        self._workshop.export(review.take.path, order, window, review.used)

    def _compare(self, **with_: Any) -> None:
        """What was measured without is of no use any more."""
        review = self.state.review
        if review is not None:
            self.state = replace(self.state, review=replace(review, measured=None, **with_))

    def _measure(self, order: intents.MeasureHand | intents.MakeReport) -> None:
        review = self.state.review
        if review is None:
            return
        part, beside = Window(review.in_s, review.out_s), (review.earlier, review.other_side)
        bands = bands_with(self.store.settings.postures)
        match order:
            case intents.MeasureHand():
                self._workshop.measure(review.take, part, review.used, beside, bands)
            case intents.MakeReport(page=page):
                self._workshop.report(
                    review.take.path, part, page, review.used, beside, bands=bands
                )

    def _trim(self, name: str) -> None:
        review = self.state.review
        if review is not None:
            self._workshop.trim(review.take.path, review.in_s, review.out_s, name)

    def _send_diagnostics(self, page: int) -> None:
        settings = msgspec.to_builtins(self.store.settings)
        work = partial(
            diagnostics.make,
            self.state.newest,
            settings=settings,
            sessions=self.state.sessions,
            takes=self._keeper.shelf.takes,
            names=(self.store.settings.subject, self.store.settings.take_name),
        )
        self._workshop.gather(work, page)

    # --- reports --------------------------------------------------------------------------------

    def _hear_capture(self) -> None:
        newest = self.capture.newest
        motions = self.capture.drain()
        live, shaking = self.state.live, self.state.shaking
        if newest.setup is not None:
            live = live_history.extended(live, newest.setup, motions, self.store.settings.curves)
            sensors = len(newest.setup.layout.sensors)
            if shaking is None or shaking.q_world_sensor.shape[1] != sensors:
                shaking = shaken.begin(sensors)
            shaking = shaken.heeded(shaking, motions)
        self.state = replace(self.state, newest=newest, live=live, shaking=shaking)
        for report in self.capture.reports():
            match report:
                case TakeDone(path=path):
                    self._take_done(path)
                case HeadingTaken(sensor=sensor):
                    of = sensor or _("all sensors")
                    self._tell(_("Heading taken anew: {sensors}.").format(sensors=of))
                case HandstudioError():
                    self._calibrator.take_failed(report)
                    self._sound(Sound.ALARM)
                    self._say(report)
                    self.refresh_takes()

    def _take_done(self, path: Path) -> None:
        self.refresh_takes()
        if self._calibrator.take_done(path):
            return
        self._tell(
            _("Recorded {name}. Replay it below, export it under Review.").format(name=path.stem)
        )
        if self.state.newest.recorder is None:
            self._open_or_say(path)

    def _open_or_say(self, path: Path) -> None:
        try:
            self._open(path)
        except HandstudioError as error:
            self._say(error)

    def _finish_work(self) -> None:  # noqa: PLR0912, PLR0915 - a list
        for outcome in self._workshop.done():
            match outcome:
                case Computed(take=take, setup=None):
                    self._show_computed(take)
                case Computed(take=take) if self._is_open(take) or self._is_beside(take):
                    self._ask_of_review()
                case Surveyed(take=take, setup=setup, stretches=found) if self._is_open(take):
                    self._look_at(setup or take.header.setup, found)
                case Written(take=take) | WayFound(take=take) if self._is_open(take):
                    self._ask_of_review()
                case Previewed(take=take, motion=motion):
                    review = self._reviewer.head(take, motion)
                    if review is not None:
                        self._show(review)
                case Added(path=path):
                    self._tell(_("Added {name}.").format(name=path.stem))
                    self.refresh_takes()
                    self._open_or_say(path)
                case Trimmed(path=path):
                    self._tell(_("Trimmed: {name} is a take of its own.").format(name=path.stem))
                    self.refresh_takes()
                case Uncomputed(take=take, error=error, own=True):
                    self._tell_why(error)
                    shown = self._reviewer.uncomputed(take, self.state.review)
                    self.state = replace(self.state, review=shown or self.state.review)
                case Uncomputed(take=take, error=error):
                    self._tell_why(error)
                    here = self._is_open(take) or self._is_beside(take)
                    if here and self.state.review is not None:
                        self._bring(reviewing.settled(self.state.review))
                case Unseen(take=take, what=what, error=error):
                    self._tell_why(error)
                    if what != "way" or isinstance(error, Stopped):
                        self._forget_order(take, what)  # what the track says stays as it is
                case Exported(download=download):
                    self._tell(_("Exported {path}.").format(path=download.content))
                    self._send_file(download)
                case MeasuredPart(take=take, measured=measured) if self._is_open(take):
                    self._ask_of_review(measured=measured)
                case Gathered(download=download):
                    self._send_file(download)
                case FoundIn(take=take, setup=setup, found=found):
                    review = self.state.review
                    if review is not None and self._is_open(take) and review.setup == setup:
                        self.state = replace(self.state, review=replace(review, found=found))
                case Solved(answer=answer):
                    self._solving = False
                    self._calibrator.solved(answer)
                    self._use(answer)
                case OfJoint():
                    self._joints.done(outcome)
                case HandstudioError():
                    self._tell_why(outcome)
                case _:
                    pass  # of a take that is no longer open
            self._complete()
        self.state = replace(self.state, work=self._workshop.work)

    def _forget_order(self, take: Take, what: str) -> None:
        review = self.state.review
        if review is not None and self._is_open(take):
            self.state = replace(
                self.state, review=replace(review, ordered=review.ordered - {what})
            )

    def _complete(self) -> None:
        """An export, too, may have computed what was missing of the open take."""
        review = self.state.review
        if review is not None and review.rest == "missing":
            self._show_computed(review.take)

    def _use(self, answer: Answer | HandstudioError) -> None:
        """What a course was for, from now on."""
        match answer:
            case Calibrated() | SensorsFound():
                self._holder.solved()
            case HeadingAlignment() if answer.verdict.ok:
                self.capture.send(SetHeading(answer.psi_cor))
            case _:
                pass

    def _tell_why(self, error: HandstudioError) -> None:
        if isinstance(error, Stopped):
            self._tell(" ".join(words.in_words(error)))
        else:
            self._say(error)

    def _is_open(self, take: Take) -> bool:
        return self.state.review is not None and self.state.review.take.path == take.path

    def _is_beside(self, take: Take) -> bool:
        review = self.state.review
        return review is not None and review.compare == f"{comparison.OF_TAKE}{take.path}"

    def _show_computed(self, take: Take) -> None:
        before = self.state.review
        try:
            review = self._reviewer.computed(take, before)
        except HandstudioError as error:
            self._say(error)
            return
        if review is None:
            return
        if before is not None and before.take.path == take.path:
            self._bring(review)
        else:
            self._show(review)

    def _look_at(self, setup: Setup, found: tuple[Stretch, ...]) -> None:
        review = self.state.review
        if review is not None and review.setup == setup:
            self.state = replace(self.state, review=replace(review, stretches=found))

    def _face_once(self) -> None:
        """Choose the turn of the picture when there is a first pose to choose it by."""
        review, newest = self.state.review, self.state.newest
        if self.state.yaw is not None:
            return
        if review is not None:
            yaw = facing(review.setup, review.instant)
        elif newest.setup is not None and newest.motion is not None:
            yaw = facing(newest.setup, newest.motion)
        else:
            return
        self.state = replace(self.state, yaw=yaw)

    # --- settings -------------------------------------------------------------------------------

    def _change(self, **values: Any) -> None:
        self.store.put(msgspec.structs.replace(self.store.settings, **values), self._now_s)
        self.state = replace(self.state, settings=self.store.settings)

    def _keep_settings(self, elapsed_s: float) -> None:
        self._now_s += elapsed_s
        self.store.tick(self._now_s)
        notice = self.store.take_notice()
        if notice is not None:
            self._say(notice)

    # --- telling --------------------------------------------------------------------------------

    def _speak(self, languages: tuple[str, ...]) -> None:
        """The language that was chosen, else that of the newest page, else the system's."""
        chosen = self.language or words.spoken([self.store.settings.language])
        language = chosen or words.spoken(languages) or words.system_language()
        words.use_language(language)
        self.state = replace(self.state, language=language)

    def _sound(self, sound: Sound) -> None:
        if self.store.settings.sounds:
            self.state = replace(self.state, sounds=(*self.state.sounds, sound))

    def _send_file(self, download: Download) -> None:
        self.state = replace(self.state, downloads=(*self.state.downloads, download))

    def _tell(self, text: str) -> None:
        self.state = replace(self.state, messages=(*self.state.messages, Message(text)))

    def _say(self, error: HandstudioError) -> None:
        what, remedy = words.in_words(error)
        message = Message(what, remedy, alarm=True)
        self.state = replace(self.state, messages=(*self.state.messages, message))
