"""``python -m docs.reference``: write the reference pages again, or with ``--check`` say which are stale."""

from __future__ import annotations

import argparse
import functools
import sys
from pathlib import Path

from docs.reference.commands import command_pages
from docs.reference.formats import format_pages

DOCS = Path(__file__).parents[1]


@functools.cache  # rendering every help text takes seconds
def pages() -> dict[str, str]:
    """Return the text of every page that follows from the code, by its path in ``docs``."""
    return command_pages() | format_pages()


def stale(docs: Path = DOCS) -> list[str]:
    """Return the paths in ``docs`` whose text is not what follows from the code, and pages of what is no more."""
    wanted = pages()
    there = {f"{folder}/{file.name}" for folder in ("commands", "formats") for file in (docs / folder).glob("*.md")}
    changed = [path for path, text in wanted.items() if path not in there or (docs / path).read_text("utf-8") != text]
    return sorted([*changed, *(there - wanted.keys())])


def write(docs: Path = DOCS) -> list[str]:
    """Write what is stale, remove what is no more, and return both."""
    wanted = pages()
    found = stale(docs)
    for path in found:
        if path in wanted:
            (docs / path).parent.mkdir(parents=True, exist_ok=True)
            (docs / path).write_text(wanted[path], "utf-8")
        else:
            (docs / path).unlink()
    return found


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a page is stale")
    check = parser.parse_args().check
    for path in stale() if check else write():
        print(f"docs/{path}")
        if check:
            print("  stale: run `make docs`", file=sys.stderr)
    return int(check and bool(stale()))


if __name__ == "__main__":
    sys.exit(main())
