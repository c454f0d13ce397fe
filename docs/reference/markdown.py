"""The little Markdown that the pages are made of."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence


def prose(text: str) -> str:
    """Return help text or a docstring as Markdown: paragraphs kept, their lines joined."""
    paragraphs = [re.sub(r"\s+", " ", part).strip() for part in text.replace("``", "`").split("\n\n")]
    return "\n\n".join(part for part in paragraphs if part)


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table; columns without a head that are empty throughout are left out."""
    kept = [n for n, head in enumerate(heads) if any(row[n] for row in rows) or not rows]
    yield "| " + " | ".join(heads[n] for n in kept) + " |"
    yield "|" + "---|" * len(kept)
    for row in rows:
        yield "| " + " | ".join(row[n].replace("\n", " ").replace("|", "\\|") for n in kept) + " |"
