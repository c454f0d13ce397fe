"""Where obstructions are: outside the site, or in coordinates that were recognised."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject
from bimvox.site.obstructions.coordinates import is_about_coordinates
from bimvox.site.site import Site

OUTSIDE = "outside"
COORDINATES = "coordinates"

_NAMED = re.compile(r"obstruction .* lies outside the site, which is (.*)", re.DOTALL)
_COUNTED = re.compile(r"more obstructions: .*?([\d,]+) outside the site")


def outside(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about obstructions outside the site, a serious one if none is inside, and how others were read."""
    notes = subject.site.obstruction_notes
    yield from (Remark(COORDINATES, Severity.NOTE, note) for note in notes if is_about_coordinates(note))
    if (said := none_inside(subject.site)) is not None:
        yield Remark(OUTSIDE, Severity.SERIOUS, said)
    elif count := _count(notes):
        lie, them = ("lies", "it") if count == 1 else ("lie", "them")
        said = f"{count:,} obstruction{'s' * (count > 1)} {lie} outside the site; nothing is planned around {them}"
        yield Remark(OUTSIDE, Severity.NOTE, said)


def none_inside(site: Site) -> str | None:
    """Return the serious remark about a site outside of which all its obstructions lie; None if that is not so."""
    notes = site.obstruction_notes
    count = _count(notes)
    if not count or any(blocker.kind == "obstruction" for blocker in site.blockers):
        return None
    whole, them = ("the only obstruction lies", "it") if count == 1 else (f"all {count:,} obstructions lie", "them")
    extent = next((f", which is {found[1]}" for note in notes if (found := _NAMED.fullmatch(note))), "")
    check = "check unit and coordinates of the file (bimvox inspect shows them)"
    return f"{whole} outside the site{extent}: nothing is planned around {them}; {check}"


def _count(notes: Sequence[str]) -> int:
    """Return how many obstructions lie outside the site by these notes."""
    counted = (int(found[1].replace(",", "")) for note in notes if (found := _COUNTED.match(note)))
    return sum(_NAMED.fullmatch(note) is not None for note in notes) + sum(counted)
