"""HTML and inputs of the page, as all panels write them."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape
from typing import Any

GREEN, RED = "#1b7f5c", "#c1272d"

PHONE_STYLE = """<style>
@media (max-width: 36em) {
  [style*="width: 20em"] { width: 100% !important; }
  [style*="width: 20em"] div:has(> [style*="grid-template-rows"]) { display: flex; flex-direction: column; }
  [style*="width: 20em"] [style*="grid-template-rows"] ~ * { order: -1; }
}
</style>"""
"""On a phone viser has a sheet 20 em wide, the camera's panel under all others: as wide as the phone, and on top."""


def put_value(handle: Any, value: Any) -> None:
    """Give an input a value that it does not have; what is sent again makes the page blink."""
    if handle.value != value:
        handle.value = value


def padded(html: str) -> str:
    """HTML as far from the panel's edges as its inputs are."""
    return f'<div style="padding:0 0.8em;font-size:0.875em">{html}</div>'


def mark(sentence: str, *, wrong: bool) -> str:
    """A sentence in green or red."""
    sign, colour = ("&#10007;", RED) if wrong else ("&#10003;", GREEN)
    return f'<p style="color:{colour};margin:0.2em 0">{sign} {escape(sentence)}</p>'


def row_mark(check: str, counts: str, nearest: str) -> str:
    """A check in green or red; pointed at it says what is nearest to its limit."""
    return f'<div title="{escape(nearest)}">{mark(f"{check}: {counts}", wrong="failed" in counts)}</div>'


def preformatted(lines: Iterable[str]) -> str:
    """Lines to copy."""
    text = escape("\n".join(lines))
    return padded(
        f'<pre style="white-space:pre-wrap;overflow-wrap:anywhere;user-select:text;font-size:0.8em">{text}</pre>'
    )


def film_html(film: bytes) -> str:
    """A film in the page itself: the server has no other files."""
    source = f"data:video/mp4;base64,{base64.b64encode(film).decode()}"
    return f'<video src="{source}" controls autoplay muted loop style="width:100%"></video>'
