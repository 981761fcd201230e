"""The page's server: viser behind the guard; messages and files to pages."""

from __future__ import annotations

import warnings
from contextlib import redirect_stdout
from io import StringIO

import viser

from app import intents
from app.door import network
from app.door.guard import Door, guarded, made_token
from app.page_probe import PageProbe
from app.panels.page import Page
from app.picture.scene import Scene
from app.shown.look import View
from app.state import Message, State
from app.studio import Studio
from app.views.comparison import compared_ghost
from app.views.course import ghost_view
from app.views.held import held_view
from app.views.joint import halo_of
from app.views.page import HandView, camera_of, looks_near, overlay_of, scene_of
from app.views.room import floor_m, stand_of
from app.views.written import trace_view
from app.words import _
from app.work.outcomes import Download

HOST = "127.0.0.1"

_TELL_S = 6.0
_ALARM_S = 30.0


class Server:
    """Draws states on every open page.

    Args:
        studio: What the pages show.
        port: The port, or where to begin looking for a free one.
        host: Where to serve: an address or a name of this machine, or 0.0.0.0 for all.
        token: What visitors must know. Without one nothing is asked on loopback, and one is made
            for any other host.

    Attributes:
        door: Who may come in, and what the newest visitor speaks.

    Raises:
        HandstudioError: it cannot be served there.
    """

    def __init__(
        self, studio: Studio, port: int, host: str = HOST, token: str | None = None
    ) -> None:
        # a page may close between two lines of ours; what was meant for it needs no mention
        warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
        self._address = network.bind_address(host)
        self._given = token is not None
        if token is None and not network.is_loopback(self._address):
            token = made_token()
        self._token = token
        self.door = Door(network.hosts(host, self._address), token)
        with guarded(self.door), redirect_stdout(StringIO()):  # viser's own banner
            self._viser = viser.ViserServer(
                host=self._address,
                port=network.free_port(self._address, port),
                label="handstudio",
                verbose=False,
            )
        self._studio = studio
        self._scene = Scene(self._viser)
        self._page = Page(self._viser, studio.send, studio.state)
        self._language = studio.state.language
        self._aimed: object = None
        self._probe = PageProbe(self._viser, lambda ms: studio.send(intents.PageShown(ms)))
        self._viser.on_client_connect(lambda _client: self._count())
        self._viser.on_client_disconnect(lambda _client: self._count())

    @property
    def url(self) -> str:
        """Where the page is for this machine, without what opens the door."""
        return f"http://{network.nearest_host(self._address)}:{self._viser.get_port()}"

    def browser_url(self) -> str:
        """What our own browser is asked for; opens the door once where visitors need a token."""
        return f"{self.url}/?ticket={self.door.ticket()}" if self.door.asks else self.url

    def links(self, for_a_person: bool) -> list[str]:
        """What to tell in the terminal: where the page is, with the token where one is needed.

        Args:
            for_a_person: The terminal is read by a person. A token that was chosen is shown to
                nobody else: the output may be kept in a file.
        """
        if not self.door.asks:
            return [self.url]
        token = "TOKEN" if self._given and not for_a_person else self._token
        port = self._viser.get_port()
        hosts = network.reachable_hosts(self._address)
        return [f"http://{host}:{port}/?token={token}" for host in hosts]

    def render(self, state: State) -> None:
        """Bring all pages up to date; with none open there is nothing to draw."""
        if state.language != self._language:
            self._language = state.language
            self._page.remove()
            self._page = Page(self._viser, self._studio.send, state)
        if not self._viser.get_clients():
            return
        with self._viser.atomic():
            self._render_scene(state)
        self._page.render(state)
        for message in state.messages:
            self._notify(message)
        for download in state.downloads:
            self._send_file(download)

    def close(self) -> None:
        """Close all pages."""
        self._probe.stop()
        self._viser.stop()

    def _count(self) -> None:
        pages = len(self._viser.get_clients())
        self._studio.send(intents.PagesOpen(pages, self.door.languages))

    def _render_scene(self, state: State) -> None:
        view = scene_of(state)
        self._scene.furnish(state.settings.theme == "dark", floor_m(state))
        self._scene.render(view, stand_of(state), state.settings.shown)
        ghost = ghost_view(state) or compared_ghost(state)
        self._scene.render_ghost(ghost, state.settings.shown)
        self._scene.render_trace(trace_view(state))
        self._scene.render_held(held_view(state, view))
        self._scene.render_halo(halo_of(state, view))
        self._scene.say(overlay_of(state))
        # aimed when asked for, when a take is opened or left, and when the picture is turned
        # otherwise or a hand appears: from the desk all that looks the same
        fixed = state.view is View.DESK
        turned = None if fixed else (state.yaw, isinstance(view, HandView))
        above = state.review is not None, state.joint.answer is not None
        way = None if state.review is None else state.review.way
        aimed = state.aimed, turned, looks_near(state), above, way, state.settings.shown.room
        if aimed != self._aimed or state.view is View.FOLLOW:
            self._aimed = aimed
            self._scene.aim(camera_of(state, view))

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
            held = download.content
            content = held if isinstance(held, bytes) else held.read_bytes()
            client.send_file_download(download.name, content, save_immediately=True)
