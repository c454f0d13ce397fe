from planned_sites import portal_crane, portal_site

from bimvox.library.prove import overlap_note, plan_and_prove, prepared
from bimvox.policy.choice import NO_POLICY
from bimvox.progress import SilentProgress
from bimvox.proof import values
from bimvox.proof.values import check_values
from bimvox.records.lift import ModelledClash


def test_overlapping_parts_are_named_before_their_ids():
    clashes = (ModelledClash("1aB", "2cD", 0.25, None), ModelledClash("1aB", "wall", 0.5, None))
    names = {"1aB": "Column A1 (1aB)", "2cD": "Beam (2cD)"}
    assert overlap_note(clashes, names).startswith(
        "2 pairs of parts overlap in the model, by at most 0.500 m (Column A1 (1aB) and wall)"
    )
    assert "1 pair of parts overlaps" in overlap_note(clashes[:1], names)


def test_the_values_of_the_parts_are_checked_once(monkeypatch):
    site, quiet, seen = portal_site(portal_crane()), SilentProgress(), []
    check = values._check_component
    monkeypatch.setattr(values, "_check_component", lambda *given: (seen.append(given[1].id), check(*given)))
    made = plan_and_prove(site, prepared(site, quiet)[1], NO_POLICY, progress=quiet)
    assert sorted(seen) == sorted(component.id for component in site.components)
    whole = check_values(made.plan, made.motions)
    assert made.verdict.checks[0] == whole, "with the values of the motions"
