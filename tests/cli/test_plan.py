"""What the summary of a plan says."""

from bimvox_cli.plan import figure_fields

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
