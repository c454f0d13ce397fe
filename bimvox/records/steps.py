"""The steps of work that the crane does not do, and the pauses of the crane until such work carries.

The site's clock counts crane time: it stands during a pause. Elapsed time counts the pauses too. Both begin with the
first lift; work before it has negative times.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import Any

from bimvox.records.lift import NOT_LIFTED, Lift
from bimvox.records.motion import LiftMotion
from bimvox.site.casting import curing_s
from bimvox.site.means import HOW, Means
from bimvox.site.site import Site
from bimvox.sparse import SPARSE
from bimvox.units import NS_PER_S


@dataclass(frozen=True, slots=True)
class Step:
    """Work at a part that the crane does not set, in elapsed time.

    Attributes:
        order: Position in the erection sequence.
        component: Index into ``Site.components``.
        begins_ns: When the work begins: after all earlier lifts of the sequence.
        ends_ns: When the work ends.
        carries_ns: When it carries what rests on it.
    """

    order: int
    component: int
    begins_ns: int
    ends_ns: int
    carries_ns: int

    def seconds(self) -> dict[str, float]:
        """Return its times in seconds, for documents."""
        return {f"{key}_s": round(getattr(self, f"{key}_ns") / 1e9, 3) for key in ("begins", "ends", "carries")}


@dataclass(frozen=True, slots=True)
class Pause:
    """A pause of the crane before a lift, until what the part rests on carries.

    Attributes:
        order: The lift's position in the erection sequence.
        at_ns: When it is, on the site's clock.
        length_ns: How long it is.
    """

    order: int
    at_ns: int
    length_ns: int


@dataclass(frozen=True, slots=True)
class Move:
    """A move of the crane from one set-up to another, in elapsed time; the crane pauses meanwhile.

    Attributes:
        order: Position in the erection sequence of the first lift after it.
        come_from: The set-up that it leaves: index in ``Site.cranes``.
        goes_to: The set-up that it goes to.
        begins_ns: When it begins to be derigged: after the lift before.
        drives_ns: When it drives.
        arrives_ns: When it begins to be rigged.
        ends_ns: When it is ready to lift.
    """

    order: int
    come_from: int
    goes_to: int
    begins_ns: int
    drives_ns: int
    arrives_ns: int
    ends_ns: int


@dataclass(frozen=True, slots=True)
class Steps:
    """All steps, pauses and moves of a plan, each in ascending order.

    Attributes:
        steps: The steps.
        pauses: The pauses.
        moves: The moves of a crane from set-up to set-up; during each is a pause.
    """

    steps: tuple[Step, ...] = ()
    pauses: tuple[Pause, ...] = ()
    moves: tuple[Move, ...] = field(default=(), metadata=SPARSE)

    def starting_ns(self, at_ns: int) -> int:
        """Return the elapsed time of something that starts at a time on the site's clock: after a pause then."""
        return at_ns + self._paused_ns(bisect_right([pause.at_ns for pause in self.pauses], at_ns))

    def ending_ns(self, at_ns: int) -> int:
        """Return the elapsed time of something that ends at a time on the site's clock: before a pause then."""
        return at_ns + self._paused_ns(bisect_left([pause.at_ns for pause in self.pauses], at_ns))

    def clock_ns(self, elapsed_ns: int) -> int:
        """Return the time on the site's clock at an elapsed time: during a pause, that of the pause."""
        paused_ns = 0
        for pause in self.pauses:
            if pause.at_ns + paused_ns >= elapsed_ns:
                break
            paused_ns = min(paused_ns + pause.length_ns, elapsed_ns - pause.at_ns)
        return elapsed_ns - paused_ns

    def documents(self, site: Site) -> dict[str, list[dict[str, Any]]]:
        """Return ``steps`` and ``pauses`` for the JSON documents, and ``moves`` if there are any; times in seconds."""
        parts = site.components
        return {
            "steps": [
                {
                    "number": step.order + 1,
                    "component": parts[step.component].id,
                    "name": parts[step.component].name,
                    "means": parts[step.component].means.value,
                }
                | step.seconds()
                for step in self.steps
            ],
            "pauses": [
                {
                    "number": pause.order + 1,
                    "at_s": round(pause.at_ns / 1e9, 3),
                    "length_s": round(pause.length_ns / 1e9, 3),
                }
                for pause in self.pauses
            ],
            **({"moves": [_move_document(site, move) for move in self.moves]} if self.moves else {}),
        }

    def elapsed_ns(self, motions: Iterable[LiftMotion]) -> int:
        """Return the elapsed time from the first lift to the end of the last work, lift or other."""
        lifts_ns = (self.ending_ns(motion.end_ns) for motion in motions)
        return max([0, *lifts_ns, *(step.ends_ns for step in self.steps)])

    @property
    def paused_ns(self) -> int:
        """How long the crane pauses, all pauses together."""
        return self._paused_ns(len(self.pauses))

    @property
    def moved_ns(self) -> int:
        """How long the crane moves between its set-ups, all moves together."""
        return sum(move.ends_ns - move.begins_ns for move in self.moves)

    @property
    def of_order(self) -> dict[int, Step]:
        """The steps by order."""
        return {step.order: step for step in self.steps}

    def _paused_ns(self, count: int) -> int:
        return list(accumulate((pause.length_ns for pause in self.pauses[:count]), initial=0))[-1]


