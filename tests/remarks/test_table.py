from __future__ import annotations

import ast
import string
from pathlib import Path

from bimvox.remarks import table

ROWS = {name: row for name, row in vars(table).items() if isinstance(row, table.Row)}


def calls() -> dict[str, set[str]]:
    """Return the values that the rules fill into each sentence; every mention of a row counts as a use."""
    found: dict[str, set[str]] = {}
    for path in Path(table.__file__).parent.glob("*.py"):
        tree = ast.parse(path.read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and getattr(node.value, "id", "") == "table":
                found.setdefault(node.attr, set())
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and getattr(getattr(node.func, "value", None), "id", "") == "table":
                found[node.func.attr] |= {str(keyword.arg) for keyword in node.keywords}
    return found


def test_every_sentence_is_used_and_is_given_what_it_names() -> None:
    used = calls()
    assert set(used) - {"Row"} == set(ROWS)
    for name, values in used.items():
        named = {field for _, field, _, _ in string.Formatter().parse(ROWS[name].sentence) if field}
        assert not values or values == named, name
