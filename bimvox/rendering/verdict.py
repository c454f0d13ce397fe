"""The verdict as page and report show it: what is proven, and the remarks next to it.

Proven and plausible are two things. Green needs both; nothing is said by a colour alone.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import asdict, dataclass
from enum import StrEnum

from bimvox.records.lift import Lift
from bimvox.records.proof import Remark, Severity, Verification, are_clean, in_words
from bimvox.records.steps import by_other_means, proven_in_words
from bimvox.rendering.words import counted


class Light(StrEnum):
    """The colour of a verdict; also the name of its style."""

    CLEAN = "clean"
    """Green: proven without reservation, and no remark but notes."""
    REMARKED = "remarked"
    """Amber: proven, with minor remarks or with a reservation."""
    SERIOUS = "serious"
    """Strong amber: proven, but a person must decide about a remark first."""
    REFUSED = "refused"
    """Red: not proven."""
    PLAIN = "plain"
    """No colour: no remark, next to a plan that is not proven."""


_SIGNS = {Light.CLEAN: "✓ ", Light.REMARKED: "! ", Light.SERIOUS: "⚠\ufe0e ", Light.REFUSED: "✕ ", Light.PLAIN: ""}


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict in words.

    Attributes:
        proof: Whether it is proven, or which check failed.
        proof_light: The colour of ``proof``.
        remarks: How many remarks there are, and how many of them are serious.
        remarks_light: The colour of ``remarks``.
    """

    proof: str
    proof_light: Light
    remarks: str
    remarks_light: Light

    @property
    def line(self) -> str:
        """Both as one line of text."""
        return f"{self.proof}; {self.remarks}"

    def to_dict(self) -> dict[str, str]:
        """Return the verdict as plain values."""
        return {key: str(value) for key, value in asdict(self).items()}


def verdict_of(
    proof: Verification | None, remarks: Collection[Remark], *, carried: int, lifts: Collection[Lift]
) -> Verdict:
    """Return the verdict about a plan.

    Args:
        proof: The proof; None if none was made.
        remarks: The remarks.
        carried: Number of lifts that the log carries.
        lifts: All lifts of the plan.
    """
    verified = proof is not None and proof.verified
    found = _light_of(remarks)
    remarks_light = found if found in (Light.REMARKED, Light.SERIOUS) or verified else Light.PLAIN
    said = in_words(remarks)
    sign = "" if found is Light.CLEAN else _SIGNS[remarks_light]
    if proof is None or not verified:
        return Verdict(f"{_SIGNS[Light.REFUSED]}{_refusal(proof)}", Light.REFUSED, sign + said, remarks_light)
    others = len(by_other_means(lifts))
    light = Light.REMARKED if found is Light.CLEAN and (proof.not_current or others) else found
    words = proven_in_words(others, len(proof.claims))
    if carried < len(lifts):
        words += f" ({carried:,} of {counted(len(lifts), 'lift')})"
    if proof.not_current:
        words += f", {counted(len(proof.not_current), 'lift')} against earlier obstructions only"
    tick = _SIGNS[light] if light is Light.CLEAN else ""
    return Verdict(tick + words, light, sign + said, remarks_light)


def _light_of(remarks: Collection[Remark]) -> Light:
    if any(remark.severity is Severity.SERIOUS for remark in remarks):
        return Light.SERIOUS
    return Light.CLEAN if are_clean(remarks) else Light.REMARKED


def _refusal(proof: Verification | None) -> str:
    if proof is None:
        return "NOT PROVEN: no proof was made"
    first, *others = (check.name.replace("_", " ") for check in proof.checks if not check.passed)
    more = f" and {counted(len(others), 'more check')}" if others else ""
    return f"NOT PROVEN: {first}{more}"
