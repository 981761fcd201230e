"""Who may come in."""

from __future__ import annotations

import pytest

from app.guard import allowed

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
    ],
)
def test_any_other_page(origin: str) -> None:
    assert not allowed("localhost:8765", origin, PORT)
