"""The door: who may come in, by http and websocket alike.

viser checks neither Host nor Origin, so a foreign page could reach a studio on loopback by DNS
rebinding or a websocket of its own; nor does it ask who is there. The check is put around
viser's request handler while its server is being built.

On loopback whoever is on this machine may come in. Where others can reach the studio they need
its token: a link that holds it is answered with a cookie and sent on to the page, and page,
files and websocket need the cookie.
"""

from __future__ import annotations

import asyncio
import hmac
import inspect
import logging
import re
import secrets
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import websockets.asyncio.server as websockets_server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from app.door import refusals
from app.door.guesses import Guesses
from app.door.network import LOOPBACK_HOSTS, as_host, same_machine
from handstudio.errors import HandstudioError

TICKET_S = 120.0
"""How long the browser that we open may take to come in."""

_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,128}")

_AGAIN = "/?again="

_log = logging.getLogger(__name__)


class Door:
    """Who may come in, and what the newest visitor speaks.

    Args:
        hosts: Names under which the studio may be asked for, without port, besides the address
            that a connection came to.
        token: What visitors must know; None where only this machine can reach us.

    Attributes:
        languages: What the browser of the newest page prefers, best first ("ja", "en-US").
    """

    def __init__(self, hosts: Iterable[str] = LOOPBACK_HOSTS, token: str | None = None) -> None:
        self.hosts = frozenset(host.lower() for host in hosts)
        self.languages: tuple[str, ...] = ()
        self.guesses = Guesses()
        self._token = token
        self._cookie = secrets.token_urlsafe(32)  # not made of the token, so no way to guess that
        self._tickets: dict[str, float] = {}

    @property
    def asks(self) -> bool:
        """Whether visitors need a token."""
        return self._token is not None

    @property
    def secrets(self) -> tuple[str, ...]:
        """What must never be written down."""
        return (self._cookie,) if self._token is None else (self._cookie, self._token)

    def ticket(self) -> str:
        """A word that opens the door once, soon, and from this machine only.

        It is for the browser that we open: others on this machine can see what it is asked for.
        """
        word = secrets.token_urlsafe(32)
        self._tickets[word] = time.monotonic() + TICKET_S
        return word

    def redeems(self, ticket: str) -> bool:
        """Whether this is a ticket of ours; it is none afterwards."""
        return self._tickets.pop(ticket, 0.0) > time.monotonic()

    def opens(self, token: str) -> bool:
        """Whether this is the token."""
        return self._token is not None and _equal(token, self._token)

    def knows(self, headers: Headers, port: int) -> bool:
        """Whether a request carries our cookie."""
        pairs = (pair.strip() for line in headers.get_all("Cookie") for pair in line.split(";"))
        ours = f"handstudio-{port}="
        values = [pair.removeprefix(ours) for pair in pairs if pair.startswith(ours)]
        return any(_equal(value, self._cookie) for value in values)

    def cookie(self, port: int) -> str:
        """The cookie, as a header sets it; it ends with the browser."""
        return f"handstudio-{port}={self._cookie}; Path=/; HttpOnly; SameSite=Strict"


def checked_token(token: str) -> str:
    """A token that a person has chosen.

    Raises:
        HandstudioError: it is too easy to guess, or does not fit into a link. Does not repeat it.
    """
    if _TOKEN.fullmatch(token) is None:
        raise HandstudioError(
            "The token is not 16 to 128 letters, digits, - and _.",
            "Leave it out, and one is made for you.",
        )
    return token


def made_token() -> str:
    """A new token."""
    return secrets.token_urlsafe(24)


def allowed(
    host: str | None, origin: str | None, port: int, hosts: Iterable[str] = LOOPBACK_HOSTS
) -> bool:
    """Whether a request names us as its host, and comes from our own page or from no page."""
    ours = {f"{name}:{port}" for name in hosts}
    if port == 80:
        ours |= set(hosts)
    if host is None or host.lower() not in ours:
        return False
    if origin is None:
        return True
    try:
        parts = urlsplit(origin.lower())
    except ValueError:
        return False
    return parts.scheme == "http" and parts.netloc in ours


