"""Who may come in."""

from __future__ import annotations

import pytest

from app.door.guard import allowed, checked_token, languages_of, made_token
from app.door.guesses import LINE_S, PACE_S, Guesses
from handstudio.errors import HandstudioError

PORT = 8765


@pytest.mark.parametrize(
    "host", ["localhost:8765", "127.0.0.1:8765", "[::1]:8765", "LOCALHOST:8765"]
)
def test_this_machine_by_any_of_its_names(host: str) -> None:
    assert allowed(host, None, PORT)
    assert allowed(host, f"http://{host}", PORT)


@pytest.mark.parametrize(
    "host",
    [
        None,
        "",
        "localhost",  # the page is not on port 80
        "localhost:8766",
        "evil.example:8765",
        "localhost.evil.example:8765",
        "127.0.0.1.evil.example:8765",
        "192.168.1.2:8765",
    ],
)
def test_any_other_host(host: str | None) -> None:
    assert not allowed(host, None, PORT)


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "https://localhost:8765",  # we serve no TLS: not our page
        "http://localhost:8766",
        "http://localhost",
        "null",
        "",
        "file://",
        "http://localhost:8765@evil.example",
        "http://[",
    ],
)
def test_any_other_page(origin: str) -> None:
    assert not allowed("localhost:8765", origin, PORT)


def test_a_page_on_the_port_of_the_web_needs_no_port_in_its_name() -> None:
    assert allowed("localhost", "http://localhost", 80)
    assert allowed("localhost:80", None, 80)
    assert not allowed("evil.example", None, 80)


@pytest.mark.parametrize(
    ("header", "languages"),
    [
        ("ja,en-US;q=0.7,en;q=0.3", ("ja", "en-US", "en")),
        ("en;q=0.3, ja ; q=0.9", ("ja", "en")),
        ("de-AT", ("de-AT",)),
        ("fr;q=0, en", ("en",)),
        ("en, ja", ("en", "ja")),  # equal ones as they stand
        ("", ()),
        ("*", ()),
        ("<script>;q=1,en;q=nan,ja;q=9", ()),
    ],
)
def test_languages_come_best_first(header: str, languages: tuple[str, ...]) -> None:
    assert languages_of(header) == languages


def test_made_tokens_are_long_and_never_the_same() -> None:
    made = {made_token() for _ in range(50)}
    assert len(made) == 50
    assert all(checked_token(token) == token and len(token) >= 32 for token in made)


@pytest.mark.parametrize("token", ["", "fifteen-letters", "a" * 129, "sixteen letters!", "手" * 16])
def test_a_token_that_is_easy_to_guess_or_no_part_of_a_link(token: str) -> None:
    with pytest.raises(HandstudioError, match="16 to 128") as refused:
        checked_token(token)
    assert not token or token not in str(refused.value)


def test_guesses_of_one_visitor_wait_for_each_other() -> None:
    guesses = Guesses()
    waits = [guesses.wait_s("192.168.1.9", 100.0) for _ in range(3)]
    assert waits == [0.0, PACE_S, 2 * PACE_S]
    assert guesses.wait_s("192.168.1.10", 100.0) == 0.0  # nobody waits for a stranger
    assert guesses.wait_s("192.168.1.9", 200.0) == 0.0


def test_the_line_of_guesses_is_short_and_passes() -> None:
    guesses = Guesses()
    waits = [guesses.wait_s("10.0.0.1", 5.0) for _ in range(1000)]
    taken = [wait for wait in waits if wait is not None]
    assert max(taken) <= LINE_S
    assert len(taken) == LINE_S / PACE_S + 1
    assert guesses.wait_s("10.0.0.1", 5.0 + 2 * LINE_S) == 0.0  # those sent away do not prolong it


def test_whoever_knows_it_at_last_does_not_wait_again() -> None:
    guesses = Guesses()
    guesses.wait_s("10.0.0.1", 0.0)
    guesses.forgive("10.0.0.1")
    assert guesses.wait_s("10.0.0.1", 0.0) == 0.0


def test_a_machine_with_many_addresses_is_one_visitor() -> None:
    guesses = Guesses()
    assert guesses.wait_s("2001:db8:1:2::3", 0.0) == 0.0
    assert guesses.wait_s("2001:db8:1:2:ffff::9", 0.0) == PACE_S
    assert guesses.wait_s("fe80::1%eth0", 0.0) == 0.0
    assert guesses.wait_s("::ffff:10.0.0.7", 0.0) == 0.0
    assert guesses.wait_s("10.0.0.7", 0.0) == PACE_S


def test_what_is_remembered_of_visitors_is_bounded() -> None:
    guesses = Guesses()
    for number in range(5000):
        guesses.wait_s(f"10.1.{number // 250}.{number % 250}", 0.0)
    assert len(guesses._next) == 1000
