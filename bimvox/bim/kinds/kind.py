"""What a part is made of and who makes it: its kind, with the evidence for it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, get_args

from bimvox.errors import SelectionError


class Kind(StrEnum):
    """What a part is."""

    PRECAST = "precast"
    """Concrete that is stated to come ready-made."""
    CONCRETE = "concrete"
    """Concrete of which nothing says that it is precast."""
    MASONRY = "masonry"
    TIMBER = "timber"
    STEEL = "steel"
    LIGHT = "light"
    """Partitions, cladding, insulation, roof coverings, floor finishes: thin layers mounted by their trade."""
    GLAZING = "glazing"
    FORMWORK = "formwork"
    """And other temporary works: not part of the building."""
    PILE = "pile"
    """In the ground before the first lift."""
    EARTH = "earth"
    OTHER = "other"
    """Nothing says what it is."""


class Confidence(StrEnum):
    """How much the source says about a kind."""

    STATED = "stated"
    """By a property, a classification, or the site file."""
    NAMED = "named"
    """By the words of its materials, or its class."""
    ASSUMED = "assumed"
    """By the words of its name or type only, by its shape, or by nothing at all: a person should look."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """The kind of a part, and why.

    Attributes:
        kind: What it is.
        confidence: How much the source says about it.
        why: The evidence that decided, as a sentence without a full stop.
    """

    kind: Kind = Kind.OTHER
    confidence: Confidence = Confidence.ASSUMED
    why: str = "nothing says what it is made of"


UNKNOWN = Judgement()


Way = Literal["crane", "in_situ", "built", "by_hand", "out"]
"""How a part gets to its place; ``out``: it is not part of the plan."""
WAYS: tuple[Way, ...] = get_args(Way)
SITE_FILE_SAYS = "the site file says so"
OUT: Way = "out"


@dataclass(frozen=True, slots=True)
class Correction:
    """What parts are, or how they get to their places.

    Attributes:
        select: What selects them: an IfcOpenShell query, names of bodies, or the id of one part.
        kind: What they are; None: as the evidence says.
        means: How they get to their places; None: as kind, size and mass say.
        where: Its place in a file, for messages.
        one_part: Whether ``select`` is the id of one part.
        mass_kg: What each of them weighs; None: as the source says.
    """

    select: str
    kind: Kind | None
    means: Way | None
    where: str
    one_part: bool = False
    mass_kg: float | None = None


@dataclass(frozen=True, slots=True)
class Corrected:
    """What the corrections that select a part say of it.

    Attributes:
        kind: What it is, if they say that.
        means: How it gets to its place, if they say that.
        by_type: The same, of corrections of types only.
        mass_kg: What it weighs, if they say that.
    """

    kind: Kind | None = None
    means: Way | None = None
    by_type: Way | None = None
    mass_kg: float | None = None

    @property
    def judgement(self) -> Judgement | None:
        """The judgement that takes the place of the evidence; None if that decides."""
        return None if self.kind is None else Judgement(self.kind, Confidence.STATED, SITE_FILE_SAYS)


UNTOUCHED = Corrected()


def all_of(corrections: Iterable[Correction]) -> Corrected:
    """Return what corrections say together: the last one that says something counts, one part before its type."""
    ordered = sorted(corrections, key=lambda one: one.one_part)
    kinds = [one.kind for one in ordered if one.kind is not None]
    ways = [one.means for one in ordered if one.means is not None]
    by_type = [one.means for one in ordered if one.means is not None and not one.one_part]
    masses_kg = [one.mass_kg for one in ordered if one.mass_kg is not None]
    if not (kinds or ways or masses_kg):
        return UNTOUCHED
    last = ((found[-1] if found else None) for found in (kinds, ways, by_type, masses_kg))
    return Corrected(*last)  # type: ignore[arg-type]


def unmatched(corrections: Sequence[Correction], is_matched: Callable[[Correction], bool]) -> list[str]:
    """Return a note about each correction that selects nothing."""
    lost = [one for one in corrections if not is_matched(one)]
    return [f"{one.where}: {one.select} selects no part of the model, so it changes nothing" for one in lost]


def refused(correction: Correction, error: SelectionError) -> SelectionError:
    """Return the error about a correction whose selection cannot be read."""
    return SelectionError(f"{correction.where}: {error.message}", hint=error.hint)
