"""The door: only this machine's own page may come in, by http and websocket alike.

viser checks neither Host nor Origin, so a foreign page could reach a studio on loopback by DNS
rebinding or a websocket of its own. The check is put around viser's request handler while its
server is being built.
"""

from __future__ import annotations

import http
import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import websockets.asyncio.server as websockets_server
from websockets.http11 import Request, Response

_LOOPBACK = ("localhost", "127.0.0.1", "[::1]")

_REFUSAL = "handstudio: this page is served to this machine only.\n"


def allowed(host: str | None, origin: str | None, port: int) -> bool:
    """Whether a request names us as its host, and comes from our own page or from no page."""
    ours = {f"{name}:{port}" for name in _LOOPBACK}
    if host is None or host.lower() not in ours:
        return False
    if origin is None:
        return True
    parts = urlsplit(origin.lower())
    return parts.scheme == "http" and parts.netloc in ours


@contextmanager
def guarded() -> Iterator[None]:
    """Within this block, websocket servers are built with the check at their door."""
    original = websockets_server.serve

    def serve(*args: Any, process_request: Callable[..., Any] | None = None, **kw: Any) -> Any:
        return original(*args, process_request=_checking(process_request), **kw)

    websockets_server.serve = serve  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        websockets_server.serve = original  # type: ignore[misc]


def _checking(inner: Callable[..., Any] | None) -> Callable[..., Any]:
    async def process_request(connection: Any, request: Request) -> Response | None:
        port = connection.local_address[1]
        hosts = request.headers.get_all("Host")
        origins = request.headers.get_all("Origin")
        once = len(hosts) == 1 and len(origins) <= 1
        if not once or not allowed(hosts[0], origins[0] if origins else None, port):
            refusal: Response = connection.respond(http.HTTPStatus.FORBIDDEN, _REFUSAL)
            return refusal
        if inner is None:
            return None
        answer = inner(connection, request)
        if inspect.isawaitable(answer):
            answer = await answer
        return answer  # type: ignore[no-any-return]

    return process_request
