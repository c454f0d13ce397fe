"""``python -m benchmarks.sequence``: the results of ``Sequence-v0``, docs/data/sequence.json and docs/sequence-v0.md.

Without arguments it compares the page with the data. ``--run ORDER`` scores an order and puts it into both;
``--add FILE`` does so with the document of ``bimvox experiment sequence --json``; ``--freeze`` writes the digests.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from bimvox_pipeline.sequence import all_problems, score_sequence

from benchmarks.document import put_into
from bimvox.library.sequences.score import SequenceScore
from bimvox.library.sequences.suite import FROZEN, digest_of, frozen_digests
from bimvox.progress import SilentProgress

_DOCS = Path(__file__).parents[1] / "docs"
DATA, PAGE = _DOCS / "data" / "sequence.json", _DOCS / "sequence-v0.md"
_MARK = "bench-sequence"


def main() -> int:
    """Compare, extend or freeze."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", action="append", default=[], metavar="ORDER", help="score an order")
    parser.add_argument("--add", action="append", default=[], type=Path, metavar="FILE", help="add a score")
    parser.add_argument("--freeze", action="store_true", help=f"write {FROZEN.name} of the package")
    chosen = parser.parse_args()
    if chosen.freeze:
        FROZEN.write_text(frozen_text())
        frozen_digests.cache_clear()
    scores = [score_sequence(order, progress=SilentProgress()) for order in chosen.run]
    scores += [json.loads(file.read_text()) for file in chosen.add]
    if scores:
        DATA.write_text(extended(json.loads(DATA.read_text()) if DATA.exists() else {}, scores))
        put_into(PAGE, _MARK, table(json.loads(DATA.read_text())))
    same = is_true()
    sys.stdout.write(f"{PAGE.name}: {'as' if same else 'NOT as'} {DATA.name}\n")
    return 0 if same else 1


def frozen_text() -> str:
    """Return the content of the frozen file, made anew from the generators."""
    digests = {problem.name: digest_of(problem.site()) for each in all_problems().values() for problem in each}
    return json.dumps({"format": "bimvox-sequence-suite", "version": 0, "digests": digests}, indent=1) + "\n"


def extended(known: dict[str, Any], scores: list[dict[str, Any]]) -> str:
    """Return the data with more scores; one of the same order takes the place of the earlier one.

    Raises:
        ValueError: A score is not of the frozen buildings, or not a score.
    """
    for score in scores:
        checked = SequenceScore.model_validate(score)
        wrong = [one.problem for one in checked.buildings if frozen_digests().get(one.problem) != one.digest]
        if wrong:
            raise ValueError(f"{checked.order}: not scored on the frozen {', '.join(wrong)}")
        known[checked.order] = checked.model_dump(mode="json")
    return json.dumps(known, indent=1) + "\n"


def table(data: dict[str, Any]) -> str:
    """Return the table of the page: crane hours of each building, by order."""
    orders = {name: {one["problem"]: one for one in score["buildings"]} for name, score in data.items()}
    least = {one["problem"]: one for each in orders.values() for one in each.values()}
    names = [name for name in frozen_digests() if name in least]
    lines = [f"| building | lifts | least h | {' | '.join(orders)} |", f"|---|---|---|{'---|' * len(orders)}"]
    for name in names:
        cells = " | ".join(_cell(each.get(name)) for each in orders.values())
        lines.append(f"| `{name}` | {least[name]['lifts']} | {least[name]['least_s'] / 3600.0:.3f} | {cells} |")
    ratios = [
        f"{score['ratio']:.4f} ({score['solved']} of {len(score['buildings'])})" if score["ratio"] else "-"
        for score in data.values()
    ]
    return "\n".join([*lines, f"| mean ratio to the least (solved) | | | {' | '.join(ratios)} |"])


def _cell(one: dict[str, Any] | None) -> str:
    if one is None:
        return "-"
    if one["makespan_s"] is None:
        return f"{one['proven']} of {one['lifts']} proven"
    return f"{one['makespan_s'] / 3600.0:.3f}"


def is_true() -> bool:
    """Return whether the page has the table of the data, of the frozen buildings."""
    data = json.loads(DATA.read_text())
    extended({}, list(data.values()))
    return table(data) in PAGE.read_text()


if __name__ == "__main__":
    sys.exit(main())
