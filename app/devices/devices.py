"""The glove and the tracker from the person's side: found, connected, followed, let go of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from app import intents
from app.board import Board
from app.devices.filtering import Chooser
from app.devices.looking import Looked, Looker
from app.devices.tracking import StreamsFound, Tracker, with_tracker
from app.shown import live, shaken
from app.state import State
from app.words import _
from handstudio.device.addresses import is_virtual
from handstudio.device.capture import Capture
from handstudio.device.orders import Ask, Connect, Disconnect, Phase, ResetHeading
from handstudio.errors import HandstudioError
from handstudio.protocol.commands import PERFORM
from handstudio.protocol.packets import TIP_SENSOR, Command

_BLINK_MS = 3000


@dataclass
class Devices:
    """Owner of what the state tells of devices; for one thread.

    Args:
        notify: Is told what lookers found; called in threads of theirs. It comes back by `found`.
    """

    board: Board
    capture: Capture
    chooser: Chooser
    notify: Callable[[Looked | StreamsFound], None]

    def __post_init__(self) -> None:
        self._looker = Looker(self.notify)
        self._tracker = Tracker(self.capture, self.notify)

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        match intent:
            case intents.FindDevices():
                newest = self.board.state.newest
                self._looker.look(newest.address if newest.phase is not Phase.IDLE else "")
            case intents.ConnectDevice(address=address):
                self._leave()
                self.board.close_review()
                self.board.change(last_address=address)
                self._connect(address)
            case intents.DisconnectDevice():
                self.capture.send(Disconnect())
                self._leave()
            case intents.FindTrackers():
                self._tracker.look()
            case intents.ChooseTracker():
                self._choose_tracker(intent)
            case intents.BlinkSensor(name=name):
                self._blink(name)
            case intents.Perform(motions=motions):
                self.capture.send(Ask(PERFORM, motions.encode()))
            case intents.ResetHeading(sensor=sensor):
                self.capture.send(ResetHeading(sensor))
            case _:
                return False
        return True

    def found(self, told: Looked | StreamsFound) -> None:
        """Take in what a looker found."""
        match told:
            case Looked(found=found, new=new):
                self.board.state = replace(self.board.state, devices=found)
                for glove in new:
                    text = _("{glove} was plugged in: connect it under Device.")
                    self.board.tell(text.format(glove=glove.label))
            case StreamsFound(problem=problem):
                self._tracker.found(told)
                if problem is not None:
                    self.board.say(problem)

    def heading_taken(self, sensor: str | None) -> None:
        """The heading of a sensor, or of all, was taken anew."""
        of = sensor or _("all sensors")
        self.board.tell(_("Heading taken anew: {sensors}.").format(sensors=of))

    def face_anew(self) -> None:
        """Let the picture begin where the hand is now."""
        self._tracker.face_anew()

    def take_in(self) -> None:
        """What the capture tells by now."""
        board, newest = self.board, self.capture.newest
        motions = self.capture.drain()
        history, shaking = board.state.live, board.state.shaking
        if newest.setup is not None:
            history = live.extended(history, newest.setup, motions, board.settings.curves)
            sensors = len(newest.setup.layout.sensors)
            if shaking is None or shaking.q_world_sensor.shape[1] != sensors:
                shaking = shaken.begin(sensors)
            shaking = shaken.heeded(shaking, motions)
        board.state = replace(board.state, newest=newest, live=history, shaking=shaking)

    def tick(self, elapsed_s: float) -> None:
        """So much later; the filter and the tracker that are wanted are used."""
        board = self.board
        board.state = replace(board.state, preparing=self.chooser.follow(board.state))
        idle = board.state.newest.phase in (Phase.IDLE, Phase.FAILED)
        self._looker.tick(elapsed_s, idle=idle and board.state.pages > 0)
        board.state = replace(board.state, searching=self._looker.busy)
        board.state = replace(board.state, tracker=self._tracker.follow(board.state))

    def end(self) -> None:
        """Let go of what threads of its own hold."""
        self._tracker.end()

    def _leave(self) -> None:
        self.board.state = replace(self.board.state, live=None, shaking=None)

    def _connect(self, address: str) -> None:
        state = self.board.state
        try:
            address = with_tracker(address, state.settings.tracker)
        except HandstudioError as error:  # the glove is there all the same
            self.board.say(error)
        self.capture.send(Connect(address, state.hand, _side(state)))

    def _choose_tracker(self, chosen: intents.ChooseTracker) -> None:
        """The virtual one streams with the virtual glove, which begins anew for it."""
        newest = self.board.state.newest
        here = is_virtual(newest.address) and newest.phase is not Phase.FAILED
        anew = here and with_tracker(newest.address, chosen.source) != newest.address
        if anew and newest.recorder is not None:
            raise HandstudioError(
                "The virtual glove begins anew with its tracker, and a take is on.",
                "Stop the take, then choose the tracker.",
            )
        self.board.change(
            tracker=chosen.source,
            tracker_terminal=chosen.terminal,
            tracker_sensor=chosen.sensor,
        )
        if anew:
            self._connect(newest.address)

    def _blink(self, name: str) -> None:
        number = TIP_SENSOR if name == "Tip" else int(name.removeprefix("SN"))
        argument = bytes([number]) + _BLINK_MS.to_bytes(2, "little")
        self.capture.send(Ask(Command.BLINK, argument))


def _side(state: State) -> str:
    """Which hand a device sits on that does not know it."""
    subject = state.subject
    return (subject.side if subject is not None else "") or state.settings.side
