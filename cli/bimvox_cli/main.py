"""``bimvox``: the commands, and the entry point."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import Annotated

import typer

from bimvox.undisturbed import interruptible
from bimvox_cli import failure
from bimvox_cli.crane import crane
from bimvox_cli.cranes import cranes
from bimvox_cli.demo import demo
from bimvox_cli.examples import HELP_NAMES, enlist
from bimvox_cli.experiment import experiment
from bimvox_cli.export import export
from bimvox_cli.init import init
from bimvox_cli.inspect import inspect
from bimvox_cli.optimise import optimise
from bimvox_cli.plan import plan
from bimvox_cli.policy import policy
from bimvox_cli.render import render
from bimvox_cli.report import report
from bimvox_cli.schema import schema
from bimvox_cli.stop import stoppable
from bimvox_cli.streams import guard_streams
from bimvox_cli.studio import studio
from bimvox_cli.sweep import sweep
from bimvox_cli.train import train
from bimvox_cli.verify import verify
from bimvox_cli.voxelize import voxelize
from bimvox_cli.warm_up import warm_up
from bimvox_cli.watch import watch

app = typer.Typer(
    name="bimvox",
    help="Turn a building model (IFC or mesh) into proven, timed crane lifts.",
    epilog="Start with: bimvox demo; with your own model: bimvox init MODEL, then bimvox plan SITE. "
    "Exit codes: 0 done, 1 no valid plan or a check failed, 2 bad usage or bad input.",
    context_settings=HELP_NAMES,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    add_completion=True,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"bimvox {version('bimvox')}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def main(
    context: typer.Context,
    _version: Annotated[
        bool, typer.Option("--version", "-V", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Turn a building model (IFC or mesh) into proven, timed crane lifts."""
    if context.invoked_subcommand is None:
        print(context.get_help(), file=sys.stderr)
        raise typer.Exit(failure.BAD_INPUT)


enlist(
    app,
    demo,
    voxelize,
    inspect,
    init,
    cranes,
    optimise,
    studio,
    train,
    plan,
    sweep,
    watch,
    export,
    verify,
    render,
    report,
    schema,
    warm_up,
)
app.add_typer(crane, name="crane", context_settings=HELP_NAMES)
app.add_typer(policy, name="policy", context_settings=HELP_NAMES)
app.add_typer(experiment, name="experiment", context_settings=HELP_NAMES)


@cache
def _parser() -> Callable[..., object]:
    """Return the parser of all commands: who runs many command lines in one process builds it once."""
    return typer.main.get_command(app)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code; the entry point of ``bimvox``.

    Args:
        arguments: Without the program's name; None: those of the process.
    """
    given = sys.argv[1:] if arguments is None else list(arguments)
    guard_streams()
    verbose = bool({"-v", "--verbose"} & set(given)) or os.environ.get("BIMVOX_DEBUG", "") not in ("", "0")
    as_json = "--json" in given or os.environ.get("BIMVOX_JSON", "").lower() in ("1", "true", "yes", "on")
    with stoppable() as stop:
        try:
            with interruptible():
                code = _parser()(given, prog_name="bimvox", standalone_mode=False)
            sys.stdout.flush()
            stop.overdue()
        except BaseException as error:
            if stop.raised is None and isinstance(error, SystemExit):
                raise
            # A library may swallow what stops the command, and fail with something else.
            return failure.report(stop.raised or error, as_json=as_json, verbose=verbose)
        if code == failure.INTERRUPTED:
            return failure.report(KeyboardInterrupt(), as_json=as_json)
    return code if isinstance(code, int) else failure.DONE
