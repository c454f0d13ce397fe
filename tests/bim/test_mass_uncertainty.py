"""How wrong a mass may be."""

from __future__ import annotations

import pytest

from bimvox.bim.building import ASSUMED, mass_uncertainty


@pytest.mark.parametrize(
    ("source", "volume_guessed", "share"),
    [
        ("quantity", False, 0.03),
        ("quantity", True, 0.03),
        ("density", False, 0.1),
        ("density", True, 0.4),
        ("default", False, ASSUMED),
        ("default", True, 0.4),
        ("", False, ASSUMED),
    ],
)
def test_the_share_follows_the_source(source: str, volume_guessed: bool, share: float) -> None:
    assert mass_uncertainty(source, volume_guessed) == share
