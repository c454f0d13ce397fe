"""A remark about a plan: what a person should look at, although every check passed."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """How much a remark matters, the gravest first."""

    SERIOUS = "serious"
    """Somebody could be hurt, or the plan cannot be carried out as it is: a person decides before it is."""
    MINOR = "minor"
    """Unusual, or below what the field asks for."""
    NOTE = "note"
    """What was assumed; a plan with notes only is clean."""


ASSUMED_KIND = "assumed_kind"
"""The remark that counts the parts whose kind is an assumption, and by what; the verdict repeats it."""


@dataclass(frozen=True, slots=True)
class Remark:
    """One remark.

    Attributes:
        kind: Short stable name of the rule that made it, for programs.
        severity: How much it matters.
        text: The remark, as a sentence.
        component: Id of the part that it is about; None if it is about the whole plan.
        name: The part's name for people; None if it is about the whole plan.
    """

    kind: str
    severity: Severity
    text: str
    component: str | None = None
    name: str | None = None

    def to_dict(self) -> dict[str, str | None]:
        """Return the remark as ``bimvox verify --json`` gives it."""
        return {
            "kind": self.kind,
            "severity": self.severity.value,
            "component": self.component,
            "name": self.name,
            "text": self.text,
        }


def are_clean(remarks: Iterable[Remark]) -> bool:
    """Return whether there are only notes: nothing that a person must decide about."""
    return all(remark.severity is Severity.NOTE for remark in remarks)


def counts_of(remarks: Iterable[Remark]) -> dict[str, int]:
    """Return the number of remarks of each severity."""
    found = [remark.severity for remark in remarks]
    return {severity.value: found.count(severity) for severity in Severity}


def in_words(remarks: Collection[Remark]) -> str:
    """Return the number of remarks as it is shown next to the verdict; see ``number_in_words``."""
    serious, minor, notes = (sum(remark.severity is one for remark in remarks) for one in Severity)
    return number_in_words(serious + minor, serious, notes)


def number_in_words(remarks: int, serious: int, notes: int = 0) -> str:
    """Return a number of remarks: ``7 remarks (2 serious)``; if there are notes only, ``3 notes``.

    Args:
        remarks: Serious and minor ones.
        serious: Serious ones.
        notes: Notes.
    """
    count, noun = (remarks, "remark") if remarks or not notes else (notes, "note")
    said = f"{count:,}" if count else "no"
    return f"{said} {noun}{'' if count == 1 else 's'}" + (f" ({serious:,} serious)" if serious else "")
