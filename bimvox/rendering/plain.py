"""Texts as a terminal or a page may show them: control characters of names are written out, not obeyed."""

from __future__ import annotations

import html
import re

_CONTROL = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")


def plain(text: str) -> str:
    """Return a text with control characters as escapes; line ends stay."""
    return _CONTROL.sub(lambda found: found[0].encode("unicode_escape", "surrogatepass").decode(), text)


def escape(text: str) -> str:
    """Return a plain text for HTML and SVG: as text, and within quotation marks."""
    return html.escape(plain(text))
