"""What a crane carries in a direction: the chart of the sector in which its boom points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.carrier import SectorChart
from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.crane.tower_crane import TowerCrane

NO_LOAD = LoadChart((1e-3,), (1e-3,))
"""The chart of a sector in which no load may hang."""

_ON_THE_LINE_RAD = 1e-6
"""So near to the line between two sectors, the smaller capacity holds."""


def sectors_of(crane: TowerCrane) -> tuple[SectorChart, ...]:
    """Return the charts of sectors of a crane; empty if one chart holds all around."""
    return () if crane.carrier is None else crane.carrier.sectors


def charts_of(crane: TowerCrane) -> tuple[LoadChart, ...]:
    """Return the chart that holds all around, then those of sectors."""
    return (crane.chart, *(one.chart for one in sectors_of(crane) if one.chart is not None))


def towards(crane: TowerCrane, slew_rad: float) -> TowerCrane:
    """Return a crane with the chart that holds in a direction, for all directions.

    ``slew_rad``: slewing angle of the boom from the site's x axis.
    """
    if not sectors_of(crane):
        return crane
    assert crane.carrier is not None
    one_way = replace(crane, carrier=replace(crane.carrier, sectors=()))
    held = [NO_LOAD if one.chart is None else one.chart for one in _all_at(crane, slew_rad)]
    inside = _is_within(crane, slew_rad)
    return replace(one_way, chart=least_of(held if inside else [crane.chart, *held]))


def name_towards(crane: TowerCrane, slew_rad: float) -> str:
    """Return the name of the sector in a direction; empty outside all."""
    return next((one.name for one in _all_at(crane, slew_rad)), "")


def _all_at(crane: TowerCrane, slew_rad: float) -> list[SectorChart]:
    """Return the sector in a direction; on the line between two, both."""
    angle = np.array([slew_rad])
    return [one for one in sectors_of(crane) if _offset_rad(crane, one, angle)[0] <= _ON_THE_LINE_RAD]


def _is_within(crane: TowerCrane, slew_rad: float) -> bool:
    """Return whether a direction is inside a sector or inside two that meet there."""
    offsets = [_offset_rad(crane, one, np.array([slew_rad]))[0] for one in sectors_of(crane)]
    return any(off < -_ON_THE_LINE_RAD for off in offsets) or sum(off <= _ON_THE_LINE_RAD for off in offsets) > 1


def _offset_rad(crane: TowerCrane, sector: SectorChart, slew_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far directions are outside a sector; negative inside."""
    assert crane.carrier is not None
    half = (sector.to_rad - sector.from_rad) / 2.0
    middle = crane.carrier.heading_rad + sector.from_rad + half
    offset: NDArray[np.float64] = np.abs(np.remainder(slew_rad - middle + np.pi, 2.0 * np.pi) - np.pi) - half
    return offset


def least_of(charts: list[LoadChart]) -> LoadChart:
    """Return the chart that carries no more than any of several, at each radius that one of them lists."""
    if len(charts) == 1:
        return charts[0]
    radii = np.unique(np.concatenate([chart.radius_m for chart in charts]))
    carries = np.min([np.asarray(capacity_kg(chart, radii)) for chart in charts], axis=0)
    carries = np.minimum.accumulate(carries)
    held = carries > 0.0
    return LoadChart(tuple(radii[held].tolist()), tuple(carries[held].tolist())) if held.any() else NO_LOAD


def capacities_kg(crane: TowerCrane, slew_rad: ArrayLike, radius_m: ArrayLike) -> NDArray[np.float64]:
    """Return the capacity, load and rigging together, at slewing angles and radii of equal shape."""
    slew, radius = np.asarray(slew_rad, np.float64), np.asarray(radius_m, np.float64)
    capacity = np.array(capacity_kg(crane.chart, radius), np.float64)
    if not sectors_of(crane):
        return capacity
    within, least = np.zeros(radius.shape, np.int64), np.full(radius.shape, np.inf)
    deep = np.zeros(radius.shape, np.bool_)
    for one in sectors_of(crane):
        off = _offset_rad(crane, one, slew)
        here = off <= _ON_THE_LINE_RAD
        carries = np.asarray(capacity_kg(NO_LOAD if one.chart is None else one.chart, radius))
        least = np.where(here, np.minimum(least, carries), least)
        within, deep = within + here, deep | (off < -_ON_THE_LINE_RAD)
    result: NDArray[np.float64] = np.where(deep | (within > 1), least, np.minimum(capacity, least))
    return result


def utilisations(crane: TowerCrane, slew_rad: ArrayLike, radius_m: ArrayLike, mass_kg: float) -> NDArray[np.float64]:
    """Return mass / capacity at slewing angles and radii of equal shape; infinite if the capacity is 0."""
    capacity = capacities_kg(crane, slew_rad, radius_m)
    share = np.full(capacity.shape, np.inf)
    np.divide(mass_kg, capacity, out=share, where=capacity > 0.0)
    return share


def with_charts(crane: TowerCrane, change: Callable[[LoadChart], LoadChart]) -> TowerCrane:
    """Return a crane with every chart of it changed."""
    changed = replace(crane, chart=change(crane.chart))
    if not sectors_of(crane):
        return changed
    assert crane.carrier is not None
    sectors = tuple(
        one if one.chart is None else replace(one, chart=change(one.chart)) for one in crane.carrier.sectors
    )
    return replace(changed, carrier=replace(crane.carrier, sectors=sectors))
