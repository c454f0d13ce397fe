"""Assignment of parts to cranes on a site with several cranes.

A crane can lift a part if it carries it from some column of the yard to its place. If several cranes can, the site is
divided between them by weighted bisectors: a part goes to the crane whose base is nearest to its place, with a length
added to each crane's distances. The lengths minimise the work of the busiest crane. So each crane works in its own area
of the site, and all have about the same work on every storey.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.crane.travel import rest_to_rest_s
from bimvox.grid.frame import GridFrame
from bimvox.site.component import Component
from bimvox.site.config.crane import CraneConfig
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.crew_times import standing_s
from bimvox.site.lifting import hung_kg
from bimvox.site.site import Rules, Site

_ROUNDS = 200
_SLACK_M = 1e-6


def assigned(
    config: SiteConfig,
    components: Sequence[Component],
    cranes: Sequence[TowerCrane],
    yard: NDArray[np.bool_],
    frame: GridFrame,
    rules: Rules,
    on_its_slings: Callable[[Component], Component] = lambda component: component,
) -> list[Component]:
    """Return the components, each with the index of the crane that lifts it.

    A part that no crane can lift goes to the crane whose reach it exceeds least; planning reports why it is infeasible.

    Args:
        config: The site file; its ``[[component]] crane`` takes precedence.
        components: All components.
        cranes: All cranes.
        yard: (X, Y) columns of the yard.
        frame: Frame of the grid.
        rules: Rules of the site.
        on_its_slings: Returns a component of a crane with its gear on that crane; default: as given.

    Raises:
        ConfigError: If a part is assigned to a crane that the site does not have.
    """
    named = named_cranes(config, components, cranes)
    if len(cranes) < 2:
        return list(components)
    excess_m, reach_m = _excesses_m(components, cranes, yard, frame, rules, on_its_slings)
    can = excess_m <= _SLACK_M
    for n in range(len(components)):
        if n in named:
            can[n] = np.arange(len(cranes)) == named[n]
        elif not can[n].any():
            can[n, int(np.argmin(excess_m[n]))] = True
    if config.moves:  # which set-up fits the order is known later
        choice = np.argmin(np.where(can, reach_m, np.inf), axis=1)
        return [replace(component, crane=int(k)) for component, k in zip(components, choice, strict=True)]
    crew_s = np.array(
        [standing_s(rules, one, upended=one.erected, flipped=one.flip_rise_vox > 0) for one in components]
    )
    work_s = np.stack([rough_work_s(crane, reach_m[:, k], crew_s) for k, crane in enumerate(cranes)], axis=1)
    choice = balanced(can, reach_m, work_s)
    return [replace(component, crane=int(k)) for component, k in zip(components, choice, strict=True)]


def reached_from(site: Site) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return which crane can lift which part from the yard to its place by its radii, and how far it stands from there.

    Both are (N, K), by component and crane. The crane may use as much of its load chart as a part needs at its place.
    """
    rules = site.rules
    if "highest_utilisation" in rules.gives_way:
        rules = replace(rules, highest_utilisation=1.0)
    excess_m, reach_m = _excesses_m(site.components, site.cranes, site.yard, site.frame, rules, lambda one: one)
    return excess_m <= _SLACK_M, reach_m


