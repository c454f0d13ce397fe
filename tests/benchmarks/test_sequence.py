import json
from copy import deepcopy

import pytest

from benchmarks.sequence import DATA, extended, is_true, table

RESULTS = json.loads(DATA.read_text())


def test_the_page_has_the_table_of_the_data():
    assert is_true()
    assert list(RESULTS) == ["trade", "greedy", "search", "exact"]


def test_no_order_is_faster_than_the_bound():
    for one in (one for score in RESULTS.values() for one in score["buildings"]):
        assert one["makespan_s"] is None or one["makespan_s"] > one["least_s"]


def test_a_score_is_added_and_replaces_the_one_before():
    mine = {**deepcopy(RESULTS["trade"]), "order": "mine:order"}
    more = json.loads(extended(deepcopy(RESULTS), [mine, mine]))
    assert list(more) == [*RESULTS, "mine:order"]
    assert "| mine:order |" in table(more)


def test_a_score_of_other_buildings_is_refused():
    mine = deepcopy(RESULTS["trade"])
    mine["buildings"][0]["digest"] = "0" * 16
    with pytest.raises(ValueError, match="trade: not scored on the frozen small-0"):
        extended({}, [mine])
