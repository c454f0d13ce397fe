"""``bimvox sweep``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from bimvox_cli.fleet_options import BackendName, Cluster, Fresh, Jobs, show_fleet
from bimvox_cli.options import command, to_file
from bimvox_cli.output import Output


@command
def sweep(
    output: Output,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A sweep file (TOML); see `bimvox schema sweep`.")],
    out: Annotated[
        Path | None,
        to_file("FOLDER", "Folder of logs, records and table. Default: FILE-runs in the current folder."),
    ] = None,
    backend: BackendName = "loky",
    jobs: Jobs = None,
    cluster: Cluster = None,
    fresh: Fresh = False,
) -> int:
    """Plan many sites, seeds and what-ifs: a log each, one table.

    A stopped sweep resumes when it is called again. A run that fails is a row of the table with its error; the others
    continue.
    """
    from bimvox_pipeline.fleet.command import sweep as run
    from bimvox_pipeline.fleet.schedule import Execution

    execution = Execution(backend, jobs, cluster, fresh)
    document = run(file, out, execution=execution, progress=output.progress)
    return output.result(document, partial(show_fleet, verbose=output.verbose))
