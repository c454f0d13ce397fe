"""The choice of a machine: the smallest that serves, why smaller ones do not, and what none can set."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_buildings import box_element

from bimvox.crane.load_chart import capacity_kg
from bimvox.errors import InputError
from bimvox.site.catalogue import catalogue, machine_called, machines_of
from bimvox.site.crane_guess import compare_cranes, fit_here, guess_crane

HALL = np.array([[0.0, 0.0], [20.0, 12.0]])
YARD = (((0.0, -14.0), (10.0, -14.0), (10.0, -4.0), (0.0, -4.0)),)


def parts(*masses_kg):
    return [
        box_element(f"p{n}", (3.0 * n, 2.0, 0.0), (3.0 * n + 2.0, 4.0, 3.0), mass_kg=mass)
        for n, mass in enumerate(masses_kg)
    ]


def test_the_smallest_machine_that_serves_with_its_shortest_jib_and_fewest_falls():
    crane, unserved = guess_crane(parts(1000.0, 1500.0), HALL, YARD, 10.0, machines_of("hammerhead"))
    assert (crane.name, crane.jib_length_m, crane.falls, unserved) == ("flat-top-75", 32.0, 2, 0)
    heavier, _ = guess_crane(parts(1000.0, 3500.0), HALL, YARD, 10.0, machines_of("hammerhead"))
    assert machine_called(heavier.name).load_moment_tm >= machine_called("flat-top-75").load_moment_tm
    assert heavier.falls >= crane.falls
    assert guess_crane(parts(1000.0, 1500.0), HALL, YARD, 10.0, machines_of("hammerhead")) == (crane, 0)


def test_every_smaller_machine_has_a_reason_with_figures():
    lifted = parts(1000.0, 1500.0, 8000.0)
    crane, _ = guess_crane(lifted, HALL, YARD, 10.0, machines_of("hammerhead"))
    rows = {row.machine: row for row in compare_cranes(lifted, HALL, YARD, 10.0, machines_of("hammerhead"))}
    smaller = [row for row in rows.values() if row.load_moment_tm < machine_called(crane.name).load_moment_tm]
    assert smaller
    for row in smaller:
        assert "p2 weighs 8.0 t" in row.reason
        assert "carries" in row.reason
    own = rows[crane.name]
    assert own.serves and own.reason == "" and own.unserved == ()
    assert own.crane == crane
    radii = [float(np.hypot(*(np.array([3.0 * n + 1.0, 3.0]) - crane.base_m[:2]))) for n in range(3)]
    used = [
        (part.mass_kg + crane.tackle_kg) / capacity_kg(crane.chart, radius)
        for part, radius in zip(lifted, radii, strict=True)
    ]
    assert own.utilisation == pytest.approx(max(used), rel=1e-6)
    assert own.radius_m == pytest.approx(max(radii), rel=1e-6)


def test_if_none_serves_the_one_that_sets_most_is_taken_and_the_others_are_named():
    lifted = parts(1000.0, 90_000.0, 1500.0)
    crane, unserved = guess_crane(lifted, HALL, YARD, 10.0, machines_of("hammerhead"))
    assert (crane.name, unserved) == ("flat-top-75", 1)
    fit = fit_here(lifted, YARD, 10.0, crane)
    (part,) = fit.unserved
    assert (part.component, part.mass_kg) == ("p1", 90_000.0)
    assert not fit.serves
    assert fit.reason.endswith("p1 weighs 90.0 t")


def test_a_part_out_of_reach_says_so():
    far = [*parts(1000.0), box_element("far", (200.0, 2.0, 0.0), (202.0, 4.0, 3.0), mass_kg=500.0)]
    wide = np.array([[0.0, 0.0], [202.0, 12.0]])
    crane, unserved = guess_crane(far, wide, YARD, 10.0, machines_of("hammerhead"))
    assert unserved == 1
    (part,) = fit_here(far, YARD, 10.0, crane).unserved
    assert part.component == "far"
    assert part.reason.startswith(f"reaches {crane.jib_length_m:.1f} m of the ")


def test_a_part_that_the_yard_cannot_hand_over_says_so():
    lifted = parts(4000.0)
    crane = replace(machine_called("flat-top-75").usual, base_m=(-5.0, 8.0, 0.0), jib_height_m=20.0)
    near = fit_here(lifted, YARD, 10.0, crane)
    assert near.unserved[0].reason.endswith("in the yard")
    assert "p0 weighs 4.0 t" in near.reason
    assert fit_here(lifted, (), 10.0, crane).serves


def test_only_the_permitted_share_of_the_chart_counts():
    machines, lifted = machines_of("hammerhead"), parts(1000.0, 3500.0)
    free, _ = guess_crane(lifted, HALL, YARD, 10.0, machines)
    half, unserved = guess_crane(lifted, HALL, YARD, 10.0, machines, most_used=0.5)
    sizes = {machine.name: machine.load_moment_tm for machine in machines}
    assert (unserved, sizes[half.name] > sizes[free.name]) == (0, True)
    assert half.chart in [crane.chart for crane in machine_called(half.name).cranes]  # the crane keeps its whole chart
    fit = fit_here(lifted, YARD, 10.0, half, most_used=0.5)
    assert fit.serves
    assert 0.0 < fit.utilisation <= 0.5
    assert fit.utilisation == fit_here(lifted, YARD, 10.0, half).utilisation
    (row,) = compare_cranes(lifted, HALL, YARD, 10.0, [machine_called(free.name)], most_used=0.3)
    assert "with 30 % of its chart" in row.reason


def test_a_low_boom_is_named_with_the_height():
    (row,) = compare_cranes(parts(500.0), HALL, YARD, 60.0, (machine_called("mobile-60t"),))
    assert not row.serves
    assert "its hook reaches" in row.reason


def test_no_place_for_the_mast():
    everywhere = (((-200.0, -200.0), (200.0, -200.0), (200.0, 200.0), (-200.0, 200.0)),)
    with pytest.raises(InputError, match="no mast has a place"):
        guess_crane(parts(500.0), HALL, everywhere, 10.0, machines_of("hammerhead"))
    (row,) = compare_cranes(parts(500.0), HALL, everywhere, 10.0, catalogue()[:1])
    assert (row.serves, row.crane) == (False, None)
    assert "no place" in row.reason
