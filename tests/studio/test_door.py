"""The door with real sockets: a server of viser's own kind behind it, and visitors of all sorts."""

from __future__ import annotations

import http.client
import logging
import re
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO

import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.door import guard, guesses, network
from app.door.guard import Door, guarded
from handstudio.errors import HandstudioError

TOKEN = "four-years-of-work-in-one-word"


@dataclass(frozen=True)
class Answer:
    status: int
    headers: dict[str, str]
    body: str

    @property
    def cookie(self) -> str:
        return self.headers.get("set-cookie", "").partition(";")[0]


@dataclass
class House:
    """A server behind a door."""

    door: Door
    port: int

    def get(
        self, path: str = "/", host: str = "localhost", to: str = "127.0.0.1", **headers: str
    ) -> Answer:
        connection = http.client.HTTPConnection(to, self.port, timeout=20)
        connection.putrequest("GET", path, skip_host=True)
        for name, value in {"Host": f"{host}:{self.port}", **headers}.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders()
        response = connection.getresponse()
        body = response.read().decode("utf-8", "replace")
        connection.close()
        names = {name.lower(): value for name, value in response.getheaders()}
        return Answer(response.status, names, body)

    def upgrade(self, host: str = "localhost", **headers: str) -> int:
        """Status of a websocket's knock: 101 when it is let in."""
        try:
            with connect(
                f"ws://{host}:{self.port}",
                origin=f"http://{host}:{self.port}",  # type: ignore[arg-type]
                additional_headers=headers,
                subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
            ) as line:
                assert line.recv(timeout=20)
                return 101
        except InvalidStatus as refused:
            return refused.response.status_code


@pytest.fixture(scope="module")
def house() -> Iterator[Callable[..., House]]:
    servers: list[viser.ViserServer] = []

    def build(door: Door, address: str = "127.0.0.1") -> House:
        with redirect_stdout(StringIO()), guarded(door):
            port = network.free_port(address, 21000 + 10 * len(servers))
            servers.append(viser.ViserServer(host=address, port=port, verbose=False))
        return House(door, servers[-1].get_port())

    yield build
    with redirect_stdout(StringIO()):
        for server in servers:
            server.stop()


@pytest.fixture(scope="module")
def closed(house: Callable[..., House]) -> House:
    """Visitors need the token; served on every address of this machine."""
    return house(Door(network.hosts("0.0.0.0", "0.0.0.0"), TOKEN), "0.0.0.0")


@pytest.fixture(scope="module")
def open_house(house: Callable[..., House]) -> House:
    return house(Door())


@pytest.fixture(autouse=True)
def _nobody_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guesses, "PACE_S", 0.0)


# --- the token ------------------------------------------------------------------------------------


def test_the_link_gives_a_cookie_and_leaves_the_token_behind(closed: House) -> None:
    answer = closed.get(f"/?token={TOKEN}")
    assert answer.status == 303
    assert answer.headers["location"] == "/"
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert answer.headers["cache-control"] == "no-store"
    name, *attributes = answer.headers["set-cookie"].split("; ")
    assert name.startswith(f"handstudio-{closed.port}=")
    assert set(attributes) == {"Path=/", "HttpOnly", "SameSite=Strict"}
    assert TOKEN not in str(answer)


def test_page_files_and_websocket_need_the_cookie(closed: House) -> None:
    cookie = closed.get(f"/?token={TOKEN}").cookie
    assert closed.get("/", Cookie=cookie).status == 200
    assert closed.get("/", Cookie=f"theme=dark; {cookie}; x").status == 200
    assert closed.get("/nothing.js", Cookie=cookie).status == 404
    assert closed.upgrade(Cookie=cookie) == 101
    for none in ("", "handstudio-1=x", f"handstudio-{closed.port}=", f"x{cookie}", f"{cookie}x"):
        assert closed.get("/", Cookie=none).status == 401
        assert closed.get("/index.html", Cookie=none).status == 401
        assert closed.get("/nothing.js", Cookie=none).status == 401
        assert closed.upgrade(Cookie=none) == 401


