"""Parts that are drawn deeper into each other than a tolerance can explain."""

from __future__ import annotations

from collections.abc import Iterator

from bimvox.bim.building import plain_class
from bimvox.bim.kinds.kind import Kind
from bimvox.bim.kinds.words import meaning_of
from bimvox.records.lift import ModelledClash
from bimvox.records.proof import Remark, Severity
from bimvox.remarks.subject import Subject, about
from bimvox.site.means import Means
from bimvox.site.part_names import names_by_id
from bimvox.site.site import Blocker

OVERLAP = "overlap"
SMALL_OVERLAPS = "small_overlaps"

DEEP_M = 0.05
"""More than all tolerances of making, setting out and erecting precast parts together: EN 13670 and EN 13369 allow 10
to 25 mm each."""
_FOUNDATIONS = ("IfcFooting", "IfcPile", "IfcDeepFoundation", "IfcCaissonFoundation")
_SOFT = (Kind.TIMBER, Kind.LIGHT, Kind.MASONRY)
"""Kinds that are cut to fit on site."""


def overlaps(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part of a pair that overlaps deeper than 50 mm, or by an unknown depth.

    It is serious if both come ready-made and are hard: they cannot be set as drawn. What is cut, cast or built on site
    gives way there: a rafter gets a notch, a slab is cast around a wall, a column stands in the pocket of its footing.
    The depths are those that the plan lists, which the proof measures itself: a pair may overlap no deeper than listed,
    and just short of the listed depth it still collides. Overlaps without a way out are at least as deep as listed.
    """
    names = names_by_id(subject.site)
    hard = {one.id: one.means is Means.CRANE and one.judgement.kind not in _SOFT for one in subject.site.components}
    hard |= {one.id: False for one in subject.site.blockers if one.kind == "structure" and _is_foundation(one)}
    deep = [clash for clash in subject.plan.clashes if clash.depth_m > DEEP_M or clash.at_least]
    pairs: dict[str, list[tuple[ModelledClash, str]]] = {}
    for clash in deep:
        pairs.setdefault(clash.first, []).append((clash, clash.second))
        pairs.setdefault(clash.second, []).append((clash, clash.first))
    for component in subject.lifted:
        found = pairs.get(component.id)
        if not found:
            continue
        ready = {other for _, other in found if hard.get(component.id, True) and hard.get(other, True)}
        found.sort(key=lambda pair: (pair[1] not in ready, -pair[0].depth_m, pair[1]))
        clash, other = found[0]
        least = "at least " if clash.at_least else ""
        more = f", and {len(found) - 1:,} more" if len(found) > 1 else ""
        said = f"is drawn {least}{clash.depth_m * 1000.0:.0f} mm into {names.get(other, other)}{more}"
        if ready:
            yield about(component, OVERLAP, Severity.SERIOUS, said)
        else:
            yield about(component, OVERLAP, Severity.MINOR, f"{said}; one of them is cut, cast or built on site")
    small = [clash.depth_m for clash in subject.plan.clashes if clash not in deep]
    if small:
        said = f"parts overlap in the model by up to {max(small) * 1000.0:.0f} mm, and may do so when they are set"
        yield Remark(SMALL_OVERLAPS, Severity.NOTE, f"{said}: {len(small):,} pair{'' if len(small) == 1 else 's'}")


def _is_foundation(structure: Blocker) -> bool:
    """Return whether a structure is a footing or a pile, which are cast on site: by its class or its name."""
    meaning = meaning_of(structure.name, "part")
    is_called = meaning is not None and meaning.says in ("footing", Kind.PILE)
    return is_called or plain_class(structure.ifc_class) in _FOUNDATIONS
