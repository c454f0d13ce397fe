"""The prose of a page in Markdown, without code, tables and headings, and where it breaks the rules of prose."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

MOST_WORDS, MEAN_WORDS = 25, 15
MOST_LINES, LINE = 5, 100
"""A paragraph has at most so many lines of so many characters, whatever the width of the file's own lines."""

_LEFT_OUT = re.compile(r"^(`{3,})[^`].*?^\1\s*$|^```\n.*?^```$|<!--.*?-->|^\|.*?$|^!\[.*?$|^#.*?$", re.M | re.S)
_SOURCES = re.compile(r"^## Sources\n.*?(?=^## |\Z)", re.M | re.S)
_ITEM = re.compile(r"^\s*(?:[-*]|\d+\.) +", re.M)
_LINK = re.compile(r"!?\[([^\[\]]*)\]\([^()\s]*(?:\([^()]*\))?[^()\s]*\)")
_END = re.compile(r"(?<![ (][A-Z])(?<!e\.g)(?<!i\.e)[.!?][\"'*)\]]*\s+(?=[A-Z0-9\"'*(\[`]|bimvox )")
_BRACKETS = re.compile(r"\(([^()]*)\)")
_TUPLE = re.compile(r"(?:\d+|[a-zA-Z])(?:, (?:\d+|[a-zA-Z]))+")


@dataclass(frozen=True)
class Prose:
    """Paragraphs and items of lists, as a reader sees them."""

    paragraphs: tuple[str, ...]

    @property
    def sentences(self) -> list[str]:
        return [one for text in self.paragraphs for one in _END.split(text) if re.search(r"\w", one)]


def prose_of(text: str) -> Prose:
    """Return the prose of a page; sources are references, not prose."""
    text = _LEFT_OUT.sub("", _SOURCES.sub("", text))
    parts = (part for block in re.split(r"\n\s*\n", text) for part in _ITEM.split(block))
    return Prose(tuple(shown for part in parts if (shown := _shown(part))))


def _shown(text: str) -> str:
    text = re.sub(r"`+[^`]+`+", "Code", _LINK.sub(r"\1", _LINK.sub(r"\1", text)))
    return re.sub(r"\s+", " ", text.replace("**", "").replace("\\", "")).strip()


def words_of(sentence: str) -> int:
    return sum(bool(re.search(r"\w", word)) for word in sentence.split())


def faults(text: str) -> Iterator[str]:
    """Yield each breach of the rules of prose, with its place."""
    prose = prose_of(text)
    lengths = [words_of(sentence) for sentence in prose.sentences]
    for sentence, length in zip(prose.sentences, lengths, strict=True):
        if length > MOST_WORDS:
            yield f"{length} words: {sentence}"
        if sentence.count(";") > 1:
            yield f"a chain of semicolons: {sentence}"
        if re.search(r"—| – ", sentence):
            yield f"a dash: {sentence}"
        for inside in _BRACKETS.findall(sentence):
            if inside.count(",") + inside.count(";") > 1 and not _TUPLE.fullmatch(inside):
                yield f"a list in brackets: ({inside})"
    for paragraph in prose.paragraphs:
        lines = math.ceil(len(paragraph) / LINE)
        if lines > MOST_LINES:
            yield f"{lines} lines: {paragraph[:80]}..."
    if lengths and (mean := sum(lengths) / len(lengths)) > MEAN_WORDS:
        yield f"a sentence has {mean:.1f} words on average"
