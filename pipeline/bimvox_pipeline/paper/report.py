"""What an experiment came to, as a Markdown report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from bimvox_pipeline.paper.findings import SCENARIOS, SIGNIFICANCE, TRIALS_NEEDED
from bimvox_pipeline.paper.pictures import MODE_NAMES, TITLES
from bimvox_pipeline.paper.statistics import CONFIDENCE

REPORT_FILE = "report.md"
_VERDICTS = {
    "reproduces": "**reproduces**",
    "partly": "**reproduces in part**",
    "not decided": "**not decided by these runs**",
    "contradicted": "**does not reproduce** (the opposite, or less than half)",
}


def report_of(document: Mapping[str, Any], pictures: Iterable[str]) -> str:
    """Return the report.

    Args:
        document: As ``document_of`` gives it.
        pictures: Names of the pictures beside it.
    """
    drawn = set(pictures)
    parts = [
        _head(document),
        _findings(document),
        _scenarios(document),
        _picture(drawn, "curves.png", "Success rate against environment steps; bands: interval of the mean over seeds"),
        _picture(drawn, "policies-paper.png", "Policies before and after the change, paper mode"),
        _picture(drawn, "policies-ours.png", "Policies before and after the change, our mode"),
        _initialization(document),
        _ablation(document, drawn),
        _baselines(document),
        _beyond(document),
        _teacher(document),
        _how(document),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _head(document: Mapping[str, Any]) -> str:
    seeds = document["settings"]["seeds"]
    lines = [
        "# The paper's experiments",
        "",
        'A. Zhu, P. Pauwels, B. de Vries, "Automatic Prefabricated Construction Simulation using Deep Reinforcement '
        'Learning", 2021: one column of four voxels on a site of 15 x 15 x 6, four scenarios.',
        "",
        f"{len(seeds)} seeds ({_span(seeds)}) of everything unless it says otherwise. *Paper mode* is the paper's "
        "observation, reward and learner; *our mode* has the egocentric observation and the shaped reward. Deviations "
        "from the paper are numbered in docs/paper.md.",
    ]
    if not document["complete"]:
        lines += ["", f"**Not complete**: {len(document['missing'])} results are missing; run the command again."]
    return "\n".join(lines)


def _findings(document: Mapping[str, Any]) -> str:
    lines = ["## Do the paper's findings reproduce?"]
    for mode, content in document["modes"].items():
        lines += ["", f"### {_name(mode).capitalize()}", ""]
        if not content["findings"]:
            lines.append("No scenario was run.")
        for finding in content["findings"]:
            verdict = _VERDICTS[finding["verdict"]]
            lines.append(f"{finding['number']}. {_sentence(finding['claim'])}: {verdict}. {_numbers(finding)}")
        if content["unplanned"]:
            lines += ["", f"Seeds whose basic policy planned no usable path: {_span(content['unplanned'])}."]
    lines += [
        "",
        "The rules were fixed before any result was seen (`findings.py`): finding 1 needs every seed, "
        f"with at least {TRIALS_NEEDED:.0%} of the trial episodes in (a); findings 2 and 3 compare seed by seed and "
        f"need a median difference of the claimed sign and p < {SIGNIFICANCE} (Wilcoxon, one-sided, exact); what was "
        "not learned counts as one test interval more than the budget.",
    ]
    return "\n".join(lines)


def _numbers(finding: Mapping[str, Any]) -> str:
    if finding["learned"] is not None:
        shares = ", ".join(f"({scenario}) {share:.0%}" for scenario, share in finding["learned"].items())
        return f"Seeds that learned: {shares}."
    test = finding["test"]
    return (
        f"Median difference {test['median_difference']:,.0f} steps over {finding['seeds']} seeds; larger in "
        f"{test['larger']}, smaller in {test['smaller']}; p = {test['p_wilcoxon']:.3f} (Wilcoxon), "
        f"{test['p_sign']:.3f} (sign test)."
    )


def _scenarios(document: Mapping[str, Any]) -> str:
    budgets = ", ".join(
        f"{_name(mode)} {config['retrain_budget']:,}" for mode, config in document["settings"]["modes"].items()
    )
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
                    _name(mode),
                    d["steps_to_success_text"],
                    f"{d['learned']} of {len(d['seeds'])}",
                    f"{d['solved_by_the_loaded_policy']} of {len(d['seeds'])}",
                    f"{_mean(ratios):.2f}" if ratios else "-",
                    f"{_mean(d['random_success']):.1%}",
                    f"{len(tabular)} of {len(d['seeds'])}" + (f", {_median(tabular):,.0f} steps" if tabular else ""),
                ]
            )
    return (
        "## The four scenarios\n\n"
        + _table(
            (
                "scenario",
                "mode",
                "steps to success (median)",
                "learned",
                "without retraining",
                "moves / shortest",
                "random actions",
                "tabular Q-learning",
            ),
            rows,
        )
        + (
            "\n\nSteps of (a) are those of the initialization layer, of (b) to (d) those of retraining the loaded "
            "network (0: the planned path is not hit, or the loaded network gets by). Tabular Q-learning begins from "
            f"nothing, on the layouts that the mode's policy planned on, with the mode's own budget ({budgets} steps)."
        )
    )


def _initialization(document: Mapping[str, Any]) -> str:
    rows = []
    for mode, content in document["modes"].items():
        d = content["initialization"]
        if d["runs"]:
            rows.append(
                [
                    _name(mode),
                    f"{d['reached']} of {d['runs']}",
                    d["steps_to_success_text"],
                    f"{d['most_steps']:,}" if d["most_steps"] is not None else f"> {d['budget']:,}",
                    _rates(d["greedy_rates"]),
                    f"{_median(d['cpu_seconds']):.0f} s",
                ]
            )
    return "## The initialization layer\n\n" + _table(
        (
            "mode",
            "reached 100 %",
            "steps (median)",
            "steps (most)",
            "greedy, from every start (least)",
            "processor time (median)",
        ),
        rows,
    )


def _ablation(document: Mapping[str, Any], drawn: set[str]) -> str:
    cells = document["ablation"]
    if not cells:
        return ""
    rows = [
        [
            cell["observation"],
            cell["reward"],
            f"{cell['reached']} of {cell['runs']}",
            cell["steps_to_success_text"],
            _rates(cell["success_rates"]),
        ]
        for cell in cells
    ]
    table = _table(
        ("observation", "reward", "reached 100 %", "steps (median)", "last success rate (least)"),
        rows,
    )
    text = (
        f"## Ablation: observation x reward\n\nThe paper's learner throughout, one thing changed at a time.\n\n{table}"
    )
    picture = _picture(drawn, "ablation.png", "Steps to 100 %; open bars: more than the budget")
    return f"{text}\n\n{picture}" if picture else text


def _baselines(document: Mapping[str, Any]) -> str:
    d = document["baselines"]
    if not d:
        return ""
    random, tabular = d["random_success"], d["tabular"]
    rows = [
        ["random actions", f"{random['mean']:.1%} ({random['low']:.1%} to {random['high']:.1%})", "-"],
        ["tabular Q-learning", "100 %" if tabular["steps_to_success"] else "-", tabular["steps_to_success_text"]],
        ["down the exact distance field", f"{d['teacher_success']:.0%}", "0"],
    ]
    return "## Baselines of the initialization layer\n\n" + _table(
        ("baseline", f"success from {d['starts']} starts", "environment steps"), rows
    )


def _beyond(document: Mapping[str, Any]) -> str:
    d = document["beyond"]
    rows = []
    for key, what in (
        ("every_start", "every distinct yard start"),
        ("random_targets", "{} layouts with drawn targets"),
        ("frame", "four columns and four beams, {} drawn yards"),
    ):
        cell = d[key]
        if cell["runs"]:
            rows.append(
                [
                    what.format(f"{cell.get('layouts', 0):,}") + ", 100 %",
                    f"{cell['bar_steps']:,}",
                    f"{cell['cleared']} of {cell['runs']}",
                    cell["steps_to_success_text"],
                    _rates(cell["greedy_rates"]),
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
    if not rows:
        return ""
    return (
        "## Beyond the paper, our mode\n\n"
        + _table(
            (
                "what",
                "bar, steps",
                "cleared",
                "steps (median)",
                "greedy success, tests (least)",
                "greedy success, fresh layouts: mean (least)",
            ),
            rows,
        )
        + "\n\nSteps are summed over all sites stepped side by side. Greedy success is plain argmax, without guard or "
        "search. Tests decide when training stops; the fresh layouts were drawn for each seed after that, and decided "
        "nothing. Every start of the paper's site is tested, so that there are no fresh ones."
    )


def _fresh(cell: Mapping[str, Any]) -> str:
    rates = [rate for rate in cell["fresh_rates"] if rate is not None]
    if not rates:
        return "-"
    perfect = sum(rate == 1.0 for rate in rates)
    return f"{_mean(rates):.2%} ({min(rates):.1%}); all {cell['fresh_layouts']:,} in {perfect} of {len(rates)}"


def _teacher(document: Mapping[str, Any]) -> str:
    d = document["teacher"]
    seconds = ", ".join(f"{name} {1e3 * value:.2f} ms" for name, value in d["field_seconds"].items())
    return "\n".join(
        [
            "## What the policy adds, and what it does not",
            "",
            "The shaped reward is the exact distance field of the training site: a teacher, used in training "
            f"({', '.join(_name(mode) for mode in d['used_in_training_by']) or 'no mode'}), never at run time, and in "
            "no observation. Its cost: one breadth-first pass a site" + (f" ({seconds})." if seconds else "."),
            "",
            "On a known map that field already solves every layout, without a single environment step: no learner here "
            "beats it, and bimvox plans with an exact search as its guarantee. What the policy adds is that it decides "
            "from what it sees around it: the same weights get by where starts, targets and obstructions are others "
            "than those trained on, without a pass over the map. What it does not add is a guarantee: a roll-out is "
            "checked move by move, and the search answers where it fails.",
        ]
    )


def _how(document: Mapping[str, Any]) -> str:
    settings = document["settings"]
    return "\n".join(
        [
            "## How this was measured",
            "",
            f"`bimvox experiment paper --seeds {len(settings['seeds'])}` makes this folder. Medians count what was not "
            f"reached as longer than everything that was; bands and brackets are {CONFIDENCE:.0%} intervals of the "
            "mean by Student's t. Every test of every run is in curves.csv, every figure here in results.json. "
            "Processor times depend on the machine, steps do not.",
        ]
    )


def _picture(drawn: set[str], name: str, text: str) -> str:
    return f"![{text}]({name})" if name in drawn else ""


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def _name(mode: str) -> str:
    return MODE_NAMES.get(mode, mode)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _span(seeds: Sequence[int]) -> str:
    """Return numbers in words: a range where they are one."""
    if len(seeds) > 2 and list(seeds) == list(range(seeds[0], seeds[-1] + 1)):
        return f"{seeds[0]} to {seeds[-1]}"
    return ", ".join(str(seed) for seed in seeds)


def _rates(rates: Sequence[float | None]) -> str:
    known = [rate for rate in rates if rate is not None]
    return f"{min(known):.1%}" if known else "-"


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


def _median(values: Sequence[float]) -> float:
    ordered = sorted(values)
    half = len(ordered) // 2
    return float(ordered[half]) if len(ordered) % 2 else (ordered[half - 1] + ordered[half]) / 2
