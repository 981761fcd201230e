"""Only this machine's own page may come in, by http and websocket alike."""

from __future__ import annotations

import http.client
import http.server
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import viser
from playwright.sync_api import Browser, ConsoleMessage, expect
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.door.network import own_addresses

from .conftest import DRAW_WHEN_ASKED, RunningStudio, Start, begin, end

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningStudio]:
    """One for all that only knock."""
    place = tmp_path_factory.mktemp("door")
    studio = begin(place / "sessions", place / "settings.json")
    yield studio
    end(studio)


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
    others = own_addresses()
    if not others:
        pytest.skip("this machine has no address but loopback")
    for address in others:
        with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
            socket.create_connection((str(address), studio.port), timeout=2)


# --- on a network ---------------------------------------------------------------------------------


@pytest.fixture
def other_site() -> Iterator[http.server.HTTPServer]:
    """A site of somebody else: it links to whatever stands behind its own question mark."""

    class Site(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = f'<a id="link" href="{self.path.partition("?to=")[2]}">studio</a>'.encode()
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    server = http.server.HTTPServer(("127.0.0.1", 0), Site)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_link_from_another_site_opens_the_studio_and_forgets_the_token(
    start_studio: Start, browser: Browser, other_site: http.server.HTTPServer
) -> None:
    studio = start_studio("--host", "0.0.0.0", "--virtual")
    token = studio.link.partition("?token=")[2]
    assert len(token) >= 32
    there = f"http://127.0.0.2:{studio.port}"  # an address of this machine, and a foreign site
    context = browser.new_context()
    context.add_init_script(DRAW_WHEN_ASKED)
    page = context.new_page()
    told: list[str] = []

    def hear(message: ConsoleMessage) -> None:
        if "Content Security Policy" in message.text:
            told.append(message.text)

    page.on("console", hear)

    page.goto(there)
    expect(page.get_by_text("This studio asks for its link.")).to_be_visible()
    expect(page.get_by_text("専用のリンクが必要です")).to_be_visible()
    page.goto(f"{there}/?token=wrong")
    expect(page.get_by_text("not, or no longer, the studio's")).to_be_visible()

    site = f"http://127.0.0.1:{other_site.server_address[1]}"
    page.goto(f"{site}/?to={there}/?token={token}")
    page.locator("#link").click()
    expect(page.get_by_role("tab", name="Device")).to_be_visible()
    expect(page.get_by_text("Hz").first).to_be_visible()  # so the websocket came in too
    assert page.url == f"{there}/"
    assert token not in page.content()
    assert page.evaluate("document.cookie") == ""
    assert not [cookie for cookie in context.cookies() if token in cookie["value"]]

    page.reload()
    expect(page.get_by_role("tab", name="Device")).to_be_visible()
    assert told == []
    context.close()


@pytest.mark.long
def test_a_foreign_page_cannot_use_the_cookie_of_ours(
    start_studio: Start, browser: Browser, other_site: http.server.HTTPServer
) -> None:
    studio = start_studio("--host", "0.0.0.0")
    there = f"127.0.0.2:{studio.port}"
    context = browser.new_context()
    context.add_init_script(DRAW_WHEN_ASKED)
    page = context.new_page()
    page.goto(f"http://{there}/?token={studio.link.partition('?token=')[2]}")
    expect(page.get_by_role("tab", name="Device")).to_be_visible()
    page.goto(f"http://127.0.0.1:{other_site.server_address[1]}/")
    opened = page.evaluate(
        """where => new Promise(done => {
            const line = new WebSocket(`ws://${where}/`);
            line.onopen = () => done(true);
            line.onerror = () => done(false);
        })""",
        there,
    )
    assert opened is False
    page.set_content(f'<iframe src="http://{there}/"></iframe>')
    page.wait_for_load_state()
    frames = [frame for frame in page.frames if frame != page.main_frame]
    assert not any(frame.get_by_role("tab").count() for frame in frames)
    context.close()


@pytest.mark.long
def test_the_token_stands_nowhere_but_in_the_link(
    start_studio: Start, tmp_path: Path, log_folder: Path
) -> None:
    studio = start_studio("--host", "0.0.0.0")
    token = studio.link.partition("?token=")[2]
    assert get(studio, Host=f"localhost:{studio.port}") == 401
    for process in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = process.read_bytes()
        except OSError:
            continue
        assert token.encode() not in words
    assert "served with a token" in (log_folder / "studio.log").read_text("utf-8")
    for file in [*tmp_path.rglob("*"), *log_folder.iterdir()]:
        assert not file.is_file() or token.encode() not in file.read_bytes()


@pytest.mark.long
def test_a_token_of_ones_own_comes_by_the_environment_and_is_not_said_again(
    start_studio: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    token = "a-word-of-our-own-choice"
    monkeypatch.setenv("HANDSTUDIO_TOKEN", token)
    studio = start_studio()  # on loopback, and asked for all the same
    assert studio.link.endswith("/?token=TOKEN")  # its output may be kept in a file
    assert get(studio, Host=f"localhost:{studio.port}") == 401
    connection = http.client.HTTPConnection("localhost", studio.port, timeout=10)
    connection.request("GET", f"/?token={token}")
    assert connection.getresponse().status == 303
    connection.close()
