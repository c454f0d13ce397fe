"""``bimvox cranes``: how each machine of the catalogue serves a site."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bimvox.crane.machine import Machine
    from bimvox.progress import Progress
    from bimvox.site.crane_guess import CraneFit


def cranes(site: Path | None, *, crane: str | None = None, progress: Progress) -> dict[str, Any]:
    """Compare the machines of the catalogue on a site, or list them; return the document of ``bimvox cranes --json``.

    ``crane`` is a kind of crane, ``public``, a machine of the catalogue, or the file of a machine (next to the site
    file); default: all machines; on a site the generic ones, and those whose files the site file names.

    Raises:
        ConfigError: If the site file is wrong.
        InputError: If the catalogue has no such crane, or the model cannot be used.
    """
    from bimvox.site.catalogue import every_machine, machines_called, machines_for

    if site is None:
        machines = every_machine() if crane is None else machines_called(crane, Path(crane))
        return {"site": None, "machines": [_machine_document(machine) for machine in machines]}
    from bimvox.bim.read import read_building
    from bimvox.files import require_input
    from bimvox.site.config.file import load_site_config
    from bimvox.site.guess import complete_config, cranes_that_fit

    stated = load_site_config(require_input(site))
    building = read_building(stated.model.path, stated.read_options, progress.report)
    progress.stage("compare")
    config, machines = machines_for(complete_config(stated, building), crane)
    own, fits = cranes_that_fit(config, building, machines)
    progress.finish()
    return {
        "site": str(site),
        "own": None if own is None else _fit_document(own),
        "machines": [_fit_document(fit) for fit in fits],
        "seconds": progress.seconds,
    }


def _machine_document(machine: Machine) -> dict[str, Any]:
    """Return the facts of a machine."""
    usual = machine.usual
    return {
        "machine": machine.name,
        "kind": machine.kind,
        "load_moment_tm": round(machine.load_moment_tm, 1),
        "jib_lengths_m": list(machine.lengths_m),
        "falls": sorted({crane.falls for crane in machine.cranes}),
        "largest_capacity_kg": max(crane.chart.capacity_kg[0] for crane in machine.cranes),
        "capacity_at_jib_end_kg": usual.chart.capacity_kg[-1],
        "about": machine.about,
        "source": _source(machine),
        "hoist_kw": machine.hoist_kw,
        "sources": [asdict(source) for source in machine.sources],
        "like": machine.like or None,
        "assumed": list(machine.assumed),
        "not_found": list(machine.not_found),
    }


def _source(machine: Machine) -> str:
    if machine.file is not None:
        return machine.file[0]
    return "public figures" if machine.sources else "typical of its class, not a maker's machine"


def _fit_document(fit: CraneFit) -> dict[str, Any]:
    """Return how a machine serves a site, for the JSON documents."""
    crane = fit.crane
    return {
        "machine": fit.machine,
        "kind": fit.kind,
        "load_moment_tm": round(fit.load_moment_tm, 1),
        "jib_length_m": round(fit.jib_m, 3),
        "falls": None if crane is None else crane.falls,
        "base_m": None if crane is None else list(crane.base_m),
        "serves": fit.serves,
        "parts": fit.parts,
        "parts_served": 0 if crane is None else fit.parts - len(fit.unserved),
        "highest_utilisation": round(fit.utilisation, 4),
        "largest_radius_m": round(fit.radius_m, 3),
        "estimated_hours": round(fit.hours, 2),
        "estimated_cost": round(fit.cost, 2),
        "cannot_lift": unserved_document(fit),
        "reason": fit.reason,
    }


def unserved_document(fit: CraneFit) -> list[dict[str, Any]]:
    """Return the parts that a machine cannot set, for the JSON documents."""
    return [
        {"component": part.component, "name": part.name, "mass_kg": part.mass_kg, "reason": part.reason}
        for part in fit.unserved
    ]


def smaller_machines(own: CraneFit, fits: Sequence[CraneFit]) -> list[CraneFit]:
    """Return the smaller machines of the same kind that do not serve a site, the smallest first."""
    return [fit for fit in fits if fit.kind == own.kind and fit.load_moment_tm < own.load_moment_tm and fit.reason]


def choice_notes(own: CraneFit, smaller: Sequence[CraneFit], currency: str) -> list[str]:
    """Return lines about the choice of a crane.

    They say what it serves at which cost, why smaller machines do not serve, and what it cannot set itself.
    """
    served = f"{own.machine} carries {own.parts - len(own.unserved)} of {own.parts} parts from the yard to their places"
    if own.set_ups > 1:
        lines = [
            f"{served}, in {own.set_ups} set-ups.",
            f"Estimate: {own.hours:.1f} h with its moves; {own.cost:,.0f} {currency}, see [costs].",
        ]
    else:
        lines = [
            f"{served}. Estimate: {own.hours:.1f} h of",
            f"crane time, {own.moving_hours:.1f} h of it in motion; {own.cost:,.0f} {currency}, see [costs]. "
            "`bimvox optimise` tries other places.",
        ]
    if own.is_inside:
        lines.append(
            "It stands inside the outline of the building, where the model is open over the whole height: outside,"
        )
        lines.append("nothing as cheap serves as much. Check its foundation, and how its mast is taken down.")
    lines += [f"{fit.machine} does not serve this site: {fit.reason}" for fit in smaller]
    if own.unserved:
        lines.append(f"{own.machine} sets most of the parts; no machine sets all. By other means:")
        lines += [f"  {part.name}, {part.mass_kg / 1000.0:.1f} t: {own.machine} {part.reason}" for part in own.unserved]
    return lines
