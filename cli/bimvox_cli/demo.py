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
The site file:  {site}   (every setting is explained in it)
Its drawing:    {drawing}   (crane, radii and yard to scale)

Try next, with your own model (IFC, STL, OBJ, PLY, GLB ...):
  bimvox inspect MODEL
  bimvox init MODEL
  bimvox plan MODEL.site.toml
or with these files:
  bimvox render {log} -o {page}
  bimvox export {log} --to csv -o {table}"""


def demo(
    out: Annotated[Path, to_file("FOLDER", "Folder of all files; made if it does not exist.")] = Path("demo-output"),
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Do the main job on a sample: voxelize, plan, verify, render.

    Every step is a command that you can repeat; it is printed before it runs. With --json, prints what `bimvox plan`
    prints.
    """
    from bimvox_pipeline.demo import copy_sample, steps

    from bimvox_cli.main import app

    for variable in ("BIMVOX_JSON", "BIMVOX_QUIET", "BIMVOX_VERBOSE"):
        os.environ.pop(variable, None)  # the steps are told as options
    model = copy_sample(out)
    code = DONE
    for step in steps(model):
        told = ["-q"] if json or quiet else ["-v"] if verbose else []
        if json and step[0] == "plan":
            told.append("--json")
        if not (json or quiet):
            print("\n$ bimvox", *step, flush=True)
        code = max(code, app([*step, *told], prog_name="bimvox", standalone_mode=False) or DONE)
        if code == INTERRUPTED:  # typer makes a code of Ctrl-C
            raise KeyboardInterrupt
    if not (json or quiet):
        made = {
            "log": ".mcap",
            "picture": ".png",
            "site": ".site.toml",
            "drawing": ".site.svg",
            "page": ".html",
            "table": ".csv",
        }
        print(_END.format(**{name: model.with_suffix(suffix) for name, suffix in made.items()}))
    raise typer.Exit(code)
