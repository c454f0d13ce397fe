"""Select the bodies of a mesh file that are lifted, by their names."""

from __future__ import annotations

import difflib
import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import replace

from bimvox.bim.building import Element, Role
from bimvox.bim.kinds.evidence import casting_of
from bimvox.bim.kinds.kind import OUT, Corrected, Correction, all_of, refused, unmatched
from bimvox.bim.kinds.words import density_of_kind, role_by_name
from bimvox.errors import NothingSelectedError, SelectionError, cut, listed, shown


def roles_of(file: str, names: Sequence[str], select: str | None) -> Mapping[str, Role]:
    """Return the role of every name.

    Without a selection, every body is a component unless its name implies terrain or an obstacle (``name_roles``).
    With a selection, the names that it matches are components, and the others are structure or ground.

    Args:
        file: Name of the file, for messages.
        names: Of its bodies.
        select: One name, or names and patterns (``*``, ``?``) separated by commas.

    Raises:
        SelectionError: If a name or pattern matches nothing; it lists the nearest names.
    """
    by_name = {name: role_by_name(name) for name in names}
    if select is None:
        return {name: role or Role.COMPONENT for name, role in by_name.items()}
    chosen = _chosen_names(file, names, select)
    rest = {name: Role.GROUND if role is Role.GROUND else Role.STRUCTURE for name, role in by_name.items()}
    return {name: Role.COMPONENT if name in chosen else rest[name] for name in names}


def _chosen_names(file: str, names: Sequence[str], select: str) -> set[str]:
    """Return the names that a selection matches; the arguments and errors are those of :func:`roles_of`."""
    if select in names:  # a name may contain a comma
        return {select}
    patterns = [pattern.strip() for pattern in select.split(",") if pattern.strip()]
    chosen: set[str] = set()
    for pattern in patterns:
        # As a name first: many exporters put brackets into names, which a pattern reads as a set of letters.
        matching = [pattern] if pattern in names else fnmatch.filter(names, pattern)
        if not matching:
            raise NothingSelectedError(
                f"select {shown(select)}: no body of {file} is named {shown(pattern)}",
                hint=f"{_nearest(pattern, names)}the file has {listed(names, 8)}; * and ? are wildcards",
            )
        chosen.update(matching)
    if not chosen:
        raise SelectionError(f"select {shown(select)}: names nothing", hint=f"the file has {listed(names, 8)}")
    return chosen


def _nearest(pattern: str, names: Sequence[str]) -> str:
    """Return a question with the names most similar to a pattern, case-insensitive; empty if there are none."""
    by_lower = {name.lower(): name for name in names}
    other_case = fnmatch.filter(list(by_lower), pattern.lower())
    close = other_case or difflib.get_close_matches(pattern.lower().strip("*?"), list(by_lower), n=3)
    return f"did you mean {' or '.join(cut(by_lower[name]) for name in close[:3])}? " if close else ""


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
            chosen = {one.select} & set(names) if one.one_part else _chosen_names(file, names, one.select)
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
