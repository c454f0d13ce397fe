"""The page of the checks has every check that the program can make, and no other."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from bimvox.library.claims import CLAIMS
from bimvox.proof.at_rest import REST_MARGIN, YARD_MARGIN
from bimvox.proof.clearance import MOTION_MARGIN
from bimvox.proof.flip import FLIP
from bimvox.proof.motion import CRANES_UNITS, UNITS
from bimvox.proof.plan import CHECKS
from bimvox.proof.tandem import TANDEM, TOGETHER

ROOT = Path(__file__).parents[2]
ASKED_FOR = (MOTION_MARGIN, FLIP, TANDEM, TOGETHER, REST_MARGIN, YARD_MARGIN)
ROOMS = ("proof", "log", "library", "remarks")
NAMED_ELSEWHERE = {"plan.py", "motion.py", "values.py", "over_time.py"}
"""Modules of the proof whose checks are named in the three tables above, or by another check."""


def made() -> Iterator[tuple[Path, ast.expr]]:
    """Every ``Check(name)`` of the rooms that make checks, with its name as written."""
    for room in ROOMS:
        for file in sorted((ROOT / "bimvox" / room).rglob("*.py")):
            for node in ast.walk(ast.parse(file.read_text())):
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Check":
                    yield file, node.args[0]


def test_every_check_and_no_other_is_on_the_page() -> None:
    named = {name.value for _, name in made() if isinstance(name, ast.Constant)}
    rows = re.findall(r"^- `([a-z_]+)`: ", (ROOT / "docs" / "checks.md").read_text(), re.MULTILINE)
    assert sorted(rows) == sorted(named | set(CHECKS) | set(UNITS) | set(CRANES_UNITS) | set(ASKED_FOR))


def test_every_claim_and_no_other_is_on_the_page() -> None:
    page = (ROOT / "docs" / "checks.md").read_text()
    rows = re.findall(r"^\| `([a-z_]+)` \| (.*) \| (?:nothing|`(--[a-z]+)`) \|$", page, re.MULTILINE)
    assert rows == [(claim.name, claim.text, claim.bind_with or "") for claim in CLAIMS]


def test_checks_get_their_names_where_this_test_looks() -> None:
    computed = {file.name for file, name in made() if not isinstance(name, ast.Constant)}
    assert computed <= NAMED_ELSEWHERE


def test_readme_and_architecture_link_the_page() -> None:
    for page in ("README.md", "ARCHITECTURE.md"):
        assert "(docs/verified.md)" in (ROOT / page).read_text()