def _excesses_m(
    components: Sequence[Component],
    cranes: Sequence[TowerCrane],
    yard: NDArray[np.bool_],
    frame: GridFrame,
    rules: Rules,
    on_its_slings: Callable[[Component], Component],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (N, K) by how much parts exceed the radii of cranes, and how far the cranes are from their places."""
    places_m = np.array([_hook_m(component, frame) for component in components])
    yard_m = _centres_m(np.argwhere(yard), frame)
    excess_m = np.empty((len(components), len(cranes)))
    for k, crane in enumerate(cranes):
        from_yard_m = _distances_m(crane, yard_m)
        for n, component in enumerate(components):
            start_m = from_yard_m if component.start_vox is None else _distances_m(crane, _start_m(component, frame))
            more_kg = hung_kg(crane, on_its_slings(replace(component, crane=k))) - crane.tackle_kg
            radii_m = allowed_radii_m(crane, more_kg, rules.highest_utilisation)
            excess_m[n, k] = _excess_m(crane, radii_m, places_m[n], start_m)
    return excess_m, np.stack([_distances_m(crane, places_m) for crane in cranes], axis=1)


def balanced(can: NDArray[np.bool_], reach_m: NDArray[np.float64], work_s: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the (N,) crane of each part: the least ``reach + longer`` of those that can; ``longer`` balances work."""
    rows = np.arange(len(can))
    longer_m, step_m = np.zeros(can.shape[1]), float(reach_m.max(initial=1.0))
    best: tuple[float, NDArray[np.int64]] | None = None
    for _ in range(_ROUNDS):
        choice = np.argmin(np.where(can, reach_m + longer_m, np.inf), axis=1)
        load_s = np.bincount(choice, weights=work_s[rows, choice], minlength=can.shape[1])
        if best is None or load_s.max() < best[0] - 1e-6:
            best = float(load_s.max()), choice
        mean_s = max(float(load_s.mean()), 1.0)
        longer_m = longer_m + step_m * np.clip((load_s - mean_s) / mean_s, -1.0, 1.0)
        step_m *= 0.95
    assert best is not None
    return best[1]


def named_cranes(config: SiteConfig, components: Sequence[Component], cranes: Sequence[TowerCrane]) -> dict[int, int]:
    """Return crane by component, as the site file says."""
    names = [crane.name for crane in cranes]
    if isinstance(config.crane, CraneConfig) and config.moves:
        names = [one.name for one in config.crane.setup]
    by_id = {name: component.index for component in components for name in (component.global_id, component.id)}
    result = {}
    for number, entry in enumerate(config.component):
        key, other = ("setup", "crane") if config.moves else ("crane", "setup")
        if getattr(entry, other) is not None:
            one, many = ("one crane that moves", "setup") if config.moves else ("no crane that moves", "crane")
            raise config.error(f"component[{number}].{other}", f"the site has {one}", hint=f"write {many} instead")
        if (wanted := getattr(entry, key)) is None:
            continue
        if wanted not in names:
            known = ", ".join(names) or "none"
            raise config.error(
                f"component[{number}].{key}",
                f"the site has no {key} called {wanted!r}",
                available=names,
                hint=f"its {key}s: {known}",
            )
        result[by_id[entry.global_id]] = names.index(wanted)
    return result


def _excess_m(
    crane: TowerCrane, radii_m: tuple[float, float], place_m: NDArray[np.float64], start_m: NDArray[np.float64]
) -> float:
    """Return by how much a part's place, or its nearest start, exceeds the crane's radii for it; 0 if within them."""
    low_m, high_m = radii_m
    if high_m < low_m:
        return float(np.inf)

    def outside_m(radius_m: NDArray[np.float64]) -> float:
        return float(np.maximum(np.maximum(low_m - radius_m, radius_m - high_m), 0.0).min(initial=np.inf))

    return max(outside_m(_distances_m(crane, place_m[None])), outside_m(start_m))


def rough_work_s(crane: TowerCrane, radius_m: NDArray[np.float64], crew_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N,) estimated seconds of work for parts set at these radii: a quarter turn and back, and the crew."""
    turn_s = rest_to_rest_s(np.pi / 2.0, crane.slewing)
    trolley_s = np.array([rest_to_rest_s(float(radius) / 2.0, crane.trolley) for radius in radius_m])
    work_s: NDArray[np.float64] = crew_s + 2.0 * np.maximum(turn_s, trolley_s)
    return work_s


def _hook_m(component: Component, frame: GridFrame) -> tuple[float, float]:
    x, y = (component.target_vox[i] + component.hook_line_vox[i] + 0.5 for i in (0, 1))
    at = frame.corner_of([x, y, 0])
    return float(at[0]), float(at[1])


def _start_m(component: Component, frame: GridFrame) -> NDArray[np.float64]:
    assert component.start_vox is not None
    return _centres_m(np.array([component.start_vox[:2]]), frame)


def _centres_m(columns: NDArray[np.int64], frame: GridFrame) -> NDArray[np.float64]:
    centres: NDArray[np.float64] = np.array(frame.origin_m[:2]) + frame.voxel_size_m * (columns + 0.5)
    return centres


def _distances_m(crane: TowerCrane, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    distances: NDArray[np.float64] = np.hypot(*(points_m - np.array(crane.base_m[:2])).T)
    return distances
