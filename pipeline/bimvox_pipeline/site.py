"""``bimvox init``: writes a site file with guesses for every value that can be guessed, and draws it."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any, cast

from bimvox.bim.options import ReadOptions
from bimvox.errors import FileError, SelectionError, listed
from bimvox.files import check_output, default_output, read_beside, require_input, seen_from, write_together
from bimvox.library.site import say_notes
from bimvox.progress import Progress
from bimvox_pipeline.cranes import choice_notes, smaller_machines, unserved_document


def init(  # noqa: PLR0913  (the options of a command)
    model: Path,
    out: Path | None = None,
    *,
    options: ReadOptions | None = None,
    voxel_size_m: float | None = None,
    crane: str | None = None,
    kind_file: Path | None = None,
    start: date | None = None,
    full: bool = False,
    force: bool = False,
    progress: Progress,
) -> dict[str, Any]:
    """Write a commented site file for a model, and next to it a drawing of the site.

    Args:
        model: IFC or mesh file.
        out: Site file; default: the model's name with ``.site.toml``, in the current folder. The drawing has its name
            with ``.svg``.
        options: How to read the model.
        voxel_size_m: Cell size for planning; default: guessed.
        crane: A kind of crane, a machine of the catalogue, the file of a machine next to the site file, or
            ``fictitious``; default: a hammerhead.
        kind_file: A corrected CSV file of types, next to the site file, that says what parts are.
        start: First day of work; default: that of the model's schedule, otherwise the first Monday after the model was
            written, if it says when.
        full: Write every key with its default, instead of only what differs.
        force: Replace an existing site file, which may contain the planner's edits.
        progress: Receives the stages.

    Returns:
        The document of ``bimvox init --json``.

    Raises:
        FileError: If the site file or its drawing exists and ``force`` is not given.
        InputError: If the catalogue has no such crane.
    """
    from bimvox.bim.building import Role
    from bimvox.bim.read import read_building
    from bimvox.rendering.report.drawing_file import drawing_file
    from bimvox.rendering.report.site_drawing import drawing_of_site
    from bimvox.site.catalogue import machines_called
    from bimvox.site.config.calendar import CalendarConfig
    from bimvox.site.config.kind_file import corrections_in
    from bimvox.site.config.site_config import ModelConfig, SiteConfig
    from bimvox.site.config.template import precast_line, site_toml
    from bimvox.site.guess import USUAL_TM, cranes_that_fit, ground_why, guess_site
    from bimvox.site.kind_rows import kind_rows
    from bimvox.site.means import Means
    from bimvox.site.start_guess import start_of

    target = out or default_output(model, ".site.toml")
    machines = () if crane is None else machines_called(crane, target)
    require_input(model)
    drawn = target.with_suffix(".svg") if target.suffix == ".toml" else target.with_name(target.name + ".svg")
    for path, why in ((target, "exists already and may hold edits"), (drawn, "exists already")):
        check_output(path, inputs=[model])
        if path.exists() and not force:
            raise FileError(path, why, hint="--force replaces it, -o names another site file")
    options = options or ReadOptions()
    if kind_file is not None:
        options = replace(options, corrections=corrections_in(read_beside(kind_file, target), kind_file))
    building = read_building(model, options, progress.report)
    say_notes(building, progress)
    progress.stage("guess")
    said = ModelConfig(
        path=seen_from(target.resolve().parent, model.resolve()),
        select=options.select,
        unit=cast("Any", options.unit),
        up=options.up,
        assemblies=options.assemblies,
        voxel_size_m=voxel_size_m,
        kinds=() if kind_file is None else (kind_file.name,),
    )
    try:
        config = guess_site(building, said, name=model.stem, machines=machines)
    except SelectionError as error:
        line = precast_line(said, kind_rows(SiteConfig(model=said), building))
        if not line:
            raise
        how = f"if they are precast, save this line as {target} and run bimvox plan {target}: {line}"
        raise SelectionError(error.message, hint=f"{how}; otherwise {error.hint}") from error
    kinds = kind_rows(config, building)
    progress.stage("cranes")
    own, fits = cranes_that_fit(config, building)
    assert own is not None
    smaller = smaller_machines(own, fits)
    notes = choice_notes(own, smaller, config.costs.currency)
    shown = {own.machine, *(fit.machine for fit in smaller)}
    examples = [element.id for element in building.elements if element.role is Role.COMPONENT][:2]
    why = ground_why(config, building)
    begins, start_why = start_of(building) if start is None else (start, "as asked for")
    config = config.model_copy(update={"calendar": CalendarConfig(start=begins)})
    toml = site_toml(
        config,
        example_ids=examples,
        crane_notes=notes,
        kinds=kinds,
        ground_why=why,
        start_why="" if start is not None else start_why,
        short=not full,
    ).encode()
    progress.stage("draw")
    name = config.name or model.stem
    write_together({target: toml, drawn: drawing_file(drawing_of_site(config, building), name)}, inputs=[model])
    progress.finish()
    roles = [element.role for element in building.elements]
    in_situ = {entry.global_id for entry in config.component if entry.means == Means.IN_SITU.value}
    if in_situ:
        names = listed([element.label for element in building.elements if element.id in in_situ])
        progress.note(
            f"{len(in_situ)} of {roles.count(Role.COMPONENT)} components are cast in place, not lifted: concrete that "
            f"is not said to be precast, and that no usual crane (up to {USUAL_TM:g} tm) lifts, see [[component]]: "
            f"{names}"
        )
    return {
        "site": str(target),
        "drawing": str(drawn),
        "model": str(model),
        "voxel_size_m": config.model.voxel_size_m,
        "ground_m": config.model.ground_m,
        "ground_why": why,
        "components": roles.count(Role.COMPONENT),
        "structure": roles.count(Role.STRUCTURE),
        "start": None if begins is None else begins.isoformat(),
        "start_why": start_why,
        "crane": own.machine,
        "other_cranes": [fit.machine for fit in fits if fit.serves and fit.machine not in shown],
        "smaller_cranes": [{"machine": fit.machine, "reason": fit.reason} for fit in smaller],
        "cannot_lift": unserved_document(own),
        "kinds": [row.to_dict() for row in kinds],
        "notes": list(building.notes),
        "seconds": progress.seconds,
    }
