from __future__ import annotations

from dataclasses import replace

import pytest

from bimvox.paper.experiment.jobs import default_settings, jobs_of, quick_settings


def names(settings, part=None):
    return {job.name for job in jobs_of(settings) if part in (None, job.part)}


def test_ten_seeds_of_everything_by_default():
    jobs = jobs_of(default_settings())
    count = {part: sum(job.part == part for job in jobs) for part in {job.part for job in jobs}}
    assert count == {
        "initialize": 30,
        "apply": 30,
        "adapt": 90,
        "matched": 10,
        "beyond": 20,
        "baseline": 10,
        "ablation": 60,
        "teacher": 1,
    }
    assert len({job.name for job in jobs}) == len(jobs)


def test_what_a_job_needs_comes_before_it():
    seen = set()
    for job in jobs_of(default_settings(3)):
        assert set(job.needs.values()) <= seen
        seen.add(job.name)


def test_more_seeds_keep_what_there_is():
    assert names(default_settings(2)) < names(replace(default_settings(4), ablation_seeds=2))


def test_a_changed_choice_makes_again_what_depends_on_it_and_nothing_else():
    before = default_settings(2)
    slower = replace(before.modes["paper"], learning_rate=1e-4)
    after = replace(before, modes={**before.modes, "paper": slower})
    kept = names(before) & names(after)
    assert not any("paper" in name and not name.startswith("ablation-") for name in kept)
    assert names(before, "beyond") <= kept
    assert names(before, "baseline") <= kept
    assert {name for name in names(before, "adapt") if "ours" in name} <= kept


def test_an_ablation_changes_one_thing_at_a_time():
    cells = {job.mode: job.options["config"] for job in jobs_of(default_settings(1)) if job.part == "ablation"}
    assert set(cells) == {
        f"{observation}-{reward}" for observation in ("paper", "window", "egocentric") for reward in ("paper", "shaped")
    }
    base = cells["paper-paper"]
    assert base["exploration_steps"] == 10_000  # as in paper mode
    for name, config in cells.items():
        observation, reward = name.split("-")
        assert {**base, "observation": observation, "reward": reward} == config


def test_one_mode_alone():
    assert not names(default_settings(2, ("ours",)), "ablation")
    assert not names(default_settings(2, ("paper",)), "beyond")


def test_unknown_modes_and_no_seeds_are_refused():
    with pytest.raises(ValueError, match="modes: fast"):
        default_settings(2, ("fast",))
    with pytest.raises(ValueError, match="seeds: 0"):
        quick_settings(0)
