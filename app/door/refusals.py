"""What the door answers with: short pages in plain words, redirects, and headers for all pages.

The pages speak English and Japanese at once: who stands outside has not chosen a language.
"""

from __future__ import annotations

import html
from http import HTTPStatus
from typing import NamedTuple

from websockets.datastructures import Headers
from websockets.http11 import Response


class Refusal(NamedTuple):
    """A refusal: status, what is said in English and in Japanese."""

    status: HTTPStatus
    english: tuple[str, str]
    japanese: tuple[str, str]


NO_TOKEN = Refusal(
    HTTPStatus.UNAUTHORIZED,
    (
        "This studio asks for its link.",
        "Open the link that is shown in the terminal where handstudio was started. "
        "It ends with ?token= and a long word. After a restart of the studio there is a new one.",
    ),
    (
        "このスタジオを開くには専用のリンクが必要です。",
        "handstudio を起動した端末に表示されているリンク"
        "（末尾が ?token= と長い文字列）を開いてください。"
        "スタジオを再起動するとリンクは新しくなります。",
    ),
)

WRONG_TOKEN = Refusal(
    HTTPStatus.FORBIDDEN,
    (
        "This link is not, or no longer, the studio's.",
        "Open the link that is shown in the terminal where handstudio was started, whole: "
        "a part may have been lost in copying.",
    ),
    (
        "このリンクは正しくないか、すでに無効です。",
        "handstudio を起動した端末に表示されているリンクを、"
        "途中で切れないように全体をコピーして開いてください。",
    ),
)

TOO_MANY = Refusal(
    HTTPStatus.TOO_MANY_REQUESTS,
    (
        "Too many wrong links were tried from here.",
        "Wait ten seconds, then open the link that is shown in the terminal.",
    ),
    (
        "誤ったリンクが何度も試されました。",
        "10 秒ほど待ってから、端末に表示されているリンクを開いてください。",
    ),
)

FOREIGN = Refusal(
    HTTPStatus.FORBIDDEN,
    (
        "This studio is not served under this address, or not to this page.",
        "Open the address that is shown in the terminal where handstudio was started.",
    ),
    (
        "このアドレスまたはこのページからはスタジオを開けません。",
        "handstudio を起動した端末に表示されているアドレスを開いてください。",
    ),
)

_STYLE = (
    "body{font:1.1rem/1.6 system-ui,sans-serif;max-width:36rem;margin:15vh auto;padding:0 1rem;"
    "color-scheme:light dark}h1{font-size:1.3rem}section{margin-bottom:2rem}"
)

_ALWAYS = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
}


def refused(refusal: Refusal, again: str | None = None) -> Response:
    """A page that says why not, and what to do; with ``again`` the browser then goes there."""
    refresh = f'<meta http-equiv="refresh" content="0;url={again}">' if again else ""
    sections = "".join(
        f'<section lang="{language}"><h1>{html.escape(what)}</h1><p>{html.escape(remedy)}</p>'
        "</section>"
        for language, (what, remedy) in (("en", refusal.english), ("ja", refusal.japanese))
    )
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        f"<title>handstudio</title>{refresh}<style>{_STYLE}</style></head>"
        f"<body>{sections}</body></html>"
    )
    response = _response(refusal.status, page.encode())
    response.headers["Content-Type"] = "text/html; charset=utf-8"
    response.headers["Content-Security-Policy"] = (
        "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'"
    )
    return response


def redirected(cookie: str | None = None) -> Response:
    """To the page itself; what stood in the link is left behind."""
    response = _response(HTTPStatus.SEE_OTHER, b"")
    response.headers["Location"] = "/"
    if cookie is not None:
        response.headers["Set-Cookie"] = cookie
    return response


def harden(response: Response, host: str) -> None:
    """Headers for the studio's own pages: in no frame, and in touch with nobody but us."""
    for name, value in _ALWAYS.items():
        response.headers[name] = value
    response.headers["Content-Security-Policy"] = (
        f"connect-src 'self' ws://{host} data: blob:; object-src 'none'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'"
    )


def _response(status: HTTPStatus, body: bytes) -> Response:
    headers = Headers(
        [
            ("Connection", "close"),
            ("Content-Length", str(len(body))),
            ("Cache-Control", "no-store"),
            *_ALWAYS.items(),
        ]
    )
    return Response(status.value, status.phrase, headers, body)
