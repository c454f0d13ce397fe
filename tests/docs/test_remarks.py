"""The page of remarks has every remark that the program can make, with how much it matters."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

from bimvox.records.proof import Severity
from bimvox.remarks import table

PAGE = Path(__file__).parents[2] / "docs" / "remarks.md"


def test_every_remark_and_no_other_is_on_the_page_with_its_severity() -> None:
    made: dict[str, set[Severity]] = defaultdict(set)
    for row in vars(table).values():
        if isinstance(row, table.Row):
            made["assumed_..." if row.code.startswith("assumed_") else row.code].add(row.severity)
    rows = re.findall(r"^\| (`[^|]+`) \| .* \| ([a-z ]+) \|$", PAGE.read_text("utf-8"), re.MULTILINE)
    told = {code: severity for codes, severity in rows for code in re.findall(r"`([^`]+)`", codes)}
    order = list(Severity)
    assert told == {
        code: " or ".join(one.value for one in sorted(severities, key=order.index)) for code, severities in made.items()
    }
