"""A reader of reports for tests: what a program finds in the document."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from typing import Any


class ReadReport(HTMLParser):
    """The rows of every table by its id, numbers by their key, and the record that the report carries."""

    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.rows: dict[str, list[dict[str, Any]]] = {}
        self.totals: dict[str, float] = {}
        self.record: dict[str, Any] = {}
        self.tags: list[str] = []
        self.words: list[str] = []
        self._table = ""
        self._row: dict[str, Any] | None = None
        self._key: str | None = None
        self._in_record = False
        self._json = ""
        self.feed(page.decode())
        self.close()
        self.record = json.loads(self._json)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.tags.append(tag)
        if tag == "table":
            self._table = given.get("id", "")
        elif tag == "tr":
            self._row = {
                "words": "",
                "class": given.get("class", ""),
                **{k: v for k, v in given.items() if "data-" in k},
            }
            self.rows.setdefault(self._table, []).append(self._row)
        elif tag == "data" and "data-key" in given:
            into = self.totals if self._row is None else self._row
            into[given["data-key"]] = float(given["value"])
        elif tag == "script":
            self._in_record = given.get("type") == "application/json"

    def handle_endtag(self, tag: str) -> None:
        if tag == "tr":
            self._row = None
        elif tag == "script":
            self._in_record = False

    def handle_data(self, data: str) -> None:
        if self._in_record:
            self._json += data
            return
        self.words.append(data)
        if self._row is not None:
            self._row["words"] += data + " "

    @property
    def text(self) -> str:
        """Return all text that a reader sees."""
        return " ".join(self.words)
