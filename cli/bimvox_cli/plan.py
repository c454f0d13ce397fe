"""``bimvox plan``."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, redirect_stdout
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox.errors import InputError
from bimvox_cli.answer import first_line, show_answer
from bimvox_cli.fleet_options import BackendName, Cluster, Fresh, Jobs, show_fleet
from bimvox_cli.options import FullRate, PolicyId, Programme, Seed, Steps, Train, command, table_option, to_file
from bimvox_cli.output import Output
from bimvox_cli.plan_tables import TABLES, show_table
from bimvox_cli.remarks import Remarks

if TYPE_CHECKING:
    from rich.console import Console

_FOLDER = "plans"


@command
def plan(
    output: Output,
    sites: Annotated[
        list[Path], typer.Argument(metavar="SITE...", help="Site files (TOML), as `bimvox init` writes them.")
    ],
    out: Annotated[
        Path | None,
        to_file(
            "LOG.mcap", "Log. Default: SITE.mcap in the current folder. For several sites: a folder. Default: plans."
        ),
    ] = None,
    obstructions: Annotated[
        Path | None,
        typer.Option(
            envvar="BIMVOX_OBSTRUCTIONS", metavar="FILE", help="Obstructions: JSON, TOML, an IFC file or a mesh."
        ),
    ] = None,
    programme: Programme = None,
    policy: PolicyId = None,
    seed: Seed = None,
    steps: Steps = None,
    train: Train = False,
    paths: Annotated[
        str | None,
        typer.Option(
            metavar="MODULE:FUNCTION",
            help="A planner of yours, asked first for each path: module:function or file.py:function (its code runs).",
        ),
    ] = None,
    paths_limit: Annotated[
        float,
        typer.Option(
            min=0.001, metavar="SECONDS", help="Longest that --paths, or a policy of yours, takes for a lift."
        ),
    ] = 60.0,
    order: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Erection sequence: a file with the id of every part, one a line or a JSON list; or module:function.",
        ),
    ] = None,
    retrain: Annotated[
        int,
        typer.Option(
            envvar="BIMVOX_RETRAIN",
            min=0,
            metavar="STEPS",
            help="If the policy fails lifts, train it further on the current site, for at most this many steps.",
        ),
    ] = 0,
    full_rate: FullRate = False,
    backend: BackendName = "loky",
    jobs: Jobs = None,
    cluster: Cluster = None,
    fresh: Fresh = False,
    tables: Annotated[list[str], table_option(TABLES, "With -v, lifts has how paths were found.")] = [],  # noqa: B006
    remarks: Remarks = False,
) -> int:
    """Plan every lift, prove the plan, time it, and write the log.

    Prints the verdict, what a person must look at, and the key figures; --table prints more of the plan.
    Several sites are planned in parallel: one log each and one table. --backend, --cluster and --fresh apply to several
    sites, as in `bimvox sweep`. The lifts of one site are planned, timed and proven in --jobs processes.

    --paths, --order and --policy MODULE:NAME take code of yours. Its paths are proven as all others are, and every lift
    says who found it.
    """
    if len(sites) > 1:
        alone = {
            "--retrain": retrain,
            "--paths": paths is not None,
            "--order": order is not None,
            "--programme": programme is not None,
            "--full-rate": full_rate,
            "--table": tables,
        }
        if option := next((name for name, given in alone.items() if given), None):
            raise InputError(f"{option} works with one site only", hint="plan the sites one by one, or leave it out")
        from bimvox_pipeline.fleet.command import fleet
        from bimvox_pipeline.fleet.runs import Wish
        from bimvox_pipeline.fleet.schedule import Execution

        wishes = [Wish(site, obstructions, seed, policy, steps, train) for site in sites]
        execution = Execution(backend, jobs, cluster, fresh)
        planned = fleet(wishes, out or Path(_FOLDER), execution=execution, progress=output.progress)
        return output.result(planned, partial(show_fleet, verbose=output.verbose))
    from bimvox_pipeline.named_code import named_code, named_order
    from bimvox_pipeline.plan import plan as run
    from bimvox_pipeline.warm_up import helped

    from bimvox.errors import PolicyError
    from bimvox.library.arguments import PolicyWish

    site = sites[0]
    own_policy = None if policy is None or ":" not in policy else named_code(policy, "policy", PolicyError)
    wish = PolicyWish(
        own_policy or policy,
        seed,
        steps,
        train,
        retrain,
        None if paths is None else named_code(paths, "--paths"),
        None if order is None else named_order(order),
        paths_limit,
    )
    of_caller = any(one is not None for one in (paths, order, own_policy))
    with (
        output.notes_held(),
        helped("plan"),
        redirect_stdout(sys.stderr) if of_caller else nullcontext(),  # what code of the caller prints is no result
    ):
        document = run(
            site,
            out,
            obstructions=obstructions,
            programme=programme,
            wish=wish,
            jobs=jobs,
            full_rate=full_rate,
            progress=output.progress,
        )
    wanted = dict.fromkeys([*tables, *(("remarks",) if remarks else ())])
    code = output.result(document, partial(_show, tables=list(wanted), verbose=output.verbose))
    page = Path(document["log"]).with_suffix(".html")
    output.next_step(f"next: bimvox render {document['log']} -o {page}")
    return code


def _show(console: Console, document: Mapping[str, Any], *, tables: Sequence[str], verbose: bool) -> None:
    if not tables:
        show_answer(console, document)
        if verbose:
            console.print()
            show_table(console, "figures", document)
        return
    console.print(first_line(document))
    for name in tables:
        console.print()
        show_table(console, name, document, verbose=verbose)
