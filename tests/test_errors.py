"""The words of messages."""

from __future__ import annotations

import pytest

from bimvox.errors import enumerated


@pytest.mark.parametrize(
    ("words", "said"), [([], ""), (["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")]
)
def test_words_are_enumerated_as_in_a_sentence(words: list[str], said: str) -> None:
    assert enumerated(words) == said
