"""The generalist's lessons and the checks during training: numbered problems, generated on many threads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from bimvox.env.problem import LiftProblem
from bimvox.policy.generalist.occupancies import FAMILIES
from bimvox.policy.generalist.problems import random_problem
from bimvox.site.component import IntVec

LESSON_DOMAIN, HELD_OUT_DOMAIN, VALIDATION_DOMAIN = 1, 2, 3
"""First number of every seed: lessons, held-out suite and checks never share one."""

SMALLEST: IntVec = (15, 15, 6)
LESSON_SIZES: tuple[tuple[IntVec, int], ...] = (((40, 40, 16), 3), ((96, 96, 32), 5), ((160, 160, 48), 2))
"""Largest site, and how many lessons in ten are drawn up to that size."""


def lesson(number: int, domain: int = LESSON_DOMAIN) -> LiftProblem:
    """Return the problem of a number, which determines family, size and seed."""
    names = list(FAMILIES)
    sizes = [largest for largest, tenths in LESSON_SIZES for _ in range(tenths)]
    largest = sizes[number // len(names) % len(sizes)]
    return random_problem((domain, number), names[number % len(names)], SMALLEST, largest)


def lessons(count: int, *, domain: int = LESSON_DOMAIN, first: int = 0, threads: int = 1) -> list[LiftProblem]:
    """Return ``count`` problems of a domain, from number ``first`` on, families in turn."""
    with ThreadPoolExecutor(threads) as executor:
        return list(executor.map(lambda number: lesson(number, domain), range(first, first + count)))
