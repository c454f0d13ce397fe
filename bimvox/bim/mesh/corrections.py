"""Which corrections of the site file select a body of a mesh file, and the body with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from bimvox.bim.building import Element, Role
from bimvox.bim.densities import density_of_kind
from bimvox.bim.kinds.correction import OUT, Corrected, Correction, all_of, refused, unmatched
from bimvox.bim.kinds.evidence import casting_of
from bimvox.bim.mesh.select import chosen_names
from bimvox.errors import NothingSelectedError, SelectionError


def corrections_of(
    file: str, names: Sequence[str], corrections: Sequence[Correction]
) -> tuple[Mapping[str, Corrected], list[str]]:
    """Return what the corrections say of each body, by name, and a note about each that selects none.

    Raises:
        SelectionError: If a selection names nothing at all.
    """
    found: dict[str, list[Correction]] = {}
    matched: set[Correction] = set()
    for one in corrections:
        try:
            chosen = {one.select} & set(names) if one.one_part else chosen_names(file, names, one.select)
        except NothingSelectedError:
            chosen = set()
        except SelectionError as error:
            raise refused(one, error) from None
        for name in chosen:
            found.setdefault(name, []).append(one)
            matched.add(one)
    lost = unmatched([one for one in corrections if not one.one_part], matched.__contains__)
    return {name: all_of(own) for name, own in found.items()}, lost


def with_correction(element: Element, volume_m3: float, corrected: Corrected) -> Element:
    """Return a body with what the site file says of it; its mass follows from its kind."""
    if corrected.judgement is not None:
        kind = corrected.judgement.kind
        kg, casting = volume_m3 * density_of_kind(kind), casting_of(kind, None)
        element = replace(element, judgement=corrected.judgement, mass_kg=kg, casting=casting)
    if corrected.means is not None:
        role = Role.FITTING if corrected.means == OUT else Role.COMPONENT
        element = replace(element, role=role, stated_means=corrected.by_type)
    return element
