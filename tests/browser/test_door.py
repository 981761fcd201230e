"""Only this machine's own page may come in, by http and websocket alike."""

from __future__ import annotations

import http.client
import socket

import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from .conftest import RunningStudio, Start

pytestmark = pytest.mark.browser


@pytest.fixture
def studio(start_studio: Start) -> RunningStudio:
    return start_studio()


def get(studio: RunningStudio, **headers: str) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=10)
    connection.putrequest("GET", "/", skip_host=True)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    status = connection.getresponse().status
    connection.close()
    return status


def test_http(studio: RunningStudio) -> None:
    port = studio.port
    assert get(studio, Host=f"localhost:{port}") == 200
    assert get(studio, Host=f"127.0.0.1:{port}") == 200
    assert get(studio, Host="evil.example") == 403
    assert get(studio, Host=f"evil.example:{port}") == 403
    assert get(studio, Host=f"localhost:{port + 1}") == 403
    assert get(studio, Host=f"localhost:{port}", Origin="http://evil.example") == 403
    assert get(studio, Host=f"localhost:{port}", Origin="null") == 403
    assert get(studio) == 403


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://localhost:1", "file://"]
)
def test_websocket_of_a_foreign_page(studio: RunningStudio, origin: str) -> None:
    with pytest.raises(InvalidStatus) as refused:
        connect(f"ws://localhost:{studio.port}", origin=origin)  # type: ignore[arg-type]
    assert refused.value.response.status_code == 403


def test_websocket_of_our_own_page(studio: RunningStudio) -> None:
    protocol = f"viser-v{viser.__version__}"
    with connect(
        f"ws://localhost:{studio.port}",
        origin=f"http://localhost:{studio.port}",  # type: ignore[arg-type]
        subprotocols=[protocol],  # type: ignore[list-item]
    ) as line:
        assert line.recv(timeout=10)


def test_loopback_only(studio: RunningStudio) -> None:
    """Another address of this machine finds nobody."""
    others = {
        info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
    } - {"127.0.0.1", "127.0.1.1"}
    if not others:
        pytest.skip("this machine has no address but loopback")
    for address in others:
        with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
            socket.create_connection((str(address), studio.port), timeout=2)
