"""What of a plan has been carried out, and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime


@dataclass(frozen=True, slots=True)
class DoneWork:
    """Lifts and other work that have been begun or ended.

    Attributes:
        begun: When each began, local time, by order.
        ended: When each ended, of those that have.
    """

    begun: Mapping[int, datetime]
    ended: Mapping[int, datetime]

    @property
    def until(self) -> datetime:
        """The last time that is stated: nothing else begins before it."""
        return max([*self.begun.values(), *self.ended.values()])
