from __future__ import annotations

from datetime import date
from pathlib import Path

import yaml

from bimvox.policy.generalist.suite import frozen_digests, problem_sets, set_digest
from bimvox.policy.generalist.weights import generalist_record, load_generalist
from bimvox.version import __version__

TOP = Path(__file__).parents[2]


def test_the_citation_is_of_this_version_and_names_the_paper():
    cited = yaml.safe_load((TOP / "CITATION.cff").read_text())
    assert cited["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= set(cited)
    assert (cited["version"], cited["license"]) == (__version__, "Apache-2.0")
    paper = cited["references"][0]
    assert [author["family-names"] for author in paper["authors"]] == ["Zhu", "Pauwels", "Vries"]
    assert isinstance(paper["year"], int) and paper["year"] <= date.today().year


def test_the_model_card_is_short_and_of_the_shipped_network():
    card = (TOP / "docs/model-card.md").read_text()
    assert len(card.split()) <= 350
    record = generalist_record()
    assert record["id"] in card
    assert f"{record['steps']:,} steps" in card
    assert str(load_generalist().layer_sizes[1:-1]) in card


def test_the_data_card_is_of_the_frozen_problems():
    card = (TOP / "docs/data-card.md").read_text()
    digests, known = frozen_digests(), problem_sets()
    assert f"{sum(one.count for one in known.values()):,} problems" in card
    for name, one in known.items():
        digest = f"`{set_digest(digests[name])[:16]}`"
        size, share = f"| {one.count} |", name.removeprefix("wide-trap-")
        assert (f"{share} {digest}" if share != name else f"| `{name}` {size} {digest} |") in card
        assert len(digests[name]) == one.count
    assert {one.count for name, one in known.items() if name.startswith("wide-trap")} == {12}
