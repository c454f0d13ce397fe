"""What a log claims and a proof did not prove, by what was given to the proof."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
import seeded_faults as faults

from bimvox.library.claims import CLAIMS, claims_of
from bimvox.log.plan_log import PlanLog
from bimvox.records.proof import Check, Claim
from bimvox.site.config.rules import RulesConfig
from bimvox.site.site import HeadingRule, Rules

EVERY_LOG = {"model", "site", "obstructions", "fewest_moves", "last_moves", "how_found"}


@pytest.fixture(scope="module")
def good() -> PlanLog:
    return faults.good_log()


def claims(log: PlanLog, *bound: str, checks: tuple[Check, ...] = ()) -> dict[str, Claim]:
    return {claim.name: claim for claim in claims_of(log, checks, bound)}


def with_rules(log: PlanLog, rules: Rules) -> PlanLog:
    site = dataclasses.replace(log.plan.site, rules=rules)
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))


def with_a_lift(log: PlanLog, **changes: object) -> PlanLog:
    first, *rest = log.plan.lifts
    lifts = (dataclasses.replace(first, **changes), *rest)
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, lifts=lifts))


def test_what_is_given_takes_its_claims_away(good):
    log = with_rules(good, RulesConfig().rules(has_crane=True))
    assert claims(log).keys() == EVERY_LOG
    assert claims(log, "--site").keys() == EVERY_LOG - {"model", "site"}
    assert claims(log, "--obstructions").keys() == EVERY_LOG - {"obstructions"}
    assert claims(log, "--search").keys() == EVERY_LOG - {"fewest_moves"}
    assert claims(log, "--site", "--obstructions", "--search").keys() == {"last_moves", "how_found"}


def test_rules_below_the_defaults_are_named_and_counted(good):
    rules = dataclasses.replace(RulesConfig().rules(has_crane=True), transit_clearance_m=0.5, highest_utilisation=1.0)
    found = claims(with_rules(good, dataclasses.replace(rules, support_gap_m=0.2)))["weaker_rules"]
    assert found.count == 2
    assert "transit_clearance_m = 0.5 (default: 2)" in found.text
    assert "support_gap_m = 0.2 (default: 0.05)" in found.text


def test_a_lift_that_gives_way_is_named(good):
    found = claims(with_a_lift(good, clearance_m=0.5))["gives_way"]
    assert (found.count, found.bind_with) == (1, "--search")
    assert found.text.endswith(": left")
    assert "gives_way" not in claims(with_a_lift(good, clearance_m=0.5), "--search")


def test_a_load_that_keeps_its_heading_where_loads_turn_is_named(good):
    turning = with_rules(good, dataclasses.replace(good.plan.site.rules, heading=HeadingRule.WITH_JIB))
    assert claims(turning)["kept_heading"].count == 4
    assert claims(with_a_lift(turning, with_jib=True))["kept_heading"].count == 3
    assert "kept_heading" not in claims(good)


def test_what_the_search_could_not_decide_stays_a_claim(good):
    check = Check("search", undecided=["lift 2 (beam): the search takes other last moves"])
    assert claims(good, "--search", checks=(check,))["undecided"].count == 1


def test_extracts_watches_and_recovered_logs_claim_more(good):
    assert claims(good.extract([0, 1]))["extract"].count == 2
    assert "recovered" in claims(dataclasses.replace(good, recovered=True))
    assert "revisions" in claims(dataclasses.replace(good, metadata={**good.metadata, "first_plan": "0"}))


def test_a_claim_is_written_with_its_count_only_if_it_has_one(good):
    assert claims(good)["obstructions"].to_dict() == {
        "name": "obstructions",
        "text": "no obstruction is missing",
        "bind_with": "--obstructions",
    }
    assert claims(good.extract([0]))["extract"].to_dict()["count"] == 3


def test_options_that_bind_a_claim_are_options_of_verify():
    source = (Path(__file__).parents[2] / "cli" / "bimvox_cli" / "verify.py").read_text()
    for option in {row.bind_with for row in CLAIMS} - {None}:
        assert f'"{option}"' in source or f"    {option.removeprefix('--')}: Annotated" in source
