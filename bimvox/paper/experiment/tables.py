"""The tables of an experiment's report, as Markdown; empty text for a part that was not run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import fmean, median
from typing import Any

from bimvox.paper.experiment.names import SCENARIOS, TITLES, mode_name


def scenario_table(document: Mapping[str, Any]) -> str:
    """Return the table of the four scenarios."""
    rows = []
    for scenario in SCENARIOS:
        for mode, content in document["modes"].items():
            d = content["scenarios"][scenario]
            if not d["seeds"]:
                continue
            ratios = [s["moves"] / s["shortest_moves"] for s in d["seeds"] if s["moves"] and s["shortest_moves"]]
            tabular = [steps for steps in d["tabular_steps"] if steps is not None]
            rows.append(
                [
                    TITLES[scenario],
                    mode_name(mode),
                    d["steps_to_success_text"],
                    f"{d['learned']} of {len(d['seeds'])}",
                    f"{d['solved_by_the_loaded_policy']} of {len(d['seeds'])}",
                    f"{fmean(ratios):.2f}" if ratios else "-",
                    f"{fmean(d['random_success']):.1%}",
                    f"{len(tabular)} of {len(d['seeds'])}" + (f", {median(tabular):,.0f} steps" if tabular else ""),
                ]
            )
    head = (
        "scenario",
        "mode",
        "steps to success (median)",
        "learned",
        "without retraining",
        "moves / shortest",
        "random actions",
        "tabular Q-learning",
    )
    return _table(head, rows)


def initialization_table(document: Mapping[str, Any]) -> str:
    """Return the table of the initialization layer."""
    rows = []
    for mode, content in document["modes"].items():
        d = content["initialization"]
        if d["runs"]:
            rows.append(
                [
                    mode_name(mode),
                    f"{d['reached']} of {d['runs']}",
                    d["steps_to_success_text"],
                    f"{d['most_steps']:,}" if d["most_steps"] is not None else f"> {d['budget']:,}",
                    _least(d["greedy_rates"]),
                    f"{median(d['cpu_seconds']):.0f} s",
                ]
            )
    head = (
        "mode",
        "reached 100 %",
        "steps (median)",
        "steps (most)",
        "greedy, from every start (least)",
        "processor time (median)",
    )
    return _table(head, rows)


def ablation_table(document: Mapping[str, Any]) -> str:
    """Return the table of the ablation."""
    rows = [
        [
            cell["observation"],
            cell["reward"],
            f"{cell['reached']} of {cell['runs']}",
            cell["steps_to_success_text"],
            _least(cell["success_rates"]),
        ]
        for cell in document["ablation"]
    ]
    head = ("observation", "reward", "reached 100 %", "steps (median)", "last success rate (least)")
    return _table(head, rows) if rows else ""


def baseline_table(document: Mapping[str, Any]) -> str:
    """Return the table of the baselines."""
    d = document["baselines"]
    if not d:
        return ""
    random, tabular = d["random_success"], d["tabular"]
    rows = [
        ["random actions", f"{random['mean']:.1%} ({random['low']:.1%} to {random['high']:.1%})", "-"],
        ["tabular Q-learning", "100 %" if tabular["steps_to_success"] else "-", tabular["steps_to_success_text"]],
        ["descending the exact distance field", f"{d['teacher_success']:.0%}", "0"],
    ]
    return _table(("baseline", f"success from {d['starts']} starts", "environment steps"), rows)


def beyond_table(document: Mapping[str, Any]) -> str:
    """Return the table of what goes beyond the paper."""
    d = document["beyond"]
    rows = []
    for key, name in (
        ("every_start", "every distinct yard start"),
        ("random_targets", "{} layouts with drawn targets"),
        ("frame", "four columns and four beams, {} drawn yards"),
    ):
        cell = d[key]
        if cell["runs"]:
            rows.append(
                [
                    name.format(f"{cell.get('layouts', 0):,}") + ", 100 %",
                    f"{cell['bar_steps']:,}",
                    f"{cell['cleared']} of {cell['runs']}",
                    cell["steps_to_success_text"],
                    _least(cell["greedy_rates"]),
                    _fresh(cell),
                ]
            )
    changed = d["changed_sites"]
    if changed["runs"]:
        rows.append(
            [
                "(b), (c), (d) solved",
                f"{changed['bar_steps']:,}",
                f"{changed['cleared']} of {changed['runs']}",
                f"{changed['by_the_loaded_policy']} without retraining",
                "-",
                "-",
            ]
        )
    head = (
        "what",
        "bar, steps",
        "cleared",
        "steps (median)",
        "greedy success, tests (least)",
        "greedy success, fresh layouts: mean (least)",
    )
    return _table(head, rows) if rows else ""


def _fresh(cell: Mapping[str, Any]) -> str:
    rates = [rate for rate in cell["fresh_rates"] if rate is not None]
    if not rates:
        return "-"
    perfect = sum(rate == 1.0 for rate in rates)
    return f"{fmean(rates):.2%} ({min(rates):.1%}); all {cell['fresh_layouts']:,} in {perfect} of {len(rates)}"


def _least(rates: Sequence[float | None]) -> str:
    known = [rate for rate in rates if rate is not None]
    return f"{min(known):.1%}" if known else "-"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])
