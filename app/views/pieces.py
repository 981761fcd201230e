"""Pieces that sheets are put together from, as HTML."""

from __future__ import annotations

import html
from collections.abc import Sequence

GREEN, AMBER, RED, GREY = "#12b886", "#f5a524", "#e5484d", "rgba(128,132,140,.35)"


def frame(content: str) -> str:
    """As high as the fullest step, so that the buttons below stay where they are."""
    return f'<div style="padding:.6em 1em .3em;min-height:15.2rem">{content}</div>'


def big(sign: str, colour: str, beside: str) -> str:
    """A sign that is seen from afar, and what stands beside it."""
    return (
        '<div style="display:flex;gap:1.1em;align-items:flex-start">'
        f'<div style="font:700 4.6rem/1 system-ui,sans-serif;color:{colour};min-width:1.05em;'
        f'text-align:center;font-variant-numeric:tabular-nums">{html.escape(sign)}</div>'
        f'<div style="flex:1;min-width:0">{beside}</div></div>'
    )


def sentence(words: str, colour: str = "inherit") -> str:
    """What is read from two metres away."""
    return (
        f'<div style="font-size:1.75rem;line-height:1.2;font-weight:600;color:{colour}">'
        f"{html.escape(words)}</div>"
    )


def line(words: str) -> str:
    """What is read once one is near."""
    return f'<div style="font-size:1.1rem;line-height:1.4">{html.escape(words)}</div>'


def small(words: str) -> str:
    """What may be read."""
    if not words:
        return ""
    return f'<div style="font-size:.95rem;line-height:1.4;opacity:.75">{html.escape(words)}</div>'


def table(titles: Sequence[str], rows: Sequence[tuple[str, Sequence[str]]]) -> str:
    """A table of words; each row with its colour, empty: as all else."""
    style = "text-align:left;padding-right:1.2em"
    head = "".join(f'<th style="{style}">{html.escape(title)}</th>' for title in titles)
    body = "".join(_row(colour, cells) for colour, cells in rows)
    return (
        '<table style="font-size:.85rem;line-height:1.4;border-collapse:collapse;'
        'font-variant-numeric:tabular-nums;white-space:nowrap;margin-top:.4em">'
        f"<tr>{head}</tr>{body}</table>"
    )


def _row(colour: str, cells: Sequence[str]) -> str:
    inner = "".join(f'<td style="padding-right:1.2em">{html.escape(cell)}</td>' for cell in cells)
    return f'<tr style="{f"color:{colour}" if colour else ""}">{inner}</tr>'
