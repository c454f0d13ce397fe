"""Compares the site of a log with the files of the user: site file, model, obstructions."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

from bimvox.errors import InputError
from bimvox.files import require_input
from bimvox.library.attached_files import rules_for
from bimvox.library.compare import equal, same, same_blockers, same_cranes, same_fields, same_rules
from bimvox.library.obstructions import load_obstructions, obstructed
from bimvox.library.site import load_site
from bimvox.progress import Progress
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.site import Site

_YOURS = "your files"
_OF_THE_SITE = ("shape", "yard", "prohibited", "no_load", "site_to_ifc")


def check_user_files(
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
    loaded = load_site(site, progress, model=model)
    held = loaded.site
    same_rules(check, found.rules, rules_for(found, loaded.config), _YOURS)
    same_cranes(check, found.cranes, held.cranes, _YOURS)
    same(check, "the frame of the grid", found.frame, held.frame, _YOURS)
    for name in _OF_THE_SITE:
        check.look(equal(getattr(found, name), getattr(held, name)), f"{name} is not that of your files")
    same(check, "the model's sha256", found.source.get("sha256"), held.source.get("sha256"), _YOURS)
    # Logs made before crew times by class do not have predefined types.
    but = ("index", "shape", "mesh") if found.rules.times else ("index", "shape", "mesh", "predefined_type")
    _compare_parts(check, found.components, held.components, but)
    _compare_blockers(check, found, held, ("ground", "crane", "structure"))
    return check


def _compare_parts(check: Check, found: Sequence[Component], held: Sequence[Component], but: Collection[str]) -> None:
    theirs, ours = ({part.id: part for part in parts} for parts in (found, held))
    for name in sorted(ours.keys() - theirs.keys()):
        check.look(False, f"{ours[name].label}: this part of your model is not in the log")
    for name, part in theirs.items():
        if (own := ours.get(name)) is None:
            check.look(False, f"{part.label}: this part is not in your model")
            continue
        same_fields(check, f"{part.label}: ", part, own, _YOURS, but=but)
        check.look(equal(part.shape.cells, own.shape.cells), f"{part.label}: its cells are not those of your model")
        same_surface = equal(part.mesh.vertices_m, own.mesh.vertices_m) and equal(part.mesh.faces, own.mesh.faces)
        check.look(same_surface, f"{part.label}: its surface is not that of your model")


def _compare_blockers(check: Check, found: Site, held: Site, kinds: tuple[str, ...]) -> None:
    theirs, ours = ([blocker for blocker in site.blockers if blocker.kind in kinds] for site in (found, held))
    same_blockers(check, theirs, ours, _YOURS)
