"""``bimvox watch``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from cli import failure
from cli.options import Json, PolicyId, Quiet, Seed, Steps
from cli.output import open_output


def watch(
    obstructions: Annotated[
        Path, typer.Argument(metavar="OBSTRUCTIONS", help="The obstruction file to watch; it may not exist yet.")
    ],
    site: Annotated[Path, typer.Option("--site", envvar="BIMVOX_SITE", metavar="SITE", help="The site file.")],
    out: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="LOG.mcap", help="Log; SITE.mcap here if not given.")
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="Look once, re-plan if needed, and leave.")] = False,
    policy: PolicyId = None,
    seed: Seed = None,
    steps: Steps = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Keep a plan true to an obstruction file.

    A change of the file re-plans the lifts that it affects, and only those.
    """
    from pipeline.watch import watch as run

    code = failure.DONE
    with open_output(as_json=json, quiet=quiet) as output:
        changes = run(
            obstructions,
            site=site,
            out=out,
            once=once,
            seed=seed,
            policy=policy,
            steps=steps,
            progress=output.progress,
        )
        for change in changes:
            code = failure.exit_code_of(change)
            output.line(change, _line(change))
    # A watch that was left to run ends well with Ctrl-C, whatever its last change was.
    raise typer.Exit(code if once else failure.DONE)


def _line(change: Mapping[str, Any]) -> str:
    """Write a change in one line."""
    parts = [f"revision {change['revision']}: {change['event']}"]
    if change.get("changed_cells") is not None:
        parts.append(f"{change['changed_cells']:,} cells changed")
    parts.extend(f"{len(change[key]):,} {key}" for key in ("kept", "replanned", "infeasible") if key in change)
    if change.get("latency_ms") is not None:
        parts.append(f"{change['latency_ms']:.0f} ms")
    line = ", ".join(parts)
    return f"{line}: {change['message']}" if change.get("message") else line
