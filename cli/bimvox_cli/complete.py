"""What the shell offers for the values of options."""

from __future__ import annotations

from pathlib import Path

import typer

Offered = list[tuple[str, str]]
"""Values, each with a word about it."""


def cranes(incomplete: str) -> Offered:
    """Return kinds of crane and machines of the catalogue."""
    from bimvox.site.catalogue import PUBLIC, every_machine

    machines = every_machine()
    kinds = [(kind, "kind of crane") for kind in sorted({machine.kind for machine in machines})]
    kinds.append((PUBLIC, "real machines from public figures"))
    return _beginning([*kinds, *((machine.name, machine.kind) for machine in machines)], incomplete)


def policies(incomplete: str) -> Offered:
    """Return what ``--policy`` takes: the stored policies and the names that are always there."""
    from bimvox.policy.choice import DEFAULT_START, GREEDY_POLICY, NEAREST, NO_POLICY
    from bimvox.policy.store import scan

    stored = [(manifest.id, f"{manifest.steps:,} steps") for manifest in scan().manifests]
    always = [
        (NO_POLICY.id, "search only"),
        (GREEDY_POLICY.id, "towards the target"),
        (DEFAULT_START, "the shipped network"),
        (NEAREST, "that of the most similar site"),
    ]
    return _beginning([*always, *stored], incomplete)


def formats(incomplete: str) -> Offered:
    """Return the export formats of logs and grids."""
    from bimvox.exporters.formats import FORMATS

    names = dict.fromkeys(one.name for one in FORMATS)
    of = {name: " or ".join(f"a {one.source.value}" for one in FORMATS if one.name == name) for name in names}
    return _beginning([(name, f"of {sources}") for name, sources in of.items()], incomplete)


def layers(incomplete: str) -> Offered:
    """Return what a picture can leave out; several are separated by commas."""
    from bimvox.rendering.pictures.scene import Layer

    *before, last = incomplete.split(",")
    prefix = "".join(f"{name}," for name in before)
    return [(f"{prefix}{name}", "") for name in map(str, Layer) if name.startswith(last) and name not in before]


def lifts(context: typer.Context, incomplete: str) -> Offered:
    """Return the numbers of the lifts of the log on the command line, with the names of their parts."""
    from bimvox.errors import BimvoxError
    from bimvox.log.reader import read_log

    file = context.params.get("log") or context.params.get("file")
    if not file:
        return []
    try:
        plan = read_log(Path(file)).plan
    except BimvoxError:
        return []
    parts = plan.site.components
    return _beginning([(str(lift.number), parts[lift.component].label) for lift in plan.lifts], incomplete)


def _beginning(offered: Offered, incomplete: str) -> Offered:
    return [(value, about) for value, about in offered if value.startswith(incomplete)]