def _move_document(site: Site, move: Move) -> dict[str, Any]:
    assert site.moving is not None
    at_ns = {"begins": move.begins_ns, "drives": move.drives_ns, "arrives": move.arrives_ns, "ends": move.ends_ns}
    return {
        "number": move.order + 1,
        "from": site.moving.names[move.come_from],
        "to": site.moving.names[move.goes_to],
        **{f"{key}_s": round(value / 1e9, 3) for key, value in at_ns.items()},
    }


def set_up_documents(site: Site, motions: Iterable[LiftMotion], steps: Steps) -> dict[str, list[dict[str, Any]]]:
    """Return ``set_ups`` of a crane that moves for the JSON documents: the place, and the lifts there; or nothing."""
    if site.moving is None:
        return {}
    numbers: dict[int, list[int]] = {}
    for motion in motions:
        numbers.setdefault(motion.crane, []).append(motion.number)
    return {
        "set_ups": [
            {
                "name": name,
                "base_m": [round(value, 3) for value in crane.base_m],
                "lifts": len(own := numbers.get(number, [])),
                "first": min(own, default=None),
                "last": max(own, default=None),
                "ready_s": next((round(one.ends_ns / 1e9, 3) for one in steps.moves if one.goes_to == number), 0.0)
                if own
                else None,
            }
            for number, (name, crane) in enumerate(zip(site.moving.names, site.cranes, strict=True))
        ]
    }


def cured_ns(site: Site, steps: Steps, motion: LiftMotion) -> int | None:
    """Return the elapsed time from which the joints of a lifted part carry what rests on it; None: from its release.

    ``steps``: all pauses before the release.
    """
    cures_s = curing_s(site.rules.curing, site.components[motion.component])
    return steps.ending_ns(motion.released_ns) + round(cures_s * NS_PER_S) if cures_s else None


def by_other_means(lifts: Iterable[Lift]) -> tuple[Lift, ...]:
    """Return the lifts whose parts are set by other means, in order."""
    return tuple(sorted((lift for lift in lifts if lift.by_other_means), key=lambda lift: lift.order))


def needed_by_ns(lifts: Iterable[Lift], motions: Iterable[LiftMotion]) -> dict[int, int | None]:
    """Return when each part that the crane does not set is needed, by order: when the next part is set.

    Those are the parts that are set by other means or by hand, or cast in place. None of them may be there before all
    earlier parts of the sequence are set. None if no later part has a time.

    ``motions``: those of its motions whose time is known.
    """
    otherwise = [lift for lift in lifts if lift.is_set_otherwise]
    set_ns = {motion.order: motion.set_ns for motion in motions} if otherwise else {}
    return {
        lift.order: min((at_ns for order, at_ns in set_ns.items() if order > lift.order), default=None)
        for lift in otherwise
    }