def languages_of(header: str) -> tuple[str, ...]:
    """The tags of an ``Accept-Language``, best first; nonsense is left out."""
    weighed = []
    for entry in header[:500].split(","):
        tag, _, parameters = entry.strip().partition(";")
        weight = re.fullmatch(r"\s*q=([01](?:\.\d{0,3})?)\s*", parameters) if parameters else None
        quality = 1.0 if not parameters else float(weight[1]) if weight else 0.0
        if re.fullmatch(r"[A-Za-z]{1,8}(-[A-Za-z0-9]{1,8})*", tag.strip()) and 0.0 < quality <= 1.0:
            weighed.append((quality, tag.strip()))
    return tuple(tag for _, tag in sorted(weighed, key=lambda pair: -pair[0]))


@contextmanager
def guarded(door: Door) -> Iterator[Door]:
    """Within this block, websocket servers are built with this door."""
    original = websockets_server.serve

    def serve(*args: Any, process_request: Callable[..., Any] | None = None, **kw: Any) -> Any:
        return original(*args, process_request=_checking(door, process_request), **kw)

    websockets_server.serve = serve  # type: ignore[assignment,misc]
    try:
        yield door
    finally:
        websockets_server.serve = original  # type: ignore[misc]


def _checking(door: Door, inner: Callable[..., Any] | None) -> Callable[..., Any]:
    async def process_request(connection: Any, request: Request) -> Response | None:
        refusal = await _refusal(door, connection, request)
        if refusal is not None:
            return refusal
        _listen(door, request)
        if inner is None:
            return None
        answer = inner(connection, request)
        if inspect.isawaitable(answer):
            answer = await answer
        if answer is not None:
            refusals.harden(answer, request.headers["Host"])
        return answer  # type: ignore[no-any-return]

    return process_request


async def _refusal(door: Door, connection: Any, request: Request) -> Response | None:
    """What is answered instead of the page; None: come in."""
    local, port = connection.local_address[:2]
    hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
    ours = door.hosts | {as_host(local)} if door.asks else door.hosts
    once = len(hosts) == 1 and len(origins) <= 1
    if not once or not allowed(hosts[0], origins[0] if origins else None, port, ours):
        return refusals.refused(refusals.FOREIGN)
    if not door.asks:
        return None
    asked = _asked(request)
    if door.knows(request.headers, port):
        return refusals.redirected() if asked.keys() & {"token", "ticket", "again"} else None
    if "token" in asked or "ticket" in asked:
        return await _try(door, connection, asked)
    # A page of another site that links to us gets no strict cookie sent along, ours does.
    again = _AGAIN if request.path == "/" else None
    return refusals.refused(refusals.NO_TOKEN, again)


async def _try(door: Door, connection: Any, asked: dict[str, str]) -> Response:
    (local, port), peer = connection.local_address[:2], connection.remote_address[0]
    wait_s = door.guesses.wait_s(peer, time.monotonic())
    if wait_s is None:
        return refusals.refused(refusals.TOO_MANY)
    await asyncio.sleep(wait_s)
    here = same_machine(local, peer)
    if door.opens(asked.get("token", "")) or (here and door.redeems(asked.get("ticket", ""))):
        door.guesses.forgive(peer)
        return refusals.redirected(door.cookie(port))
    _log.warning("a visitor from %s came with a wrong token", peer)
    return refusals.refused(refusals.WRONG_TOKEN)


def _asked(request: Request) -> dict[str, str]:
    """What stands behind the question mark of the page's own address."""
    path, _, query = request.path.partition("?")
    if path != "/" or "Upgrade" in request.headers:
        return {}
    try:
        return dict(parse_qsl(query, keep_blank_values=True, max_num_fields=20))
    except ValueError:
        return {}


def _listen(door: Door, request: Request) -> None:
    """Remember what the visitor of a page speaks; a tuple is put in place at once."""
    page = request.path.partition("?")[0] == "/" and "Upgrade" not in request.headers
    if page:
        door.languages = languages_of(",".join(request.headers.get_all("Accept-Language")))


def _equal(one: str, other: str) -> bool:
    return hmac.compare_digest(one.encode("utf-8", "replace"), other.encode())
