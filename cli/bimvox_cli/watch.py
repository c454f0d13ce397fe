"""``bimvox watch``."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox.records.proof import number_in_words
from bimvox.rendering.words import hours
from bimvox_cli import failure
from bimvox_cli.fleet_options import Jobs
from bimvox_cli.options import PolicyId, Programme, Seed, Steps, Train, command, to_file
from bimvox_cli.output import Output, console_on

if TYPE_CHECKING:
    from bimvox_cli.live import WatchTable

_NAMED = 3
_PLAN_STAYS = ("rejected", "missing", "failed")
"""Events that leave the plan as it is: its lifts are not counted again."""


@command
def watch(
    output: Output,
    obstructions: Annotated[
        Path, typer.Argument(metavar="OBSTRUCTIONS", help="The obstruction file to watch. It may not exist yet.")
    ],
    site: Annotated[Path, typer.Option("--site", envvar="BIMVOX_SITE", metavar="SITE", help="The site file.")],
    out: Annotated[Path | None, to_file("LOG.mcap", "Log. Default: SITE.mcap in the current folder.")] = None,
    once: Annotated[bool, typer.Option("--once", help="Read the file once, replan if needed, and exit.")] = False,
    poll: Annotated[
        float | None,
        typer.Option(
            "--poll",
            metavar="SECONDS",
            min=0.01,
            help="Read the file this often instead of waiting for events, for network shares.",
        ),
    ] = None,
    simulate: Annotated[
        float | None,
        typer.Option(
            "--simulate",
            metavar="SPEED",
            min=0.001,
            help="Carry the plan out against a clock that runs this many times as fast as real time.",
        ),
    ] = None,
    traffic: Annotated[
        str | None,
        typer.Option(
            "--traffic",
            metavar="FILE|SEED",
            help="With --simulate: carry the plan out among people and vehicles, then end. FILE: their tracks, CSV or "
            "JSON. SEED: random traffic, medium; light:SEED and heavy:SEED are others. Writes LOG.traffic.mcap.",
        ),
    ] = None,
    retrain: Annotated[
        int,
        typer.Option(
            "--retrain",
            envvar="BIMVOX_RETRAIN",
            metavar="STEPS",
            min=0,
            help="If the policy fails lifts, train it further in the background, at most this many steps. 0: never.",
        ),
    ] = 0,
    serve: Annotated[
        str | None,
        typer.Option(
            "--serve",
            metavar="[HOST:]PORT",
            help="Serve the log's topics on a websocket, for viewers such as Foxglove, at the address that is printed; "
            "needs bimvox[live].",
        ),
    ] = None,
    jobs: Jobs = None,
    programme: Programme = None,
    policy: PolicyId = None,
    seed: Seed = None,
    steps: Steps = None,
    train: Train = False,
) -> int:
    """Keep a plan up to date with an obstruction file.

    A change of the file replans only the lifts that it affects. Each change writes LOG.rNNNN.mcap with the new lifts.
    LOG.mcap is the whole plan, written when the watch is idle and at the end. Ctrl-C ends the watch.
    With --traffic the file is read once, and the crane yields to people and vehicles.
    """
    from bimvox_pipeline.watch.plan import WatchWish
    from bimvox_pipeline.watch.watch import watch as run

    from bimvox.library.arguments import PolicyWish

    code = failure.DONE
    shown = _Shown(obstructions.name, table=not (once or output.as_json or output.quiet or traffic))
    changes = run(
        obstructions,
        site=site,
        out=out,
        programme=programme,
        wish=PolicyWish(policy, seed, steps, train),
        how=WatchWish(once, poll, simulate, retrain, serve, traffic, jobs=jobs),
        progress=output.progress,
    )
    planned = False
    try:
        for change in changes:
            planned = True
            code = failure.exit_code_of(change)
            if not shown.show(change, output):
                output.line(change, line_of(change))
    except KeyboardInterrupt:
        # Interrupted while a change was being shown: this ends the watch like any other interrupt.
        if once or traffic or not planned:
            raise
    finally:
        changes.close()
        shown.close()
    # Ctrl-C is the normal end of a watch, whatever its last change was.
    return code if once or traffic else failure.DONE


class _Shown:
    """The live table, if stdout is a terminal."""

    def __init__(self, name: str, *, table: bool) -> None:
        self._name, self._wanted = name, table and sys.stdout.isatty() and os.environ.get("TERM") != "dumb"
        self._table: WatchTable | None = None

    def show(self, change: Mapping[str, Any], output: Output) -> bool:
        """Show a change in the table; return whether there is a table."""
        if not self._wanted:
            return False
        if self._table is None:
            from bimvox_cli.live import WatchTable

            output.progress.finish()
            self._table = WatchTable(console_on(sys.stdout), self._name)
        self._table.show(change, line_of(change))
        return True

    def close(self) -> None:
        if self._table is not None:
            self._table.close()


def line_of(change: Mapping[str, Any]) -> str:
    """Return a change as one line."""
    if change["event"] == "state":
        return f"{change['time_s']:,.0f} s: {change['component']} is {change['state']}"
    if change["event"] == "traffic":
        return _traffic_line(change)
    parts = [f"revision {change['revision']}: {change['event']}"]
    if change["event"] not in _PLAN_STAYS:
        parts += _counts(change)
    if change.get("latency_ms") is not None:
        parts.append(f"{change['latency_ms']:.0f} ms")
    if (remarks := change.get("remarks")) is not None:
        parts.append(number_in_words(remarks["serious"] + remarks["minor"], remarks["serious"], remarks["note"]))
    if stopped := change.get("stopped"):
        parts.append(f"{stopped['component']} {stopped['how']}{', held' if stopped['held'] else ''}")
    parts.extend(change.get("notes") or ())
    line = ", ".join(parts)
    return f"{line}: {change['message']}" if change.get("message") else line


def _traffic_line(change: Mapping[str, Any]) -> str:
    """Return what happened among people and vehicles as a few lines."""
    least_m = change["least_distance_m"]
    near = "nobody near" if least_m is None else f"nobody nearer than {least_m:.2f} m"
    return "\n".join(
        (
            f"traffic: {change['traffic']}; {change['decider']}",
            f"  {change['delivered']} of {change['lifts']} lifts delivered in {_hours(change['time_s'])}, "
            f"{_hours(change['time_lost_s'])} lost; {change['moved']} at another place in the order than planned",
            f"  {change['stops']} stops with a load, {change['waits']} waits; others waited for "
            f"{_hours(change['others_waited_s'])}",
            f"  {change['violations']} times somebody under a suspended load ({near}); "
            + ("proven" if change["verified"] else f"not proven: {change['failures'][0]}"),
            f"  {change['log']}",
        )
    )


def _hours(seconds: float) -> str:
    return hours(round(1e9 * seconds))


def _counts(change: Mapping[str, Any]) -> list[str]:
    """Return how many cells have changed, and how many lifts are kept, made anew and infeasible, and why."""
    parts = []
    if change.get("changed_cells") is not None:
        parts.append(f"{change['changed_cells']:,} cells changed")
    parts.extend(f"{len(change[key]):,} {key}" for key in ("kept", "replanned") if key in change)
    if "infeasible" in change:
        parts.append(f"{_infeasible(change)}{_why(change)}")
    parts.extend(f"{len(change[key]):,} {key}" for key in ("retimed", "pending") if change.get(key))
    return parts


def _infeasible(change: Mapping[str, Any]) -> str:
    """Return how many lifts are infeasible, in the words of ``plan``: those whose parts are set by other means."""
    count, others = (
        len(change["infeasible"]),
        sum(bool(one.get("by_other_means")) for one in change.get("blocked") or ()),
    )
    if count and others == count:
        return f"{count:,} by other means"
    return f"{count:,} infeasible" + (f", {others:,} of them by other means" if others else "")


def _why(change: Mapping[str, Any]) -> str:
    """Return the first infeasible parts and what blocks them."""
    blocked = change.get("blocked") or []
    named = [
        (one.get("name") or one["component"])
        + (f" by {', '.join(one['blocked_by_names'][:_NAMED])}" if one["blocked_by"] else "")
        for one in blocked[:_NAMED]
    ]
    more = f" and {len(blocked) - _NAMED} more" if len(blocked) > _NAMED else ""
    return f" ({'; '.join(named)}{more})" if named else ""