def proven_in_words(count: int, claims: int = 0) -> str:
    """Return the verdict about a proven plan.

    ``count`` parts are set by other means; the proof has taken ``claims`` claims of the log as true.
    """
    words = "proven"
    if claims:
        words += f", with {'1 claim' if claims == 1 else f'{claims:,} claims'} of the log"
    if count:
        words += f", provided that {'1 part is' if count == 1 else f'{count:,} parts are'} set by other means"
    return words


@dataclass(frozen=True, slots=True)
class NotLifted:
    """The parts of a storey and kind that the crane does not lift. Those set by hand come up as one bundle.

    Attributes:
        means: How they get to their places.
        storey: Name of their storey, if any.
        kind: Name of their type, otherwise their class.
        lifts: Their entries in the sequence, in order.
        mass_kg: Their mass together.
        needed_by_ns: When the first of them is needed; None if not known.
        begins_ns: When the work at them begins, in elapsed time; None if not known.
        ends_ns: When the work at all of them has ended.
        carries_ns: When all of them carry what rests on them.
        crane_s: Crane time of the material lift that brings the bundle; None if people carry it, or it is cast. It has
            no path, is not proven, and is not in the plan's crane time.
    """

    means: Means
    storey: str | None
    kind: str
    lifts: tuple[Lift, ...]
    mass_kg: float
    needed_by_ns: int | None
    begins_ns: int | None = None
    ends_ns: int | None = None
    carries_ns: int | None = None
    crane_s: float | None = None

    @property
    def name(self) -> str:
        """What the group is called: ``bundle: 24 railings, Level 2``."""
        where = "" if self.storey is None else f", {self.storey}"
        what = "bundle" if self.means is Means.BY_HAND else HOW[self.means]
        return f"{what}: {len(self.lifts):,} x {self.kind}{where}"

    def to_dict(self) -> dict[str, Any]:
        """Return the group for the JSON documents."""
        return {
            "name": self.name,
            "means": self.means.value,
            "storey": self.storey,
            "kind": self.kind,
            "parts": len(self.lifts),
            "mass_kg": round(self.mass_kg, 1),
            "numbers": [lift.number for lift in self.lifts],
            "reason": self.lifts[0].reason,
            "needed_by_s": _seconds(self.needed_by_ns),
            "begins_s": _seconds(self.begins_ns),
            "ends_s": _seconds(self.ends_ns),
            "carries_s": _seconds(self.carries_ns),
            "material_lift_s": self.crane_s,
        }


def not_lifted_groups(
    site: Site, lifts: Iterable[Lift], motions: Iterable[LiftMotion], steps: Steps
) -> tuple[NotLifted, ...]:
    """Return the parts of a plan that the crane does not lift, by means, storey and kind, in the order of need."""
    groups: dict[tuple[Means, str | None, str], list[Lift]] = {}
    chosen = sorted((lift for lift in lifts if lift.status in NOT_LIFTED), key=lambda lift: lift.order)
    for lift in chosen:
        component = site.components[lift.component]
        kind = component.type_name or component.ifc_class
        groups.setdefault((component.means, component.storey, kind), []).append(lift)
    needed_ns = needed_by_ns(chosen, motions)
    of_order = steps.of_order
    found = []
    for key, own in groups.items():
        mass_kg = sum(site.components[lift.component].mass_kg for lift in own)
        group = NotLifted(*key, tuple(own), mass_kg, needed_ns[own[0].order], crane_s=_crane_s(site, key[0], mass_kg))
        work = [of_order[lift.order] for lift in own if lift.order in of_order]
        if work:
            group = replace(
                group,
                begins_ns=min(step.begins_ns for step in work),
                ends_ns=max(step.ends_ns for step in work),
                carries_ns=max(step.carries_ns for step in work),
            )
        found.append(group)
    return tuple(found)


def _crane_s(site: Site, means: Means, mass_kg: float) -> float | None:
    """Return the crane time of the material lift of a bundle; None if people carry it."""
    casting = site.rules.casting
    is_load = site.cranes and means is Means.BY_HAND and mass_kg > casting.bundle_kg
    return casting.bundle_s if is_load else None


def _seconds(at_ns: int | None) -> float | None:
    return None if at_ns is None else round(at_ns / 1e9, 3)
