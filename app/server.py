"""The page's server: viser on loopback, behind the guard; messages and files to pages."""

from __future__ import annotations

import socket
import warnings
from contextlib import closing, redirect_stdout
from io import StringIO

import viser

from app.guard import guarded
from app.panels.page import Page
from app.scene import Scene
from app.studio import Download, Message, State, Studio
from app.view import scene_of
from app.words import _
from handstudio.errors import HandstudioError

HOST = "127.0.0.1"

_TELL_S = 6.0
_ALARM_S = 30.0


class Server:
    """Draws states on every open page."""

    def __init__(self, studio: Studio, port: int) -> None:
        # a page may close between two lines of ours; what was meant for it needs no mention
        warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
        with guarded(), redirect_stdout(StringIO()):  # viser's own banner
            self._viser = viser.ViserServer(
                host=HOST, port=free_port(port), label="handstudio", verbose=False
            )
        self._scene = Scene(self._viser)
        self._page = Page(self._viser, studio.send, studio.state)

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://localhost:{self._viser.get_port()}"

    def render(self, state: State) -> None:
        """Bring all pages up to date; with none open there is nothing to draw."""
        if not self._viser.get_clients():
            return
        with self._viser.atomic():
            self._scene.render(scene_of(state), state.yaw)
        self._page.render(state)
        for message in state.messages:
            self._notify(message)
        for download in state.downloads:
            self._send_file(download)

    def close(self) -> None:
        """Close all pages."""
        self._viser.stop()

    def _notify(self, message: Message) -> None:
        for client in self._viser.get_clients().values():
            client.add_notification(
                _("Attention") if message.alarm else "handstudio",
                f"{message.text}\n{message.remedy}".strip(),
                auto_close_seconds=_ALARM_S if message.alarm else _TELL_S,
                color="red" if message.alarm else "green",
            )

    def _send_file(self, download: Download) -> None:
        client = self._viser.get_clients().get(download.page)
        if client is not None:
            content = download.path.read_bytes()
            client.send_file_download(download.path.name, content, save_immediately=True)


def free_port(wanted: int) -> int:
    """The wanted port, or the next one that is free.

    Raises:
        HandstudioError: none of a hundred is.
    """
    for port in range(wanted, wanted + 100):
        with closing(socket.socket()) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((HOST, port))
            except OSError:
                continue
            return port
    raise HandstudioError(
        "No free port between {first} and {last}.",
        "Name another one: --port.",
        first=wanted,
        last=wanted + 99,
    )
