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
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any

from bimvox.bim.building import Casting, Role, plain_class
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


MODULE_CLASSES = frozenset({"IfcBuildingElementProxy", "IfcProxy", "IfcBuiltElement", "IfcElementAssembly"})
"""What a room that comes ready-made, a machine or a barrier is drawn as; a wall with such a name is a wall of it."""
_WORD_OF_CLASS = {
    "IfcUnitaryEquipment": "rooftop unit",
    "IfcChiller": "chiller",
    "IfcCoolingTower": "cooling tower",
    "IfcCondenser": "condensing unit",
    "IfcBoiler": "boiler",
    "IfcElectricGenerator": "generator",
    "IfcEngine": "generator",
    "IfcTransformer": "transformer",
    "IfcTank": "tank",
}
_MACHINE_CLASSES = MODULE_CLASSES | {
    *("IfcEnergyConversionDevice", "IfcFlowStorageDevice", "IfcFlowMovingDevice", "IfcFlowTreatmentDevice"),
    *("IfcDistributionElement", "IfcDistributionFlowElement", "IfcCivilElement"),
}
_BARRIER_CLASSES = MODULE_CLASSES | {"IfcCivilElement", "IfcRailing", "IfcWall"}


def machine_of(ifc_class: str, names: Sequence[str | None]) -> Meaning | None:
    """Return what says that an element is a machine, a tank or a container: its names, else its class; None if not."""
    plain = plain_class(ifc_class)
    if plain not in _MACHINE_CLASSES and plain not in _WORD_OF_CLASS:
        return None
    named = _named(names, "machine")
    return named or (meaning_of(_WORD_OF_CLASS[plain], "shape") if plain in _WORD_OF_CLASS else None)


def is_barrier(ifc_class: str, names: Sequence[str | None]) -> bool:
    """Return whether an element is a noise barrier."""
    return plain_class(ifc_class) in _BARRIER_CLASSES and _named(names, "barrier") is not None


def _named(names: Sequence[str | None], says: str) -> Meaning | None:
    found = (meaning_of(name, "shape") for name in names if name)
    return next((meaning for meaning in found if meaning is not None and meaning.says == says), None)


DEFAULT_DENSITY_KG_M3 = 2400.0
"""For parts of unknown material: plain concrete, which is on the safe side for most parts."""
STEEL_KG_M3 = 7850.0

_BY_KIND = {
    Kind.PRECAST: 2500.0,
    Kind.CONCRETE: 2500.0,
    Kind.MASONRY: 1800.0,
    Kind.TIMBER: 500.0,
    Kind.STEEL: STEEL_KG_M3,
    Kind.LIGHT: 300.0,
    Kind.GLAZING: 2500.0,
    Kind.EARTH: 1800.0,
}
"""Of parts whose kind is known, but not their material: of the usual member of the kind."""


_LIKE = {Kind.PRECAST: Kind.CONCRETE}


def of_same_mass(one: Kind | None, other: Kind) -> bool:
    """Return whether two kinds are made of the same materials."""
    return one is not None and _LIKE.get(one, one) is _LIKE.get(other, other)


def density_by_name(material: str) -> float | None:
    """Return the density that a material's name implies, kg/m3; None if it implies none."""
    meaning = meaning_of(material)
    return None if meaning is None else meaning.kg_m3


def density_of_kind(kind: Kind) -> float:
    """Return the density of a part of a kind whose material is not known, kg/m3."""
    return _BY_KIND.get(kind, DEFAULT_DENSITY_KG_M3)


_GROUND = "ground terrain topography topo soil subsoil earth landscape dtm dem gelaende gelände terrein maaiveld"
_EXISTING = "existing bestand bestaand existant existente esistente"
_STRUCTURE = """obstruction obstructions obstacle obstacles excavator digger crane truck lorry
    vehicle fence hoarding scaffold scaffolding neighbour neighbor stockpile"""

WORDS: dict[Role, frozenset[str]] = {
    Role.GROUND: frozenset(_GROUND.split()),
    Role.STRUCTURE: frozenset((_EXISTING + " " + _STRUCTURE).split()),
}
"""Words that give a role wherever they occur in a name."""

WHOLE_NAMES: dict[str, Role] = {"floor": Role.GROUND, "site": Role.GROUND}
"""Names that give a role only as the whole name: ``floor_2`` is a storey, ``floor`` is the ground."""

_WORD = re.compile(r"[A-ZÄÖÜ]+(?![a-zäöü])|[A-ZÄÖÜ]?[a-zäöüß]+")


def role_by_name(name: str) -> Role | None:
    """Return the role that a name implies; None if it implies none.

    The name is split at spaces, punctuation, digits and camel case: ``ExistingWall-3`` contains ``existing``.
    """
    words = _name_words(name)
    if len(words) == 1 and name.strip().lower() in WHOLE_NAMES:
        return WHOLE_NAMES[words[0]]
    return next((role for role, known in WORDS.items() if known.intersection(words)), None)


def is_existing_by_name(name: str) -> bool:
    """Return whether a name states that the element already exists: ``Existing Strip Footing``."""
    return not set(_EXISTING.split()).isdisjoint(_name_words(name))


def _name_words(name: str) -> list[str]:
    return [word.lower() for word in _WORD.findall(name)]
