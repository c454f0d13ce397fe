"""Compares the site that a log claims with the site file and the obstruction file that it carries.

Both files are read again. What follows from them without the building model is compared: rules, cranes, zones, areas,
cell size, obstructions. Ground and masts follow from the site itself.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from bimvox.errors import BimvoxError
from bimvox.grid.labels import Label
from bimvox.library.obstructions import load_obstructions, rasterise
from bimvox.library.site import SITE_FILE
from bimvox.log.plan_log import PlanLog
from bimvox.records.proof import Check
from bimvox.site.areas import columns_centred_in
from bimvox.site.build import ground_and_masts, with_obstructions
from bimvox.site.config import SiteConfig
from bimvox.site.config_file import parse_site_config
from bimvox.site.machine import cranes_of
from bimvox.site.obstructions.file import without_references
from bimvox.site.site import Blocker, HookHeights, Site
from bimvox.site.zones import NO_HOOK, NO_LOAD, columns_without, hook_heights

OBSTRUCTIONS = "obstructions."
"""Begins the name of an obstruction file among the files attached to a log."""

_SAME = 1e-9


def check_own_files(log: PlanLog) -> Check:
    """Check that the files attached to a log give the rules, cranes, zones, areas and obstructions of its site."""
    check = Check("own_files")
    site = log.plan.site
    _same_blockers(check, site, ("ground", "crane"), ground_and_masts(site, rasterise), "the site's shape and cranes")
    if (text := log.attachments.get(SITE_FILE)) is None:
        check.look(False, f"it carries no {SITE_FILE}, so nothing says for which rules and crane it was planned")
    else:
        try:
            config = parse_site_config(text.decode("utf-8-sig"), SITE_FILE)
            compare_config(check, site, config, f"the attached {SITE_FILE}")
        except (BimvoxError, UnicodeDecodeError) as error:
            check.look(False, f"the attached {SITE_FILE} cannot be used: {error}")
    for name in sorted(log.attachments):
        if name.startswith(OBSTRUCTIONS):
            _compare_obstructions(check, site, name, log.attachments[name])
    return check


def compare_config(check: Check, site: Site, config: SiteConfig, source: str) -> None:
    """Compare a site with what its site file says. What the file leaves to be chosen is not compared.

    Args:
        check: Receives what was compared.
        site: The site.
        config: The site file.
        source: What to call the file.

    Raises:
        ConfigError: If the file's crane is not consistent.
    """
    rules = config.rules.rules()
    for key in fields(rules):
        _same(check, f"rules.{key.name}", getattr(site.rules, key.name), getattr(rules, key.name), source)
    if config.crane is not None:
        _compare_cranes(check, site, config, source)
    columns = site.shape[:2]
    for name, found, kinds in (("prohibited", site.prohibited, NO_HOOK), ("no_load", site.no_load, NO_LOAD)):
        wanted = columns_without(kinds, config.zone, site.frame, columns)
        check.look(_equal(found, wanted), f"zones: the {name} columns are not those of {source}")
    heights = hook_heights(config.zone, site.frame, columns)
    check.look(_equal_heights(site.hook_heights, heights), f"zones: the hook's limits are not those of {source}")
    if config.areas.construction is not None:
        construction = columns_centred_in([config.areas.construction], site.frame, columns)
        found = site.labels[:, :, 0] == Label.CONSTRUCTION_AREA
        check.look(bool((found == construction).all()), f"areas.construction is not that of {source}")
        if config.areas.yard is not None:
            yard = columns_centred_in(config.areas.yard, site.frame, columns) & ~construction
            check.look(bool((site.yard == yard).all()), f"areas.yard is not that of {source}")
    if config.model.voxel_size_m is not None:
        _same(check, "model.voxel_size_m", site.frame.voxel_size_m, config.model.voxel_size_m, source)
    yaw_rad = float(np.arctan2(site.site_to_ifc[1, 0], site.site_to_ifc[0, 0]))
    off_rad = abs((yaw_rad - config.model.yaw_rad + np.pi) % (2.0 * np.pi) - np.pi)
    check.look(off_rad <= _SAME, f"model.yaw_rad is {yaw_rad:g}; {source} has {config.model.yaw_rad:g}")
    if config.model.ground_m is not None:
        height_m = float(site.site_to_ifc[2, 3])
        good = abs(height_m - config.model.ground_m) <= 1e-6
        check.look(good, f"model.ground_m is {height_m:g}; {source} has {config.model.ground_m:g}")


def _compare_cranes(check: Check, site: Site, config: SiteConfig, source: str) -> None:
    cranes = cranes_of(config)
    names = [crane.name for crane in cranes]
    same = [crane.name for crane in site.cranes] == names
    check.look(same, f"the cranes are {[crane.name for crane in site.cranes]}; {source} has {names}")
    for found, wanted in zip(site.cranes, cranes, strict=False):
        for key in fields(wanted):
            name = f"crane {found.name!r}: {key.name}"
            _same(check, name, getattr(found, key.name), getattr(wanted, key.name), source)


def _compare_obstructions(check: Check, site: Site, name: str, data: bytes) -> None:
    """Compare the obstructions with those of an attached file."""
    source = f"the attached {name}"
    named = name.rpartition(".")[2] in ("json", "toml")
    refers: frozenset[str] = frozenset()
    with tempfile.TemporaryDirectory() as folder:
        try:
            if named:
                # The files that it refers to are not in the log, and a stranger's log must not name files to read.
                data, refers = without_references(data, name)
            file = Path(folder) / (f"{OBSTRUCTIONS}json" if named else name)
            file.write_bytes(data)
            wanted = with_obstructions(site, load_obstructions(file, site), rasterise)
        except BimvoxError as error:
            check.look(False, f"{source} cannot be used: {error}")
            return
    blockers = [blocker for blocker in wanted.blockers if blocker.kind == "obstruction"]
    blockers += [blocker for blocker in site.blockers if blocker.kind == "obstruction" and blocker.id in refers]
    _same_blockers(check, site, ("obstruction",), blockers, source, by_name=named)


def _same_blockers(
    check: Check, site: Site, kinds: Sequence[str], wanted: Sequence[Blocker], source: str, *, by_name: bool = True
) -> None:
    """Compare the fixed objects of these kinds: each by its name, or all cells together."""
    found = [blocker for blocker in site.blockers if blocker.kind in kinds]
    if not by_name:
        same = _cells_of(found) == _cells_of(wanted)
        check.look(same, f"the cells of the {kinds[0]}s are not those of {source}")
        return
    there, expected = ({blocker.id: _cells_of([blocker]) for blocker in many} for many in (found, wanted))
    check.look(len(there) == len(found), f"two of the {kinds[0]}s have the same id")
    for name in sorted(there.keys() | expected.keys()):
        what = f"{kinds[0] if len(kinds) == 1 else 'fixed object'} {name!r}"
        if name not in there:
            check.look(False, f"{what} is missing; {source} has it")
        elif name not in expected:
            check.look(False, f"{what} is not in {source}")
        else:
            check.look(there[name] == expected[name], f"{what} has other cells than {source} gives")


def _cells_of(blockers: Sequence[Blocker]) -> set[tuple[int, ...]]:
    return set(_rows(blockers))


def _rows(blockers: Sequence[Blocker]) -> Iterator[tuple[int, ...]]:
    for blocker in blockers:
        yield from map(tuple, blocker.cells.tolist())


def _same(check: Check, name: str, found: Any, wanted: Any, source: str) -> None:
    check.look(found == wanted, f"{name} is {_shown(found)}; {source} has {_shown(wanted)}")


def _shown(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 120 else f"{text[:117]}..."


def _equal(found: Any, wanted: Any) -> bool:
    return (found is None) == (wanted is None) and (found is None or np.array_equal(found, wanted))


def _equal_heights(found: HookHeights | None, wanted: HookHeights | None) -> bool:
    if found is None or wanted is None:
        return found is wanted
    return np.array_equal(found.low_m, wanted.low_m) and np.array_equal(found.high_m, wanted.high_m)
