"""``bimvox render FOLDER``: the success curves of an experiment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bimvox.errors import InputError
from bimvox.files import check_output, write_atomically
from bimvox.progress import Progress


def render_experiment(folder: Path, out: Path | None, progress: Progress) -> dict[str, Any]:
    """Draw the success curves of a folder of ``bimvox experiment paper``; return what ``bimvox render --json`` prints.

    ``out`` is ``.png`` or ``.svg``; default: the folder's name with ``.png``, in the current folder.
    """
    from bimvox.paper.experiment.document import document_of
    from bimvox.paper.experiment.pictures import success_curves
    from bimvox_pipeline.paper.folder import load_results

    target = out or Path(f"{folder.resolve().name}.png")
    suffix = target.suffix.lower()
    if suffix not in (".png", ".svg"):
        raise InputError(f"{target}: curves are written as PNG or SVG", hint=f"-o {target.with_suffix('.png')}")
    check_output(target)
    progress.stage("read")
    try:
        modes = document_of(load_results(folder))["modes"]
    except KeyError as error:
        raise InputError(
            f"{folder}: its results are from another version of bimvox: {error} is missing in them",
            hint="bimvox experiment paper -o DIR runs it again in a new folder",
        ) from error
    progress.stage("draw")
    picture = success_curves(modes, "svg" if suffix == ".svg" else "png")
    progress.stage("write")
    write_atomically(target, picture)
    progress.finish()
    return {"out": str(target), "kind": "experiment", "bytes": len(picture), "seconds": progress.seconds}
