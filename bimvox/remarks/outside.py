"""Where obstructions are: outside the site, or in coordinates that were recognised."""

from __future__ import annotations

import re
from collections.abc import Iterator

from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject
from bimvox.site.obstructions.coordinates import is_about_coordinates

OUTSIDE = "outside"
COORDINATES = "coordinates"

_NAMED = re.compile(r"obstruction .* lies outside the site, which is (.*)", re.DOTALL)
_COUNTED = re.compile(r"more obstructions: .*?([\d,]+) outside the site")


def outside(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about obstructions outside the site, a serious one if none is inside, and how others were read."""
    notes = subject.site.obstruction_notes
    yield from (Remark(COORDINATES, Severity.NOTE, note) for note in notes if is_about_coordinates(note))
    named = [found for note in notes if (found := _NAMED.fullmatch(note))]
    counted = (int(found[1].replace(",", "")) for note in notes if (found := _COUNTED.match(note)))
    count = len(named) + sum(counted)
    if not count:
        return
    lie, them = ("lies", "it") if count == 1 else ("lie", "them")
    if any(blocker.kind == "obstruction" for blocker in subject.site.blockers):
        said = f"{count:,} obstruction{'s' * (count > 1)} {lie} outside the site; nothing is planned around {them}"
        yield Remark(OUTSIDE, Severity.NOTE, said)
        return
    whole = "the only obstruction lies" if count == 1 else f"all {count:,} obstructions lie"
    extent = f", which is {named[0][1]}" if named else ""
    check = "check unit and coordinates of the file (bimvox inspect shows them)"
    yield Remark(
        OUTSIDE, Severity.SERIOUS, f"{whole} outside the site{extent}: nothing is planned around {them}; {check}"
    )
