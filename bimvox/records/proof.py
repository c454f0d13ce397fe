"""What a verification says: one result a check, with its evidence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

_KEPT_FAILURES = 20


@dataclass(slots=True)
class Check:
    """One check, as it fills up.

    Attributes:
        name: What was checked.
        samples: How many things were looked at.
        worst: The worst value met, where the check measures something (its unit is in ``unit``).
        unit: Unit of ``worst``.
        failures: What failed, where; the first few.
        failed: How many things failed.
        about: Id of the component that is looked at now; None for what concerns the whole plan.
        culprits: Ids of the components that something failed about.
    """

    name: str
    samples: int = 0
    worst: float | None = None
    unit: str = ""
    failures: list[str] = field(default_factory=list)
    failed: int = 0
    about: str | None = None
    culprits: set[str] = field(default_factory=set)

    @property
    def passed(self) -> bool:
        """Whether nothing failed. A check that looked at nothing has nothing to say and passes."""
        return self.failed == 0

    def look(self, good: bool, failure: str, *, samples: int = 1) -> None:
        """Count something looked at, and keep the sentence where it is not good."""
        self.samples += samples
        if not good:
            self.failed += 1
            if self.about is not None:
                self.culprits.add(self.about)
            if len(self.failures) < _KEPT_FAILURES:
                self.failures.append(failure)

    def measure(self, value: float) -> None:
        """Keep the largest value met."""
        self.worst = value if self.worst is None else max(self.worst, value)


def turn_to(checks: Iterable[Check], component_id: str | None) -> None:
    """Say which component the checks look at from now on."""
    for check in checks:
        check.about = component_id


@dataclass(frozen=True, slots=True)
class Verification:
    """All checks of a plan."""

    checks: tuple[Check, ...]

    @property
    def verified(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)

    @property
    def culprits(self) -> frozenset[str]:
        """Ids of the components that a check failed about."""
        return frozenset().union(*(check.culprits for check in self.checks))

    @property
    def failures(self) -> tuple[str, ...]:
        """Every kept failure, the check's name in front."""
        return tuple(f"{check.name}: {failure}" for check in self.checks for failure in check.failures)
