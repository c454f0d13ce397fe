"""What a site file changes in a machine."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Override:
    """One value of a crane that is not the machine's.

    Attributes:
        key: Key of the site file: ``chart``.
        name: The same in words: ``hook block``.
        catalogue: The machine's value, with its unit.
        site: The site's value, with its unit.
        change: Difference in percent: ``+12 %``; empty if there is none to give.
    """

    key: str
    name: str
    catalogue: str
    site: str
    change: str = ""

    def __str__(self) -> str:
        return f"{self.name} {self.site} instead of {self.catalogue}" + (f" ({self.change})" if self.change else "")

    def to_dict(self) -> dict[str, str]:
        """Return it for JSON documents."""
        return {"key": self.key, "catalogue": self.catalogue, "site": self.site}
