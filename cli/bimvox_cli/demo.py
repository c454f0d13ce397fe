"""``bimvox demo``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from bimvox_cli.failure import DONE, INTERRUPTED
from bimvox_cli.options import Json, Quiet, Verbose, to_file

_END = """
The lift log:   {log}   (opens in Foxglove, Lichtblick or Rerun)
The picture:    {picture}
The site file:  {site}   (init --full writes every setting; its drawing: {drawing})
With your own model (IFC, STL, OBJ, PLY, GLB ...): bimvox init MODEL, then bimvox plan MODEL.site.toml

Open the plan in a browser; it needs no network:
  {page}
  {address}"""


def demo(
    out: Annotated[Path, to_file("FOLDER", "Folder of all files; made if it does not exist.")] = Path("demo-output"),
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Do the main job on a sample: voxelize, plan, verify, render.

    Every step is a command that you can repeat; it is printed before it runs, and -v prints what each one says, not
    only the plan. The last lines are the page to open. With --json, prints what `bimvox plan` prints.
    """
    from bimvox_pipeline.demo import copy_sample, steps

    from bimvox_cli.main import app

    for variable in ("BIMVOX_JSON", "BIMVOX_QUIET", "BIMVOX_VERBOSE"):
        os.environ.pop(variable, None)  # the steps are told as options
    model = copy_sample(out)
    code = DONE
    for step in steps(model):
        is_plan = step[0] == "plan"
        told = ["-q"] if json or quiet or not (is_plan or verbose) else ["-v"] if verbose else []
        if json and is_plan:
            told.append("--json")
        if not (json or quiet):
            print("\n$ bimvox" if is_plan or verbose else "$ bimvox", *step, flush=True)
        code = max(code, app([*step, *told], prog_name="bimvox", standalone_mode=False) or DONE)
        if code == INTERRUPTED:  # typer makes a code of Ctrl-C
            raise KeyboardInterrupt
    if not (json or quiet):
        made = {"log": ".mcap", "picture": ".png", "site": ".site.toml", "drawing": ".site.svg", "page": ".html"}
        files = {name: model.with_suffix(suffix) for name, suffix in made.items()}
        print(_END.format(**files, address=files["page"].resolve().as_uri()))
    raise typer.Exit(code)