def test_the_token_itself_is_no_cookie_and_opens_no_websocket(closed: House) -> None:
    assert closed.get("/", Cookie=f"handstudio-{closed.port}={TOKEN}").status == 401
    assert closed.get(f"/index.html?token={TOKEN}").status == 401
    with pytest.raises(InvalidStatus):
        connect(f"ws://localhost:{closed.port}/?token={TOKEN}")


@pytest.mark.parametrize("wrong", ["", "x", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), "%FF%00", "鍵"])
def test_a_wrong_token_opens_nothing(closed: House, wrong: str) -> None:
    quoted = "".join(f"%{byte:02X}" for byte in wrong.encode())
    answer = closed.get(f"/?token={quoted}")
    assert answer.status == 403
    assert "set-cookie" not in answer.headers


def test_what_is_said_outside_is_for_people_of_two_languages(closed: House) -> None:
    for answer in (closed.get("/?again="), closed.get("/?token=wrong")):
        assert answer.headers["content-type"] == "text/html; charset=utf-8"
        assert "the link that is shown in the terminal" in answer.body
        assert "端末に表示されているリンク" in answer.body
        assert "viser" not in answer.body
        assert "refresh" not in answer.body
        assert answer.headers["referrer-policy"] == "no-referrer"


def test_a_link_on_another_site_leads_in(closed: House) -> None:
    """The browser holds a strict cookie back on the way from there; our own page asks again."""
    cookie = closed.get(f"/?token={TOKEN}").cookie
    first = closed.get("/")
    assert first.status == 401
    again = re.search(r'http-equiv="refresh" content="0;url=([^"]+)"', first.body)
    assert again is not None
    answer = closed.get(again[1], Cookie=cookie)
    assert (answer.status, answer.headers["location"]) == (303, "/")
    outside = closed.get(again[1])
    assert outside.status == 401
    assert "refresh" not in outside.body  # no going round in circles


def test_who_is_in_already_loses_the_token_from_the_address_line(closed: House) -> None:
    cookie = closed.get(f"/?token={TOKEN}").cookie
    assert closed.get(f"/?token={TOKEN}", Cookie=cookie).headers["location"] == "/"
    assert closed.get("/?token=old", Cookie=cookie).status == 303


def test_another_studio_has_other_cookies(house: Callable[..., House], closed: House) -> None:
    other = house(Door(token=TOKEN))
    cookie = closed.get(f"/?token={TOKEN}").cookie
    renamed = cookie.replace(str(closed.port), str(other.port))
    assert other.get("/", Cookie=cookie).status == 401
    assert other.get("/", Cookie=renamed).status == 401


def test_on_loopback_a_token_that_is_given_is_asked_for_too(house: Callable[..., House]) -> None:
    one = house(Door(token=TOKEN))
    assert one.get().status == 401
    assert one.get("/", Cookie=one.get(f"/?token={TOKEN}").cookie).status == 200


# --- tickets --------------------------------------------------------------------------------------


def test_a_ticket_opens_once(closed: House) -> None:
    ticket = closed.door.ticket()
    answer = closed.get(f"/?ticket={ticket}")
    assert answer.status == 303
    assert closed.get("/", Cookie=answer.cookie).status == 200
    assert closed.get(f"/?ticket={ticket}").status == 403


def test_a_ticket_opens_soon_or_never(closed: House, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "TICKET_S", -1.0)
    assert closed.get(f"/?ticket={closed.door.ticket()}").status == 403


