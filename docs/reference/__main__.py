"""``python -m docs.reference``: write the reference pages into ``docs``, as the build of the site does."""

from __future__ import annotations

import functools
from pathlib import Path

from docs.reference.commands import command_pages
from docs.reference.formats import format_pages
from docs.reference.machines import machine_pages

DOCS = Path(__file__).parents[1]
FOLDERS = ("commands", "formats")
"""Folders of ``docs`` that hold written pages only."""


@functools.cache  # rendering every help text takes seconds
def pages() -> dict[str, str]:
    """Return the text of every page that follows from the code, by its path in ``docs``."""
    return command_pages() | format_pages() | machine_pages()


def write(docs: Path = DOCS) -> list[str]:
    """Write the pages whose text has changed, remove left-over ones, and return the paths of both in ``docs``."""
    wanted = pages()
    there = {f"{folder}/{file.name}" for folder in FOLDERS for file in (docs / folder).glob("*.md")}
    changed = [path for path, text in wanted.items() if path not in there or (docs / path).read_text("utf-8") != text]
    for path in changed:
        (docs / path).parent.mkdir(parents=True, exist_ok=True)
        (docs / path).write_text(wanted[path], "utf-8")
    for path in there - wanted.keys():
        (docs / path).unlink()
    return sorted([*changed, *(there - wanted.keys())])


if __name__ == "__main__":
    for path in write():
        print(f"docs/{path}")
