"""Questions that readers ask, and the section in which each finds its answer in less than a minute."""

from __future__ import annotations

import re
from typing import NamedTuple

import pytest
from doc_commands import DOCUMENTS, ROOT, name_of
from doc_sections import sections_of


class Question(NamedTuple):
    """What somebody wants to know.

    Attributes:
        asks: planner or researcher.
        question: In the reader's words.
        page: Where the answer stands, below ``docs``.
        anchor: Of the section.
        answer: Words of the answer.
    """

    asks: str
    question: str
    page: str
    anchor: str
    answer: tuple[str, ...]


QUESTIONS = (
    Question(
        "planner",
        "The plan casts my precast walls in place. How do I correct that?",
        "parts.md",
        "correct-one",
        ('means = "crane"', "A correction wins", "`bimvox plan`"),
    ),
    Question(
        "planner",
        "Which crane is cheapest for this building, and where does it stand?",
        "cranes.md",
        "in-three-steps",
        ("bimvox optimise", "The cheapest comes first"),
    ),
    Question(
        "planner",
        "I have the hirer's load chart as a PDF. How do I plan with it?",
        "crane-file.md",
        "importing-your-crane",
        ("bimvox crane import", "as text from a PDF", "--crane ltx-1060.toml"),
    ),
    Question(
        "planner",
        "How near may a load pass, and what if there is too little room?",
        "clearances.md",
        "how-a-default-gives-way",
        ("1.5, 1, 0.5, 0.25 m", "another place in the yard"),
    ),
    Question(
        "planner",
        "In which wind may a lift be done?",
        "wind.md",
        "set-the-wind-of-your-site",
        ("9.8 m/s", "`low_wind`", "`permitted_wind_m_s`"),
    ),
    Question(
        "planner",
        "Why is this part set before that one, and how do I change it?",
        "sequence.md",
        "change-the-order",
        ("after = [", "before", "--order FILE"),
    ),
    Question(
        "planner",
        "Our mobile crane does not reach everything. Can it move?",
        "set-ups.md",
        "do-it",
        ("[[crane.setup]]", "bimvox init building.ifc --crane mobile-220t"),
    ),
    Question(
        "planner",
        "What holds a wall when the slings come off, and until when?",
        "props.md",
        "what-holds-what",
        ("two push-pull props", "its joints carry"),
    ),
    Question(
        "planner",
        "A truck will stand in the way tomorrow. What do I do?",
        "watching.md",
        "do-it",
        ("bimvox watch obstructions.json", "what became infeasible and why"),
    ),
    Question(
        "planner",
        "May I lift by a verified plan? What does nobody check?",
        "verified.md",
        "what-it-cannot-know",
        ("strength of lifting points", "one wind speed for each lift", "The ground"),
    ),
    Question(
        "researcher",
        "How do I plan with my own path planner?",
        "planners.md",
        "a-path-planner",
        ("paths(start_vox, goal_vox, space)", "bimvox.plan(site, paths=astar)"),
    ),
    Question(
        "researcher",
        "Is the proof independent of the planner?",
        "verified.md",
        "how-it-is-independent",
        ("written twice, on purpose", "raw cells", "not independent"),
    ),
    Question(
        "researcher",
        "Which findings of the paper reproduce?",
        "paper.md",
        "results",
        ("**reproduces**", "**not decided**", "**contradicted**"),
    ),
    Question(
        "researcher",
        "How do I compare my policy with the shipped network on the same problems?",
        "start/researcher.md",
        "how-to-compare",
        ("bimvox policy score", "`digest`", "do not train on them"),
    ),
)


def test_there_are_ten_questions_of_planners_and_four_of_researchers():
    asked = [question.asks for question in QUESTIONS]
    assert (asked.count("planner"), asked.count("researcher")) == (10, 4)


@pytest.mark.parametrize("asked", QUESTIONS, ids=[f"{one.page}-{one.anchor}" for one in QUESTIONS])
def test_the_answer_stands_in_its_section(asked: Question):
    sections = sections_of((ROOT / "docs" / asked.page).read_text("utf-8"))
    assert asked.anchor in sections, f"{asked.question} {sorted(sections)}"
    section = re.sub(r"\s+", " ", sections[asked.anchor])
    for words in asked.answer:
        assert words in section, f"{asked.question} {asked.page}#{asked.anchor} does not say: {words}"


@pytest.mark.parametrize("asked", QUESTIONS, ids=[f"{one.page}-{one.anchor}" for one in QUESTIONS])
def test_the_page_is_one_step_from_the_first_one(asked: Question):
    first = (ROOT / "docs" / "index.md").read_text("utf-8").split("```{toctree}")[0]
    assert f"({asked.page}" in first


LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)#([^)\s]+)\)")


def test_every_anchor_of_a_link_is_a_heading():
    for file in [*DOCUMENTS, ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md"]:
        for target, anchor in LINK.findall(file.read_text("utf-8")):
            page = (file.parent / target).resolve() if target else file
            assert anchor in sections_of(page.read_text("utf-8")), f"{name_of(file)}: {target}#{anchor}"
