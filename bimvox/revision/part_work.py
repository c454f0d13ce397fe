"""What is done about a part once it is known which lifts it holds: its motions are made and laid, then all is proven.

Two sides do it at once, here and in a copy beside. Each makes the next motion that nobody has claimed; they exchange
them, lay all on the clock, and each proves the next lifts that nobody has claimed. What is missing in the end (the copy
died, or does not answer) is done here. A motion, and the proof of some lifts, is the same whoever makes it.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from bimvox.planning.rounds import Refused
from bimvox.records.motion import LiftMotion
from bimvox.revision.made import Made, Wanted
from bimvox.revision.motions import make_motions, on_the_clock
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.part_proof import Proof, prove, together
from bimvox.revision.sides import Side
from bimvox.revision.standing import Standing

_MOTIONS, _PROOFS = 0, 1
_PROVEN_AT_ONCE = 4
"""Lifts that are proven together: each proof looks at all that stands."""


class PartWork:
    """The work on a part.

    Args:
        standing: The plan that stands.
        wanted: What the part is made of.
        change: What changed about the obstructions.
        known_shapes: See ``verify_plan``.
        made: What the walk made; it is full, and may still go on.
    """

    def __init__(
        self, standing: Standing, wanted: Wanted, change: ObstructionChange, known_shapes: set[int], made: Made
    ) -> None:
        self._was, self._wanted, self._change = standing, wanted, change
        self._known_shapes, self._made = known_shapes, made
        self._to_make = made.motions_to_make
        self._paths, self._motions = made.paths_to_prove, made.motions_to_prove
        orders = sorted(self._paths | self._motions)
        self._batches = [orders[n : n + _PROVEN_AT_ONCE] for n in range(0, len(orders), _PROVEN_AT_ONCE)]

    @property
    def counts(self) -> tuple[int, int]:
        """How many motions there are to be made, and how many proofs."""
        return len(self._to_make), len(self._batches)

    def beside(self, side: Side) -> None:
        """Do the other side's share."""
        motions, untimed = self._exchanged(side)
        if untimed or len(motions) < len(self._to_make):
            return
        proofs = self._prove(side, on_the_clock(self._wanted, self._made, motions))
        if proofs:
            side.give(proofs)

    def motions(self, side: Side) -> Made | Refused:
        """Make this side's share of the motions, and return all that the walk made with all of them on the clock.

        Where the crane cannot drive some lifts, return which, and why.
        """
        motions, untimed = self._exchanged(side)
        missing = (n for n, order in enumerate(self._to_make) if order not in motions.keys() | untimed.keys())
        more = make_motions(self._wanted, self._made, partial(next, missing, None))
        motions, untimed = motions | more[0], untimed | more[1]
        if untimed:
            components = self._wanted.site.components
            lifts = {lift.order: lift for lift in self._made.lifts}
            return {
                components[lifts[order].component].id: f"the crane cannot drive its path: {why}"
                for order, why in sorted(untimed.items())
            }
        return on_the_clock(self._wanted, self._made, motions)

    def proof(self, side: Side, made: Made) -> Proof:
        """Make this side's share of the proofs, and return what all of them say.

        Raises:
            VerificationError: If one fails of which no lift is at fault.
        """
        found = self._prove(side, made)
        if len(found) < len(self._batches):
            found |= side.take() or {}
        found |= self._proofs(made, (n for n in range(len(self._batches)) if n not in found))
        return together(found[n] for n in range(len(self._batches)))

    def _exchanged(self, side: Side) -> tuple[dict[int, LiftMotion], dict[int, str]]:
        """Make a side's share of the motions, and return them with those of the other side."""
        motions, untimed = make_motions(self._wanted, self._made, partial(side.claim, _MOTIONS))
        if motions or untimed:
            side.give((motions, untimed))
        if len(motions) + len(untimed) < len(self._to_make):
            theirs = side.take()
            if theirs is not None:
                return motions | theirs[0], untimed | theirs[1]
        return motions, untimed

    def _prove(self, side: Side, made: Made) -> dict[int, Proof]:
        return self._proofs(made, iter(partial(side.claim, _PROOFS), None))

    def _proofs(self, made: Made, numbers: Iterable[int | None]) -> dict[int, Proof]:
        # A lift that is still to come waits in the yard, whatever becomes of it.
        plan = made.plan(self._was, self._wanted, self._change)
        found = {}
        for number in numbers:
            assert number is not None
            orders = set(self._batches[number])
            found[number] = prove(plan, orders & self._paths, orders & self._motions, made.motions, self._known_shapes)
        return found
