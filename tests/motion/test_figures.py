"""The figures of a plan."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from drawn_plans import motions_by_hand, plan_by_hand
from moving_sites import planned_row
from planned_sites import planned, portal_crane, portal_site

from bimvox.crane.kinematics import hook_of
from bimvox.motion.figures import capacity_used, driven_rates, plan_figures
from bimvox.records.lift import Method
from bimvox.records.steps import Steps
from bimvox.site.config.calendar import CalendarConfig, CostsConfig, rates_of
from bimvox.site.crane_guess import machine_of_crane


def test_counts_shares_and_lengths_are_those_of_the_lifts():
    plan = plan_by_hand(crane=True, infeasible=("beam-a",))
    motions = motions_by_hand(plan)
    first = next(lift for lift in plan.lifts if lift.path_vox is not None)
    lifts = [dataclasses.replace(lift, method=Method.POLICY) if lift is first else lift for lift in plan.lifts]
    figures = plan_figures(dataclasses.replace(plan, lifts=tuple(lifts)), motions)
    planned = [lift for lift in lifts if lift.path_vox is not None]
    assert (figures.lifts, figures.planned) == (len(lifts), len(planned))
    assert figures.methods == {"policy": 1, "greedy": 0, "retrained": 0, "search": len(planned) - 1}
    assert sum(figures.share(method) for method in figures.methods) == pytest.approx(1.0)
    assert figures.moves == sum(len(lift.path_vox) - 1 for lift in planned)
    assert figures.length_ratio == figures.moves / sum(lift.shortest_moves for lift in planned)
    assert figures.crane_s == pytest.approx((motions[-1].end_ns - motions[0].start_ns) / 1e9)


def test_the_hook_travels_no_less_than_from_end_to_end():
    plan = plan_by_hand(crane=True)
    motions = motions_by_hand(plan)
    crane = plan.site.cranes[0]
    straight_m = 0.0
    for motion in motions:
        for part in motion.trajectories:
            ends = hook_of(crane, part.slew_rad[[0, -1]], part.radius_m[[0, -1]], part.height_m[[0, -1]])
            straight_m += float(np.linalg.norm(ends[1] - ends[0]))
    figures = plan_figures(plan, motions)
    assert figures.hook_travel_m >= straight_m - 1e-9
    used = [capacity_used(plan.site, motion) for motion in motions]
    assert figures.critical == sum(share >= 0.75 for share in used)
    assert plan_figures(plan, motions, critical_share=min(used)).critical == len(motions)
    assert plan_figures(plan, motions).highest == max(used)


def test_without_a_crane_there_are_no_figures_of_a_crane():
    figures = plan_figures(plan_by_hand(crane=False), ())
    assert (figures.crane_s, figures.hook_travel_m, figures.critical) == (None, None, None)
    assert figures.moves > 0


def test_the_driven_rates_are_those_between_the_samples():
    motions = motions_by_hand(plan_by_hand(crane=True))
    driven = driven_rates(motions)
    rates = [
        max((float(np.abs(np.diff(part.height_m) / np.diff(part.time_ns / 1e9)).max()) for part in parts), default=0.0)
        for parts in (
            [part for motion in motions for part in (motion.raising, motion.loaded)],
            [part for motion in motions for part in (motion.approach, motion.departure) if part is not None],
        )
    ]
    assert (driven["loaded_m_s"], driven["empty_m_s"]) == pytest.approx(rates)
    assert driven_rates([]) is None


def test_the_cost_is_that_of_the_cranes_hours_days_and_lorries():
    costs, calendar = CostsConfig(currency="USD", lorry=700.0), CalendarConfig()
    plan, motions = planned(portal_site(portal_crane()))
    figures = plan_figures(plan, motions, calendar, Steps(), costs)
    crane = machine_of_crane(plan.site.cranes[0])
    rates = rates_of(costs, calendar, crane.name, crane.kind, crane.load_moment_tm)
    hook_h = (figures.crane_s + figures.unloading.seconds) / 3600.0
    assert figures.cost.crew == pytest.approx(rates.hour * hook_h)
    assert figures.cost.hire == rates.hires[0].total(figures.hire_days)
    assert (figures.cost.set_up, figures.cost.lorries) == (rates.set_up, 700.0 * figures.unloading.lorries)
    assert figures.cost.document()["total"] == pytest.approx(figures.cost.total, abs=0.01)
    assert figures.cost.currency == "USD"
    assert plan_figures(plan, motions, calendar, None, costs).cost is None, "of an extract, the days are not known"
    assert plan_figures(plan, motions, calendar, Steps()).cost is None


def test_a_crane_that_moves_is_paid_once_and_its_crew_for_the_moves():
    record = planned_row().record
    costs, calendar = CostsConfig(), CalendarConfig()
    figures = plan_figures(record.plan, record.motions, calendar, record.steps, costs)
    machine = machine_of_crane(record.plan.site.cranes[0])
    rates = rates_of(costs, calendar, machine.name, machine.kind, machine.load_moment_tm)
    (move,) = record.steps.moves
    assert figures.moves_s == (move.ends_ns - move.begins_ns) / 1e9 > 3600.0
    hours = (figures.crane_s + figures.unloading.seconds + figures.moves_s) / 3600.0
    assert figures.cost.crew == pytest.approx(rates.hour * hours)
    assert figures.cost.hire == rates.hires[0].total(figures.hire_days)
    assert figures.cost.set_up == rates.set_up
