"""Compares the site of a log with the files that one holds: site file, model, obstructions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from bimvox.errors import InputError
from bimvox.files import require_input
from bimvox.library.obstructions import load_obstructions, obstructed
from bimvox.library.site import load_site
from bimvox.progress import Progress
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.site import Blocker, Site

_OF_THE_SITE = ("shape", "yard", "prohibited", "no_load", "site_to_ifc")


def check_bound(
    found: Site, site: Path | None, model: Path | None, obstructions: Path | None, progress: Progress
) -> Check:
    """Check that the site of a log is that of the given files: parts, shapes, masses, frame, rules, cranes.

    Args:
        found: The site of the log.
        site: The site file; its model is read too. None: only the obstructions are compared.
        model: The model, if it is not where the site file says.
        obstructions: The obstruction file; None: obstructions are not compared.
        progress: Receives the stages.

    Raises:
        InputError: If a model is given without a site file.
        FileError: If a file is missing or cannot be used.
    """
    check = Check("bound")
    if model is not None and site is None:
        raise InputError("--model needs --site", hint="the site file says how the model is read")
    if obstructions is not None:
        wanted = obstructed(found, load_obstructions(require_input(obstructions), found), progress)
        _compare_blockers(check, found, wanted, ("obstruction",))
    if site is None:
        return check
    held = load_site(site, progress, model=model).site
    for key in fields(held.rules):
        _same(check, f"rules.{key.name}", getattr(found.rules, key.name), getattr(held.rules, key.name))
    _same(check, "cranes", [crane.name for crane in found.cranes], [crane.name for crane in held.cranes])
    for crane, other in zip(found.cranes, held.cranes, strict=False):
        for key in fields(crane):
            _same(check, f"crane {crane.name!r}: {key.name}", getattr(crane, key.name), getattr(other, key.name))
    _same(check, "the frame of the grid", found.frame, held.frame)
    for name in _OF_THE_SITE:
        check.look(_equal(getattr(found, name), getattr(held, name)), f"{name} is not that of your files")
    _same(check, "the model's sha256", found.source.get("sha256"), held.source.get("sha256"))
    _compare_parts(check, found.components, held.components)
    _compare_blockers(check, found, held, ("ground", "crane", "structure"))
    return check


def _compare_parts(check: Check, found: Sequence[Component], held: Sequence[Component]) -> None:
    theirs, ours = ({part.id: part for part in parts} for parts in (found, held))
    for name in sorted(ours.keys() - theirs.keys()):
        check.look(False, f"{ours[name].label}: this part of your model is not in the log")
    for name, part in theirs.items():
        if (own := ours.get(name)) is None:
            check.look(False, f"{part.label}: this part is not in your model")
            continue
        for key in fields(part):
            if key.name not in ("index", "shape", "mesh"):
                _same(check, f"{part.label}: {key.name}", getattr(part, key.name), getattr(own, key.name))
        check.look(_equal(part.shape.cells, own.shape.cells), f"{part.label}: its cells are not those of your model")
        same = _equal(part.mesh.vertices_m, own.mesh.vertices_m) and _equal(part.mesh.faces, own.mesh.faces)
        check.look(same, f"{part.label}: its surface is not that of your model")


def _compare_blockers(check: Check, found: Site, held: Site, kinds: tuple[str, ...]) -> None:
    theirs, ours = ({b.id: b for b in site.blockers if b.kind in kinds} for site in (found, held))
    for name in sorted(theirs.keys() | ours.keys()):
        what = f"fixed object {name!r}"
        if name not in theirs or name not in ours:
            check.look(False, f"{what} is {'not in the log' if name in ours else 'in the log only'}")
        else:
            check.look(_same_blocker(theirs[name], ours[name]), f"{what}: its cells are not those of your files")


def _same_blocker(one: Blocker, other: Blocker) -> bool:
    return one.kind == other.kind and _equal(np.unique(one.cells, axis=0), np.unique(other.cells, axis=0))


def _same(check: Check, name: str, found: Any, held: Any) -> None:
    text = [value if len(value) <= 100 else f"{value[:97]}..." for value in (str(found), str(held))]
    check.look(found == held, f"{name} is {text[0]} in the log, {text[1]} by your files")


def _equal(one: Any, other: Any) -> bool:
    return (one is None) == (other is None) and (one is None or np.array_equal(one, other))
