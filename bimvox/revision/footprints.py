"""Footprints of lifts, each made when it is first needed: a revision is on disk before those of its own lifts are."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import TypeVar

from bimvox.proof.footprint import Footprint, MotionFootprint

F = TypeVar("F", Footprint, MotionFootprint)


class Footprints(Mapping[int, F]):
    """Footprints by order of the lift.

    Args:
        to_make: How to make each.
        made: Others that are made already.
    """

    def __init__(self, to_make: Mapping[int, Callable[[], F]], made: Mapping[int, F]) -> None:
        self._to_make: dict[int, Callable[[], F]] = dict(to_make)
        self._made: dict[int, F] = dict(made)

    def __getitem__(self, order: int) -> F:
        if order in self._to_make:
            self._made[order] = self._to_make[order]()
            del self._to_make[order]
        return self._made[order]

    def __iter__(self) -> Iterator[int]:
        return iter(sorted({*self._to_make, *self._made}))

    def __len__(self) -> int:
        return len({*self._to_make, *self._made})

    def __contains__(self, order: object) -> bool:
        return order in self._to_make or order in self._made

    def after(self, earlier: Mapping[int, F]) -> Footprints[F]:
        """Return these, and the earlier ones of other lifts; none is made."""
        before = earlier if isinstance(earlier, Footprints) else Footprints({}, earlier)
        made = {order: one for order, one in before._made.items() if order not in self._to_make}
        to_make = {order: make for order, make in before._to_make.items() if order not in self._made}
        return Footprints({**to_make, **self._to_make}, {**made, **self._made})

    def only(self, orders: Collection[int]) -> Footprints[F]:
        """Return those of some lifts; none is made."""
        to_make = {order: self._to_make[order] for order in orders if order in self._to_make}
        made = {order: self._made[order] for order in orders if order in self._made}
        return Footprints(to_make, made)

    def make_all(self) -> None:
        """Make those that are not made yet."""
        for order in tuple(self._to_make):
            self[order]
