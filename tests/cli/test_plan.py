"""What the summary of a plan says."""

from bimvox_cli.plan import figure_fields, first_line

FIGURES = {
    "planned": 2,
    "moves": 10,
    "moves_over_shortest": 1.0,
    "crane_hours": 2.03,
    "loaded_hours": 0.13,
    "shares": {"search": 1.0},
    "hook_travel_m": 220.0,
    "critical_lifts": 0,
    "critical_share": 0.75,
    "swing": None,
}


def test_crane_time_has_the_format_of_elapsed_time() -> None:
    assert dict(figure_fields(FIGURES))["crane time"] == "2:01:48, 0:07:48 of it loaded"


def test_hire_is_told_in_days_if_it_is_known() -> None:
    assert dict(figure_fields(FIGURES))["hire"] is None
    said = [dict(figure_fields(FIGURES | {"hire_days": days}))["hire"] for days in (1, 12)]
    assert [str(one).split(" of ")[0] for one in said] == ["1 day", "12 days"]


def test_the_first_line_names_what_the_crane_carries_and_is_refused_nevertheless() -> None:
    refused = {"name": "Stair 2", "component": "2O2", "is_carried": True}
    heavy = {"name": "Block", "component": "2O3", "is_carried": False}
    document = {"verified": True, "remarks": [], "infeasible": [refused, heavy]}
    said = str(first_line(document, 28, 0))
    assert said.startswith("28 of 30 lifts planned")
    assert "the crane carries 29" in said
    assert "Stair 2" in said
    assert "Block" not in said
    assert "carries" not in str(first_line(document | {"infeasible": [heavy]}, 28, 0))
