"""The words of messages."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bimvox.errors import enumerated, shown


@pytest.mark.parametrize(
    ("words", "said"), [([], ""), (["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")]
)
def test_words_are_enumerated_as_in_a_sentence(words: list[str], said: str) -> None:
    assert enumerated(words) == said


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ((np.int32(17), np.int64(3)), "(17, 3)"),
        (np.float64(0.5), "0.5"),
        (np.array([1, 2], np.int16), "[1, 2]"),
        ([(np.uint8(1), "a")], "[(1, 'a')]"),
        (np.str_("a"), "'a'"),
        (b"a", "b'a'"),
    ],
)
def test_numbers_are_shown_as_people_write_them(value: object, said: str) -> None:
    assert shown(value) == said


def test_no_message_shows_the_numbers_of_an_array_raw() -> None:
    """``f"{tuple(cell)}"`` of an array is ``(np.int32(17), ...)``: its ``tolist()`` or ``shown`` is what is meant."""
    raw = []
    for room in ("bimvox", "pipeline", "cli"):
        for file in (Path(__file__).parents[1] / room).rglob("*.py"):
            text = file.read_text(encoding="utf-8")
            if "{tuple(" in text or "{list(" in text:
                raw += [f"{file.name}:{line}" for line in _raw_tuples(ast.parse(text))]
    assert raw == []


def _raw_tuples(tree: ast.AST) -> Iterator[int]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FormattedValue) and isinstance(node.value, ast.Call):
            said = ast.unparse(node.value)
            if said.startswith(("tuple(", "list(")) and "tolist()" not in said and " for " not in said:
                yield node.lineno
