import pytest
from bimvox_pipeline.schema import schema
from bimvox_pipeline.sequence import all_problems, score_sequence

from bimvox.errors import InputError
from bimvox.library.sequences.suite import frozen_digests, frozen_site
from bimvox.progress import SilentProgress


@pytest.mark.parametrize(
    ("order", "sets", "said"),
    [
        ("fastest", (), "fastest: there is no such order"),
        ("trade", ("towers",), "--set towers: there is no such set"),
        ("json:decoder", ("small",), "json:decoder: not a function"),
    ],
)
def test_unknown_orders_and_sets_are_refused(order, sets, said):
    with pytest.raises(InputError, match=said) as caught:
        score_sequence(order, sets=sets, progress=SilentProgress())
    assert caught.value.hint


def test_the_problems_are_those_with_a_digest():
    assert [one.name for each in all_problems().values() for one in each] == list(frozen_digests())


@pytest.mark.slow
def test_the_sample_building_is_the_frozen_one():
    (sample,) = all_problems()["samples"]
    assert len(frozen_site(sample).components) > 130


def test_an_order_of_the_caller_is_scored(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_order.py").write_text(
        "def upwards(parts):\n    return [p.id for p in sorted(parts, key=lambda p: (round(p.target_m[2]), p.id))]\n"
    )
    document = score_sequence("my_order.py:upwards", sets=["small"], progress=SilentProgress())
    assert (document["order"], document["solved"]) == ("my_order.py:upwards", 3)
    assert set(document) == set(schema("sequence-score")["properties"])
