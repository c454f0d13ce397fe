from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from paper_results import results
from PIL import Image

from bimvox.paper.experiment.document import document_of
from bimvox.paper.experiment.pictures import pictures_of
from bimvox.paper.experiment.report import report_of


def report(of):
    return report_of(document_of(of), ())


def finding(text: str, number: int, mode: str = "Paper mode") -> str:
    section = text.split(f"### {mode}")[1]
    return next(line for line in section.splitlines() if line.startswith(f"{number}. "))


def test_the_verdicts_follow_the_numbers():
    as_the_paper_says = report(results())
    assert all("**reproduces**" in finding(as_the_paper_says, number) for number in (1, 2, 3))
    assert "Median difference 4,000 steps over 6 seeds; larger in 6, smaller in 0" in finding(as_the_paper_says, 2)
    opposite = report(results(steps_b=2_000, steps_c=1_000, steps_d=6_000))
    assert "**reproduces**" in finding(opposite, 1)
    assert all("**contradicted**" in finding(opposite, number) for number in (2, 3))
    equal = report(results(steps_b=2_000, steps_c=2_000, steps_d=2_000))
    assert all("**not decided by these runs**" in finding(equal, number) for number in (2, 3))
    unlearned = report(results(fails="c"))
    assert "**contradicted**" in finding(unlearned, 1)
    assert "(c) 0%" in finding(unlearned, 1)


def test_finding_2_is_judged_again_on_pairs_that_are_alike():
    text = report(results()).split("## Finding 2 with all else equal")[1].split("##")[0]
    restarts, continues = (line for line in text.splitlines() if line.startswith("- "))
    assert restarts.startswith("- Random actions from 100% on: **not decided by these runs**. Median steps close to")
    assert "the start 1,625, close to the target 1,500; of 6 pairs, 3 are faster close to the target and 2" in restarts
    assert "of 6 pairs, 3 are faster close to the target and 3 slower" in continues


def test_the_modes_stand_side_by_side():
    text = report(results())
    row = next(line for line in text.splitlines() if line.startswith("| (b)") and "our mode" in line)
    assert "| 0 | 6 of 6 | 6 of 6 |" in row
    row = next(line for line in text.splitlines() if line.startswith("| (b)") and "paper mode" in line)
    assert "| 6,250 | 6 of 6 | 0 of 6 |" in row


def test_what_was_not_reached_is_reported_as_more_than_the_budget():
    text = report(results())
    ablation = text.split("## Ablation")[1].split("##")[0]
    assert "| paper | paper | 0 of 1 | > 40,000 | 60.0% |" in ablation
    assert "| window | shaped | 1 of 1 | 9,000 | 100.0% |" in ablation
    beyond = text.split("## Beyond the paper")[1].split("##")[0]
    assert "| 400 | 0 of 1 | > 50,000 |" in beyond
    assert "tabular Q-learning | - | > 100,000 |" in text


def test_the_teacher_is_disclosed():
    text = report(results())
    assert "a teacher, used in training (our mode), never at run time" in text
    assert "paper 0.10 ms" in text


def test_missing_results_are_reported_at_the_top():
    assert "Not complete" not in report(results())
    assert "**Not complete**: 2 results are missing" in report(replace(results(), missing=("x", "y")))


def test_the_report_shows_only_the_pictures_that_are_there():
    document = document_of(results())
    assert "![" not in report_of(document, ())
    assert report_of(document, ("curves.png", "ablation.png")).count("![") == 2


@pytest.mark.slow
def test_the_pictures_are_drawn_and_the_same_twice():
    experiment = results()
    document = document_of(experiment)
    pictures = pictures_of(experiment, document)
    assert sorted(pictures) == ["ablation.png", "curves.png", "policies-ours.png", "policies-paper.png"]
    assert pictures_of(experiment, document) == pictures
    sheet = np.asarray(Image.open(io.BytesIO(pictures["policies-paper.png"])).convert("RGB")).astype(int)
    assert sheet.shape == (960, 1280, 3)
    black = (np.abs(sheet - [52, 52, 56]).max(axis=2) < 30).reshape(2, 480, 2, 640).sum(axis=(1, 3))
    assert black[0, 0] < black.min(where=np.array([[False, True], [True, True]]), initial=10**9)  # (a) has none


def test_a_mode_without_a_whole_set_of_scenarios_has_no_sheet():
    experiment = replace(results(), scenarios=results().scenarios[:3])
    assert sorted(pictures_of(experiment, document_of(experiment))) == ["ablation.png", "curves.png"]
