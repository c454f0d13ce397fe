from __future__ import annotations

import threading
import time

import pytest

from bimvox.grid.in_order import in_order


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_results_come_in_order_whoever_is_first(threads: int) -> None:
    def slow_for_even(n: int) -> int:
        time.sleep(0.002 * (n % 2 == 0))
        return n * n

    assert list(in_order(slow_for_even, range(40), threads)) == [n * n for n in range(40)]


@pytest.mark.parametrize("threads", [1, 3])
def test_only_a_few_are_done_ahead(threads: int) -> None:
    started: list[int] = []
    lock = threading.Lock()

    def note(n: int) -> int:
        with lock:
            started.append(n)
        return n

    results = in_order(note, range(1_000), threads)
    assert next(results) == 0
    assert len(started) <= 2 * threads
    results.close()


def test_an_error_is_passed_on() -> None:
    def fail(n: int) -> int:
        raise ValueError(f"no {n}")

    with pytest.raises(ValueError, match="no 0"):
        list(in_order(fail, range(9), 3))
