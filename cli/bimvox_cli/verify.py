"""``bimvox verify``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox.rendering.words import counted
from bimvox_cli.matters import MOST_LINES, remark_matters, show_matters
from bimvox_cli.options import Log, command, table_option
from bimvox_cli.output import Output, in_lines, lines_of, rows, spent, written
from bimvox_cli.remarks import Remarks, crane_fields, show_remarks, verdict

if TYPE_CHECKING:
    from rich.console import Console


_FEW = 3
"""Failures of a kind that are printed without being asked for."""
_NAMES = ("checks", "remarks", "claims", "conditions", "not_covered")


@command
def verify(
    output: Output,
    log: Log,
    site: Annotated[
        Path | None, typer.Option(metavar="SITE", help="The site file that you hold: prove that the log is of it.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(metavar="MODEL", help="The model, if it is not where the site file says.")
    ] = None,
    obstructions: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The obstruction file that you hold.")
    ] = None,
    programme: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The programme that was given to plan, if any.")
    ] = None,
    traffic: Annotated[
        str | None,
        typer.Option(metavar="FILE|SEED", help="The tracks or the seed that were given to watch --traffic."),
    ] = None,
    search: Annotated[
        bool,
        typer.Option(
            "--search", help="Search again what is called infeasible, and the fewest moves; as long as planning."
        ),
    ] = False,
    tables: Annotated[list[str], table_option(_NAMES)] = [],  # noqa: B006
    remarks: Remarks = False,
) -> int:
    """Prove a log again, independently of the planner.

    Remarks follow the verdict: what a person should look at although the plan is proven.
    """
    from bimvox_pipeline.verify import verify as run

    document = run(
        log,
        site=site,
        model=model,
        obstructions=obstructions,
        programme=programme,
        traffic=traffic,
        search=search,
        progress=output.progress,
    )
    wanted = dict.fromkeys([*tables, *(("remarks",) if remarks else ())])
    return output.result(document, partial(_show, tables=list(wanted)))


def _show(console: Console, document: Mapping[str, Any], *, tables: Sequence[str]) -> None:
    said = verdict(document["verdict"], document, others=document["by_other_means"])
    console.print(said)
    if not tables:
        others = (partial(console.print, said), *(partial(show, console, document) for show in (_faults, _figures)))
        left = MOST_LINES - sum(lines_of(console, show) for show in others)
        _faults(console, document)
        show_matters(console, remark_matters(document["remarks"]), most_lines=left)
        _figures(console, document)
    for name in tables:
        console.print()
        _TABLES[name](console, document)


def _faults(console: Console, document: Mapping[str, Any]) -> None:
    """Print the first things that failed, that could not be decided, and that are proven for earlier obstructions."""
    checks, earlier = document["checks"], document["not_current"]
    failures = [(name, failure) for name, check in checks.items() for failure in check["failures"]]
    failed = sum(check["failed"] for check in checks.values())
    _few(console, ("check", "what failed"), failures, f"failed: {failed:,}", failed)
    undecided = [(name, sentence) for name, check in checks.items() for sentence in check["undecided"]]
    _few(console, ("check", "what could not be decided"), undecided, f"not decided: {len(undecided):,}", len(undecided))
    title = f"not proven against the current obstructions, only against those before: {len(earlier):,}"
    _few(console, ("lift", "part"), [(lift["number"], lift["name"]) for lift in earlier], title, len(earlier))


def _few(
    console: Console, columns: Sequence[str], values: Sequence[tuple[object, str]], title: str, count: int
) -> None:
    if values:
        console.print()
        rows(console, columns, values, title=title, limit=_FEW, count=count, cut=columns[-1])


def _figures(console: Console, document: Mapping[str, Any]) -> None:
    infeasible, left_out = document["infeasible_lifts"], document["left_out"]
    carried = f", {left_out:,} not in this extract" if left_out else ""
    refused = f", {infeasible:,} refused" if infeasible else ""
    made = [check for check in document["checks"].values() if check["samples"]]
    passed = sum(check["passed"] for check in made)
    values = sum(check["samples"] for check in made)
    console.print()
    cranes = "; ".join(
        str(value)
        for name, value in crane_fields(document["cranes"], document.get("set_ups", ()))
        if value and "override" not in name
    )
    in_lines(
        console,
        [
            ("lifts", f"{document['lifts']:,}{refused}{carried}"),
            ("crane", cranes),
            ("checks", f"{passed:,} of {len(made):,} passed, {values:,} values"),
            ("claims", _claims(document["claims"]) if document["verified"] else None),
            *(_conditions(document["conditions"]) if document["verified"] else ()),
            ("to tick", f"{len(document['not_covered']):,} lines that no plan covers, in bimvox report"),
            ("took", spent(document["seconds"])),
            ("tables", f"--table {', '.join(_TABLES)}"),
        ],
    )


def _claims(claims: Sequence[Mapping[str, Any]]) -> str | None:
    """Return how many claims of the log are taken as true, and the options that prove them."""
    options = Counter(claim["bind_with"] for claim in claims)
    by = [f"{option} proves {count:,}" for option, count in options.items() if option is not None]
    return f"{counted(len(claims), 'claim')} of the log taken as true; {', '.join(by)}" if claims else None


def _conditions(conditions: Sequence[str]) -> list[tuple[str, str]]:
    """Return the first conditions of the verdict, each with its name, and how many more there are."""
    rest = len(conditions) - _FEW
    said = [*conditions[:_FEW], *([f"... and {rest:,} more (--table conditions)"] if rest > 0 else ())]
    return [("" if n else "provided that", text) for n, text in enumerate(said)]


def _checks(console: Console, document: Mapping[str, Any]) -> None:
    rows(
        console,
        ("check", "passed", "samples", "worst"),
        [
            (
                name,
                "NO" if not check["passed"] else "yes" if check["samples"] else "-",
                check["samples"],
                "" if check["worst"] is None else f"{written(check['worst'])} {check['unit'] or ''}".rstrip(),
            )
            for name, check in document["checks"].items()
        ],
        limit=None,
    )


def _listed(key: str, of: Callable[[Any], str] = str) -> Callable[[Console, Mapping[str, Any]], None]:
    """Return what prints a list of a document, a line of text each."""

    def show(console: Console, document: Mapping[str, Any]) -> None:
        values = [(of(one),) for one in document[key]]
        rows(console, (key.replace("_", " "),), values, title=f"{key.replace('_', ' ')}: {len(values):,}", limit=None)

    return show


def _claimed(claim: Mapping[str, Any]) -> str:
    """Return a claim of the log in words: how many things it is about, and the option that proves it."""
    count = f" ({claim['count']:,})" if "count" in claim else ""
    bind = f" [{claim['bind_with']} proves it]" if claim["bind_with"] else ""
    return f"{claim['text']}{count}{bind}"


_TABLES: dict[str, Callable[[Console, Mapping[str, Any]], None]] = {
    "checks": _checks,
    "remarks": lambda console, document: show_remarks(console, document["remarks"]),
    "claims": _listed("claims", _claimed),
    "conditions": _listed("conditions"),
    "not_covered": _listed("not_covered", lambda line: f"{line['topic']}: {line['text']}"),
}
