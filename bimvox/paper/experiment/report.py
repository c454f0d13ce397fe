"""The Markdown report of an experiment, with its tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from statistics import fmean, median
from typing import Any

from bimvox.paper.experiment.findings import CONFIDENCE, SIGNIFICANCE, TRIALS_NEEDED
from bimvox.paper.experiment.jobs import SCENARIOS, TITLES, mode_name


def _scenario_table(document: Mapping[str, Any]) -> str:
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


def _initialization_table(document: Mapping[str, Any]) -> str:
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


def _ablation_table(document: Mapping[str, Any]) -> str:
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


def _baseline_table(document: Mapping[str, Any]) -> str:
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


def _beyond_table(document: Mapping[str, Any]) -> str:
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


_VERDICTS = {
    "reproduces": "**reproduces**",
    "partly": "**reproduces in part**",
    "not decided": "**not decided by these runs**",
    "contradicted": "**contradicted**",
}


def report_of(document: Mapping[str, Any], pictures: Iterable[str]) -> str:
    """Return the report of a document of ``document_of``, with the pictures of these file names in the same folder."""
    drawn = set(pictures)
    parts = [
        _head(document),
        _findings(document),
        _scenarios(document),
        _picture(drawn, "curves.png", "Success rate against environment steps; bands: interval of the mean over seeds"),
        _matched(document),
        *(
            _picture(drawn, f"policies-{mode}.png", f"Policies before and after the change, {mode_name(mode)}")
            for mode in document["modes"]
        ),
        "## The initialization layer\n\n" + _initialization_table(document),
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
        f"{len(seeds)} seeds ({_span(seeds)}) of everything unless stated otherwise. *Paper mode* has the paper's "
        "observation, reward and learner; *our mode* has the egocentric observation and the shaped reward. "
        "docs/paper.md numbers the deviations from the paper.",
    ]
    if not document["complete"]:
        lines += ["", f"**Not complete**: {len(document['missing'])} results are missing; run the command again."]
    return "\n".join(lines)


def _findings(document: Mapping[str, Any]) -> str:
    lines = ["## Do the paper's findings reproduce?"]
    for mode, content in document["modes"].items():
        lines += ["", f"### {mode_name(mode).capitalize()}", ""]
        if not content["findings"]:
            lines.append("No scenario was run.")
        for finding in content["findings"]:
            verdict = _VERDICTS[finding["verdict"]]
            lines.append(f"{finding['number']}. {_sentence(finding['claim'])}: {verdict}. {_numbers(finding)}")
        if content["unplanned"]:
            lines += ["", f"Seeds whose basic policy planned no usable path: {_span(content['unplanned'])}."]
    lines += [
        "",
        "The rules were fixed before any result was seen (`findings.py`). Finding 1 needs every seed, "
        f"with at least {TRIALS_NEEDED:.0%} of the trial episodes in (a). Findings 2 and 3 compare seed by seed and "
        f"need a median difference of the claimed sign and p < {SIGNIFICANCE} (Wilcoxon, one-sided, exact). A scenario "
        "that was not learned counts as one test interval more than the budget.",
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
    modes = document["settings"]["modes"].items()
    budgets = ", ".join(f"{mode_name(mode)} {config['retrain_budget']:,}" for mode, config in modes)
    return (
        "## The four scenarios\n\n"
        + _scenario_table(document)
        + "\n\nThe steps of (a) are those of the initialization layer; of (b) to (d), those of retraining the loaded "
        "network (0: nothing blocks the planned path, or the loaded network succeeds). Tabular Q-learning starts from "
        "scratch, on the layouts on which the mode's policy planned, with the mode's own budget "
        f"({budgets} steps)."
    )


def _matched(document: Mapping[str, Any]) -> str:
    judged = document["matched"]
    if not judged:
        return ""
    lines = [
        "## Finding 2 with all else equal",
        "",
        "(b) and (d) differ in the detour that they force, and in whether the loaded network already copes. In these "
        "pairs the start is in line with the target, both obstructions force the same detour, and the loaded network "
        f"copes with neither. Paper mode, tests every {judged[0]['test_every']} steps.",
        "",
    ]
    for d in judged:
        finding, pairs = d["finding"], d["pairs"]
        faster, slower = (
            sum(_steps(pair, one) < _steps(pair, other) for pair in pairs)
            for one, other in (("far", "near"), ("near", "far"))
        )
        lines.append(
            f"- Random actions from {d['exploration']:.0%} on: {_VERDICTS[finding['verdict']]}. Median steps close to "
            f"the start {d['near']}, close to the target {d['far']}; of {len(pairs)} pairs, {faster} are faster close "
            f"to the target and {slower} slower. Per seed: {_numbers(finding)}"
        )
    return "\n".join(lines)


def _steps(pair: Mapping[str, Any], end: str) -> float:
    steps = pair[f"{end}_steps"]
    return math.inf if steps is None else float(steps)


def _ablation(document: Mapping[str, Any], drawn: set[str]) -> str:
    table = _ablation_table(document)
    if not table:
        return ""
    text = f"## Ablation: observation x reward\n\nThe paper's learner, with one choice changed at a time.\n\n{table}"
    picture = _picture(drawn, "ablation.png", "Steps to 100 %; open bars: more than the budget")
    return f"{text}\n\n{picture}" if picture else text


def _baselines(document: Mapping[str, Any]) -> str:
    table = _baseline_table(document)
    return "## Baselines of the initialization layer\n\n" + table if table else ""


def _beyond(document: Mapping[str, Any]) -> str:
    table = _beyond_table(document)
    if not table:
        return ""
    return (
        "## Beyond the paper, our mode\n\n"
        + table
        + "\n\nSteps are summed over all sites stepped in parallel. Greedy success is plain argmax, without guard or "
        "search. Tests decide when training stops. The fresh layouts were drawn for each seed after that and decided "
        "nothing. Every start of the paper's site is tested, so it has no fresh ones."
    )


def _teacher(document: Mapping[str, Any]) -> str:
    d = document["teacher"]
    seconds = ", ".join(f"{name} {1e3 * value:.2f} ms" for name, value in d["field_seconds"].items())
    return "\n".join(
        [
            "## What the policy adds, and what it does not",
            "",
            "The shaped reward is the exact distance field of the training site: a teacher, used in training "
            f"({', '.join(mode_name(mode) for mode in d['used_in_training_by']) or 'no mode'}), never at run time, and "
            "in no observation. It costs one breadth-first pass per site" + (f" ({seconds})." if seconds else "."),
            "",
            "On a known map the field already solves every layout, without a single environment step: no learner here "
            "beats it, and bimvox plans with an exact search as its guarantee. The policy decides from what it sees "
            "around it, without a pass over the map. So the same weights work with starts, targets and obstructions "
            "that training did not have. The policy adds no guarantee: every roll-out is checked move by move, and the "
            "search answers if it fails.",
        ]
    )


def _how(document: Mapping[str, Any]) -> str:
    settings = document["settings"]
    return "\n".join(
        [
            "## How this was measured",
            "",
            f"`bimvox experiment paper --seeds {len(settings['seeds'])}` makes this folder. In medians, a run that did "
            f"not succeed counts as longer than all that did. Bands and brackets are {CONFIDENCE:.0%} intervals of the "
            "mean by Student's t. curves.csv has every test of every run, results.json every figure of this page. "
            "Processor times depend on the machine; steps do not.",
        ]
    )


def _picture(drawn: set[str], name: str, text: str) -> str:
    return f"![{text}]({name})" if name in drawn else ""


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _span(seeds: Sequence[int]) -> str:
    """Return numbers as text: as a range if they are one."""
    if len(seeds) > 2 and list(seeds) == list(range(seeds[0], seeds[-1] + 1)):
        return f"{seeds[0]} to {seeds[-1]}"
    return ", ".join(str(seed) for seed in seeds)