def test_a_ticket_opens_to_this_machine_only(
    closed: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert network.same_machine("192.168.1.7", "192.168.1.7")
    assert network.same_machine("192.168.1.7", "::ffff:192.168.1.7")
    assert not network.same_machine("192.168.1.7", "192.168.1.8")
    monkeypatch.setattr(guard, "same_machine", lambda local, peer: False)
    ticket = closed.door.ticket()
    assert closed.get(f"/?ticket={ticket}").status == 403
    assert closed.door.redeems(ticket)  # nobody has used it up


# --- guessing -------------------------------------------------------------------------------------


def test_who_guesses_is_sent_away_and_who_is_in_notices_nothing(
    house: Callable[..., House], monkeypatch: pytest.MonkeyPatch
) -> None:
    one = house(Door(token=TOKEN))
    cookie = one.get(f"/?token={TOKEN}").cookie
    monkeypatch.setattr(guesses, "PACE_S", 3600.0)
    assert one.get("/?token=wrong").status == 403
    answer = one.get(f"/?token={TOKEN}")
    assert answer.status == 429
    assert "terminal" in answer.body
    assert "端末" in answer.body
    assert one.get("/", Cookie=cookie).status == 200
    assert one.get().status == 401


def test_a_guess_waits_for_the_one_before(
    house: Callable[..., House], monkeypatch: pytest.MonkeyPatch
) -> None:
    one = house(Door(token=TOKEN))
    monkeypatch.setattr(guesses, "PACE_S", 0.4)
    began = time.monotonic()
    assert [one.get("/?token=wrong").status for _ in range(3)] == [403] * 3
    assert time.monotonic() - began >= 0.75  # sooner would mean that nobody waited


# --- names ----------------------------------------------------------------------------------------


def test_every_name_and_address_of_this_machine_is_ours(closed: House) -> None:
    cookie = closed.get(f"/?token={TOKEN}").cookie
    for name in (*network.own_names(), "localhost", "127.0.0.1"):
        assert closed.get("/", host=name, Cookie=cookie).status == 200
        origin = f"http://{name}:{closed.port}"
        assert closed.get("/", host=name, Cookie=cookie, Origin=origin).status == 200
    for address in (*network.own_addresses(), "127.0.0.2"):
        assert closed.get("/", host=address, to=address, Cookie=cookie).status == 200


def test_addresses_of_the_new_kind(house: Callable[..., House]) -> None:
    try:
        network.bind_address("::")
    except HandstudioError:
        pytest.skip("this machine has no IPv6")
    one = house(Door(network.hosts("::", "::"), TOKEN), "::")
    for address in ("::1", *network.own_addresses(socket.AF_INET6)):
        host = network.as_host(address)
        answer = one.get(f"/?token={TOKEN}", host=host, to=address)
        assert answer.status == 303
        assert one.get("/", host=host, to=address, Cookie=answer.cookie).status == 200
        assert one.get("/", host="[2001:db8::9]", to=address, Cookie=answer.cookie).status == 403


@pytest.mark.parametrize("host", ["evil.example", "192.0.2.77", "127.0.0.2", "localhost.evil", ""])
def test_any_other_name_is_foreign_even_with_cookie_and_token(closed: House, host: str) -> None:
    cookie = closed.get(f"/?token={TOKEN}").cookie
    answer = closed.get("/", host=host, Cookie=cookie)
    assert answer.status == 403
    assert "端末に表示されているアドレス" in answer.body
    answer = closed.get(f"/?token={TOKEN}", host=host)
    assert answer.status == 403
    assert "set-cookie" not in answer.headers


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://localhost", "http://["])
def test_foreign_pages_stay_out_even_with_the_cookie(closed: House, origin: str) -> None:
    cookie = closed.get(f"/?token={TOKEN}").cookie
    assert closed.get("/", Cookie=cookie, Origin=origin).status == 403
    with pytest.raises(InvalidStatus) as refused:
        connect(
            f"ws://localhost:{closed.port}",
            origin=origin,  # type: ignore[arg-type]
            additional_headers={"Cookie": cookie},
        )
    assert refused.value.response.status_code == 403


# --- open on loopback -----------------------------------------------------------------------------


def test_on_loopback_nothing_is_asked(open_house: House) -> None:
    assert open_house.get().status == 200
    assert open_house.upgrade() == 101
    assert open_house.get(host="evil.example").status == 403
    assert open_house.get(host=network.own_names()[0]).status == 403


@pytest.mark.parametrize("kind", ["closed", "open_house"])
def test_pages_may_be_framed_by_nobody_and_call_nobody(
    kind: str, request: pytest.FixtureRequest
) -> None:
    one: House = request.getfixturevalue(kind)
    cookie = one.get(f"/?token={TOKEN}").cookie
    for answer in (one.get("/", Cookie=cookie), one.get(host="evil.example")):
        assert answer.headers["x-frame-options"] == "DENY"
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["referrer-policy"] == "no-referrer"
        assert "frame-ancestors 'none'" in answer.headers["content-security-policy"]
    policy = one.get("/", Cookie=cookie).headers["content-security-policy"]
    assert f"connect-src 'self' ws://localhost:{one.port} data: blob:;" in policy


def test_the_door_knows_what_the_newest_page_speaks(closed: House, open_house: House) -> None:
    cookie = closed.get(f"/?token={TOKEN}").cookie
    closed.get("/", Cookie=cookie, Accept_Language="ja,en;q=0.5")
    assert closed.door.languages == ("ja", "en")
    closed.get("/", Accept_Language="de")  # not let in
    closed.get("/nothing.js", Cookie=cookie, Accept_Language="fr")  # no page
    assert closed.door.languages == ("ja", "en")
    closed.upgrade(Cookie=cookie, Accept_Language="it")
    assert closed.door.languages == ("ja", "en")
    open_house.get("/", Accept_Language="en-GB")
    assert open_house.door.languages == ("en-GB",)
    open_house.get("/")
    assert open_house.door.languages == ()


def test_nothing_that_opens_is_logged(closed: House, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        cookie = closed.get(f"/?token={TOKEN}").cookie
        closed.get("/?token=a-wrong-word")
        closed.upgrade(Cookie=cookie)
        closed.upgrade()
    assert "wrong token" in caplog.text
    for word in (TOKEN, "a-wrong-word", cookie.partition("=")[2]):
        assert word not in caplog.text


# --- where to serve -------------------------------------------------------------------------------


def test_hosts_become_addresses() -> None:
    assert network.bind_address("127.0.0.1") == "127.0.0.1"
    assert network.bind_address("localhost") == "127.0.0.1"
    assert network.bind_address("0.0.0.0") == "0.0.0.0"
    assert network.bind_address("[::1]") == "::1"


@pytest.mark.parametrize("host", ["192.0.2.99", "no-such-machine.invalid", "", "a b", "x" * 300])
def test_a_host_that_is_not_here_is_said_so_at_once(host: str) -> None:
    with pytest.raises(HandstudioError) as refused:
        network.bind_address(host or " ")
    assert "0.0.0.0" in refused.value.remedy


@pytest.mark.parametrize("port", [-1, 65536, 10**9])
def test_what_is_no_port_is_said_so(port: int) -> None:
    with pytest.raises(HandstudioError, match="not the number of a port"):
        network.free_port("127.0.0.1", port)


def test_a_port_in_use_is_passed_over_whoever_has_it() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert network.free_port("127.0.0.1", port) > port
        assert network.free_port("0.0.0.0", port) > port
    with (
        pytest.raises(HandstudioError, match="No free port"),
        socket.create_server(("127.0.0.1", 65535)),
    ):
        network.free_port("127.0.0.1", 65535)


def test_links_lead_to_where_it_is_served() -> None:
    assert network.nearest_host("0.0.0.0") == "localhost"
    assert network.nearest_host("127.0.0.1") == "localhost"
    assert network.nearest_host("127.0.0.2") == "127.0.0.2"
    assert network.nearest_host("fd00::2") == "[fd00::2]"
    assert network.reachable_hosts("192.168.1.7") == ["192.168.1.7"]
    assert not {"0.0.0.0", "127.0.0.1", "[::]"} & set(network.reachable_hosts("0.0.0.0"))
    assert network.own_names()[-1].endswith(".local")
