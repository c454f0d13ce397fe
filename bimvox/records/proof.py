"""The result of a verification, one result per check with its evidence; and remarks, what a person should look at."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from math import isfinite
from typing import Any, Literal

from bimvox.records.declared import Count, Maybe, Record

_KEPT_FAILURES = 20


@dataclass(slots=True)
class Check:
    """One check, which collects its results.

    Attributes:
        name: Name of the check.
        samples: Number of checked items.
        worst: The worst value, if the check measures something (in ``unit``).
        unit: Unit of ``worst``.
        failures: The first failures: what failed and where.
        failed: Number of failures.
        about: Id of the component that is being checked; None for the whole plan.
        culprits: Ids of the components with failures.
        undecided: Items that the check could not decide, and why: they have neither passed nor failed.
    """

    name: str
    samples: int = 0
    worst: float | None = None
    unit: str = ""
    failures: list[str] = field(default_factory=list)
    failed: int = 0
    about: str | None = None
    culprits: set[str] = field(default_factory=set)
    undecided: list[str] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        """Whether nothing failed. A check without samples passes."""
        return self.failed == 0

    def look(self, good: bool, failure: str, *, samples: int = 1) -> None:
        """Count a checked item, and record the sentence if it failed."""
        self.samples += samples
        if not good:
            self.failed += 1
            if self.about is not None:
                self.culprits.add(self.about)
            if len(self.failures) < _KEPT_FAILURES:
                self.failures.append(failure)

    def add(self, other: Check) -> None:
        """Add what another check of the same name found."""
        self.samples += other.samples
        self.failed += other.failed
        self.failures += other.failures[: _KEPT_FAILURES - len(self.failures)]
        self.culprits |= other.culprits
        self.undecided += [one for one in other.undecided if one not in self.undecided]
        if other.worst is not None:
            self.measure(other.worst)

    def measure(self, value: float) -> None:
        """Record a value; the largest one is kept."""
        self.worst = value if self.worst is None else max(self.worst, value)


CHECK = Record(
    "PageCheck",
    "A check of the proof.",
    ("name", str, "Its name."),
    ("passed", bool, "Whether it passed."),
    ("samples", Count, "How many values it looked at."),
    ("worst", Maybe(float), "The worst of them.",
     lambda check: None if check.worst is None or not isfinite(check.worst) else round(float(check.worst), 9)),
    ("unit", str, "Its unit."),
    ("failed", Count, "How many failed."),
    ("failures", tuple[str, ...], "What failed, in words.", lambda check: list(check.failures)),
)  # fmt: skip


def turn_to(checks: Iterable[Check], component_id: str | None) -> None:
    """Set the component that the checks are about from now on."""
    for check in checks:
        check.about = component_id


@dataclass(frozen=True, slots=True)
class Claim:
    """What a log states and a proof has taken from it without proving it.

    Attributes:
        name: Its short stable name.
        text: What is claimed, in one sentence.
        bind_with: The option of ``bimvox verify`` that proves it; None if none does.
        count: How many things it is about; None if it is about the whole plan.
    """

    name: str
    text: str
    bind_with: str | None
    count: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the claim as ``bimvox verify --json`` and the page give it."""
        return CLAIM.of(self)


CLAIM = Record(
    "PageClaim",
    "What the log states and the proof has taken as true.",
    ("name", str, "Its short stable name."),
    ("text", str, "What is claimed."),
    ("count", Maybe(int), "How many things it is about; without it, the whole plan.", None, None),
    ("bind_with", Maybe(str), "The option of `bimvox verify` that proves it; null: none."),
)


@dataclass(frozen=True, slots=True)
class Verification:
    """All checks of a plan.

    Attributes:
        checks: The checks.
        not_current: Ids of the parts that were set before the obstructions became the current ones: their lifts are
            proven against the obstructions at that time only.
        claims: What a log states and these checks did not prove; none of a plan that was made in the same call.
    """

    checks: tuple[Check, ...]
    not_current: tuple[str, ...] = ()
    claims: tuple[Claim, ...] = ()

    def __repr__(self) -> str:
        failed = ", ".join(check.name for check in self.checks if not check.passed)
        return f"<Verification: {f'failed: {failed}' if failed else f'all {len(self.checks)} checks passed'}>"

    @property
    def verified(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)

    @property
    def culprits(self) -> frozenset[str]:
        """Ids of the components for which a check failed."""
        return frozenset().union(*(check.culprits for check in self.checks))

    @property
    def failures(self) -> tuple[str, ...]:
        """Every recorded failure, prefixed with the check's name."""
        return tuple(f"{check.name}: {failure}" for check in self.checks for failure in check.failures)


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

    def to_dict(self) -> dict[str, Any]:
        """Return the remark as ``bimvox verify --json``, the log and the page give it."""
        return REMARK.of(self)


REMARK = Record(
    "PageRemark",
    "A remark.",
    ("kind", str, "Its rule."),
    ("severity", Literal["serious", "minor", "note"], "How much it matters.", "severity.value"),
    ("component", Maybe(str), "Id of its part; null: the whole plan."),
    ("name", Maybe(str), "Name of its part."),
    ("text", str, "The remark."),
)


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

    ``remarks``: serious and minor ones.
    """
    count, noun = (remarks, "remark") if remarks or not notes else (notes, "note")
    said = f"{count:,}" if count else "no"
    return f"{said} {noun}{'' if count == 1 else 's'}" + (f" ({serious:,} serious)" if serious else "")
