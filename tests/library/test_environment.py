"""The environment of a site of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from planned_sites import planned, portal_crane, portal_site

import bimvox
from bimvox.env.problem import LiftProblem
from bimvox.log.plan_log import PlanLog
from bimvox.site.collision import placement_is_free

SITE = Path(__file__).parents[2] / "sample_models" / "paper.site.toml"


@pytest.fixture(scope="module")
def problems() -> tuple[LiftProblem, ...]:
    return bimvox.lift_problems(SITE)


def test_the_problems_are_lifts_of_the_site(problems: tuple[LiftProblem, ...]) -> None:
    site = bimvox.load_site(SITE)
    assert 0 < len(problems) <= min(20, len(site.components))
    assert {problem.grid_shape for problem in problems} == {site.site.shape}
    columns = {tuple(component.target_vox[:2]) for component in site.components}
    assert {tuple(problem.target_vox[:2]) for problem in problems} <= columns
    for problem in problems:
        assert all(placement_is_free(problem.space, *map(int, cell)) for cell in problem.starts_vox)


def test_an_environment_runs_on_them(problems: tuple[LiftProblem, ...]) -> None:
    env = gymnasium.make("bimvox/Lift-v0", problems=problems)
    observation, info = env.reset(seed=0, options={"problem": len(problems) - 1})
    assert env.observation_space.contains(observation)
    assert info["distance"] > 0
    assert np.asarray(env.step(env.action_space.sample())[0]).shape == observation.shape


def test_obstructions_of_a_plan_are_in_the_way() -> None:
    plan = bimvox.plan(bimvox.load_site(SITE), policy="none")
    shape = plan.site.shape
    crate = bimvox.Obstruction("crate", bimvox.Voxels([(shape[0] // 2, 1, 5)]))
    revised = bimvox.revise(plan, bimvox.ObstructionSet.of([crate]))
    clear, blocked = bimvox.lift_problems(plan), bimvox.lift_problems(revised)
    assert sum(int(one.space.table[-1, -1, -1]) for one in blocked) > sum(
        int(one.space.table[-1, -1, -1]) for one in clear
    )


@pytest.mark.parametrize(("site", "said"), [(5, "takes a site, a plan or the path"), ("no.site.toml", "no.site.toml")])
def test_what_is_not_a_site_is_refused(site: Any, said: str) -> None:
    with pytest.raises(bimvox.BimvoxError, match=said):
        bimvox.lift_problems(site)


PAPER = Path(__file__).parents[2] / "sample_models" / "paper.site.toml"


@pytest.fixture(scope="module")
def plan() -> bimvox.Plan:
    lifts, motions = planned(portal_site(portal_crane()))
    return bimvox.Plan(PlanLog(plan=lifts, motions=motions))


def test_an_environment_carries_out_a_plan_of_ones_own(plan: bimvox.Plan) -> None:
    job: Any = bimvox.live_job(plan)
    assert [lift.number for lift in job.lifts] == [1, 2, 3, 4]
    env = gymnasium.make("bimvox/LiveSite-v0", job=job, traffic="light")
    _, info = env.reset(seed=2)
    over = False
    while not over:
        _, _, ends, cut, info = env.step(np.int64(np.flatnonzero(info["action_mask"])[0]))
        over = ends or cut
    assert info["violations"] == 0


def test_part_of_a_plan_and_tracks(plan: bimvox.Plan, tmp_path: Path) -> None:
    tracks = tmp_path / "tracks.csv"
    tracks.write_text("id,kind,time_s,x_m,y_m\na,person,0,1,1\n")
    job: Any = bimvox.live_job(plan, first=3, count=1, tracks=tracks)
    assert [lift.number for lift in job.lifts] == [3]
    np.testing.assert_array_equal(job.ground.track, [[0.0, 1.0, 1.0]])


def test_what_is_no_job_is_refused(plan: bimvox.Plan, tmp_path: Path) -> None:
    verbs: Any = bimvox
    with pytest.raises(bimvox.BimvoxError, match=r"live_job\(\) takes a plan"):
        verbs.live_job("prefab.mcap")
    with pytest.raises(bimvox.BimvoxError, match="a planned lift number 5"):
        bimvox.live_job(plan, first=5)
    with pytest.raises(bimvox.BimvoxError, match="count is 0"):
        bimvox.live_job(plan, count=0)
    with pytest.raises(bimvox.BimvoxError, match=r"gone\.csv"):
        bimvox.live_job(plan, tracks=tmp_path / "gone.csv")
    with pytest.raises(bimvox.BimvoxError, match="one crane"):
        bimvox.live_job(bimvox.plan(bimvox.load_site(PAPER), policy="none"))
