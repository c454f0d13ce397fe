"""The table of words (``words.toml``): what the names of materials, types and parts say, in many languages.

A name is compared without case, accents and punctuation: ``Béton-armé_C30/37`` is ``beton arme c30 37``, and camel case
is split. A word of the table is whole (``rame``), the beginning of a word (``brick*``), its end (``*stahl``), or
anywhere in it (``*beton*``). Where several match, the longest decides: ``fiberglass`` is not glass. Of equal ones the
last in the name does, since the languages that join words put the head last: ``Stahlbeton`` is concrete. Generic words
(``metal``, ``wood``, ``stone``) say something only where no other word does. Last come the words of open dictionaries
in many more languages (``open_words.toml``, made by ``supply/words.py``), each a whole word.
"""

from __future__ import annotations

import functools
import re
import tomllib
import unicodedata
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any

from bimvox.bim.building import Casting
from bimvox.bim.kinds.kind import Kind

_LANGUAGE = re.compile(r"[a-z]{2}")
_CAMEL = re.compile(r"(?<=[a-zß-ÿ])(?=[A-ZÀ-Þ])")
_APART = re.compile(r"[^\w*]+|_+")
_WITHOUT_SPACES = re.compile(r"[\u3040-\u30ff\u3400-\u9fff\uac00-\ud7af]")
_LETTERS = str.maketrans({"ł": "l", "ø": "o", "đ": "d", "æ": "ae", "œ": "oe", "ı": "i", "ð": "d", "þ": "th"})


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a word says.

    Attributes:
        name: What the entry of the table is called.
        says: Its ``kind``, or for words about casting what they say.
        kg_m3: Density; None if it says nothing about it.
        generic: Whether it says something only where no other word does.
        open: Whether it is of an open dictionary, which says something only where the table does not.
        casting: What it also says about casting.
        share: How much of its box a part is that is drawn as one solid block; None if that is what it is.
        word: The word itself, as the table has it.
    """

    name: str
    says: str
    kg_m3: float | None = None
    generic: bool = False
    casting: str | None = None
    word: str = ""
    open: bool = False
    share: float | None = None

    @property
    def kind(self) -> Kind | None:
        """The kind of part that it says; None if it says something else."""
        return Kind(self.says) if self.says in list(Kind) else None


@dataclass(frozen=True, slots=True)
class _Word:
    literal: str
    pattern: re.Pattern[str] | None
    """None: anywhere."""
    meaning: Meaning

    def found(self, name: str) -> tuple[int, int] | None:
        """Return how long its last match in a plain name is and where it ends; None if there is none."""
        if self.literal and self.literal not in name:
            return None
        if self.pattern is None:
            return len(self.literal), name.rindex(self.literal) + len(self.literal)
        matches = list(self.pattern.finditer(name))
        return (len(matches[-1].group()), matches[-1].end()) if matches else None


@functools.cache
def meaning_of(name: str, table: str = "material", shortest: int = 1, *, dictionaries: bool = True) -> Meaning | None:
    """Return what a name says; None if it says nothing.

    Args:
        name: Of a material, a type or a part.
        table: ``material`` (what it is made of), ``part`` (what it is), ``shape`` (what it looks like) or
            ``casting`` (where it is made).
        shortest: Letters that a word must have to say anything.
        dictionaries: Whether the words of open dictionaries count too.

    >>> meaning_of("Concrete - Precast C35/45").kg_m3
    2500.0
    """
    plain_name = plain(name)
    found = [(word.found(plain_name), word.meaning) for word in (_words if dictionaries else _own_words)(table)]
    matches = [
        (_rank(meaning), *match, meaning) for match, meaning in found if match is not None and match[0] >= shortest
    ]
    return max(matches, key=lambda match: match[:3])[3] if matches else None


@functools.cache
def casting_by_name(name: str) -> Casting | None:
    """Return how the words of one name say that a part is cast; None if they do not say it.

    Said plainly, precast comes before in situ (a plank with its topping), and in situ before the trade name of a
    product (a topping on planks).
    """
    plain_name = plain(name)
    said = {word.meaning.says for word in _words("casting") if word.found(plain_name) is not None}
    if "precast" in said:
        return Casting.PRECAST
    if "in_situ" in said:
        return Casting.IN_SITU
    return Casting.PRECAST if "product" in said else None


@functools.cache
def plain(name: str) -> str:
    """Return a name in lower case, without accents, its words apart by one space."""
    apart = _CAMEL.sub(" ", unicodedata.normalize("NFC", name))
    folded = unicodedata.normalize("NFKD", unicodedata.normalize("NFKC", apart).casefold().translate(_LETTERS))
    letters = "".join(letter for letter in folded if not unicodedata.combining(letter))
    return _APART.sub(" ", unicodedata.normalize("NFC", letters)).strip()


def _rank(meaning: Meaning) -> int:
    return 0 if meaning.open else 1 if meaning.generic else 2


@functools.cache
def _words(table: str) -> tuple[_Word, ...]:
    own = _own_words(table)
    if table != "material":
        return own
    by_name = {word.meaning.name: word.meaning for word in reversed(own)}
    found = [
        _word(word, replace(by_name[entry["name"]], generic=False, open=True))
        for entry in _read("open_words.toml")[table]
        for language, words in entry.items()
        if language != "name"
        for word in words.split(", ")
    ]
    return (*own, *found)


def _read(name: str) -> dict[str, Any]:
    return tomllib.loads(files("bimvox.bim.kinds").joinpath(name).read_text(encoding="utf-8"))


@functools.cache
def _own_words(table: str) -> tuple[_Word, ...]:
    """Return the words of ``words.toml`` alone."""
    found = []
    for entry in _read("words.toml")[table]:
        meaning = Meaning(
            entry.get("name", ""),
            entry.get("kind") or entry["says"],
            entry.get("kg_m3"),
            entry.get("generic", False),
            entry.get("casting"),
            share=entry.get("share"),
        )
        for key, value in entry.items():
            if _LANGUAGE.fullmatch(key):
                found += [_word(word, meaning) for word in value.split(",")]
        if code := entry.get("code"):
            found.append(_Word("", re.compile(code), replace(meaning, word=meaning.name)))
    return tuple(found)


def _word(written: str, meaning: Meaning) -> _Word:
    word = plain(written)
    literal = word.strip("*").strip()
    meaning = replace(meaning, word=written.strip().strip("*"))
    begins, ends = word.startswith("*"), word.endswith("*")
    if (begins and ends) or _WITHOUT_SPACES.search(literal):
        return _Word(literal, None, meaning)
    return _Word(literal, re.compile(("" if begins else r"\b") + re.escape(literal) + ("" if ends else r"\b")), meaning)
