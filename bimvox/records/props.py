"""What holds each lifted part when its slings come off, and until when: props, neighbours, what it rests on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from bimvox.records.declared import Maybe, Record, Several
from bimvox.records.steps import Steps
from bimvox.site.component import Component
from bimvox.site.props import PropKind
from bimvox.site.site import Site
from bimvox.sparse import SPARSE

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Prop:
    """A prop in its place.

    Attributes:
        type: Name of its type.
        kind: What it is.
        head_m: Where it holds the part, metres in the site frame.
        foot_m: Where it stands.
        load_kn: What it bears along its axis.
        ballast_kg: What the block weighs on which it stands; 0 if it stands on concrete of the model.
    """

    type: str
    kind: PropKind
    head_m: Point
    foot_m: Point
    load_kn: float
    ballast_kg: float = field(default=0.0, metadata=SPARSE)


class Hold(StrEnum):
    """What holds a part when it is released."""

    PROPS = "props"
    SHORES = "shores"
    BEARING = "bearing"
    """It lies on what carries it."""
    BASE = "base"
    """It stands on its base by itself, or bolted to it: steel, and what is hardly higher than thick."""
    NEIGHBOURS = "neighbours"
    """There is no place for props, and it is fixed to what it touches."""
    NOTHING = "nothing"
    """Nothing in the model can hold it: a person must say what does."""


@dataclass(frozen=True, slots=True)
class Held:
    """How a lifted part is held.

    Attributes:
        order: Position of its lift in the erection sequence.
        component: Index into ``Site.components``.
        hold: What holds it.
        by: Indices of the parts that it rests on or is fixed to.
        props: Its props.
        from_ns: When it must be held, in elapsed time: from when it is at its place.
        until_ns: When its props may go; None: as its designer says, because nothing in the plan takes their place, or
            because it has none.
        waits_for: Indices of the parts whose joints, or whose concrete, must carry before that; its own are among them.
        clear_m: How far loads pass from its props at least, up to the rule's clearance; None without props.
        holds_up: Indices of the parts that trades build, or people set, where its props stand: they wait for these.
    """

    order: int
    component: int
    hold: Hold
    by: tuple[int, ...]
    props: tuple[Prop, ...]
    from_ns: int
    until_ns: int | None
    waits_for: tuple[int, ...]
    holds_up: tuple[int, ...] = field(default=(), metadata=SPARSE)
    clear_m: float | None = field(default=None, metadata=SPARSE)

    def in_words(self, site: Site) -> str:
        """Return what holds the part, in a few words."""
        named = ", ".join(_name(site.components[n]) for n in self.by[:_NAMED]) + (", ..." * (len(self.by) > _NAMED))
        if self.props:
            counts = Counter(prop.type for prop in self.props)
            return ", ".join(f"{count} x {name}" for name, count in counts.items())
        if self.hold is Hold.BEARING:
            return f"lies on {named or 'the ground'}"
        if self.hold is Hold.BASE:
            return "stands on its base"
        return f"fixed to {named}" if self.hold is Hold.NEIGHBOURS else "nothing in the model: a person must say what"

    def document(self, site: Site) -> dict[str, Any]:
        """Return it for the JSON documents."""
        return HELD.of(self, site)


@dataclass(frozen=True, slots=True)
class Props:
    """How all lifted parts of a plan are held, in the order of their lifts.

    Attributes:
        held: One entry a lifted part.
    """

    held: tuple[Held, ...] = ()

    @property
    def propped(self) -> tuple[Held, ...]:
        """The parts that have props."""
        return tuple(one for one in self.held if one.props)

    def standing(self, steps: Steps, ends_ns: int) -> tuple[Standing, ...]:
        """Return the parts that have props, with when these stand on the site's clock.

        ``steps``: the pauses of that clock; ``ends_ns``: when it ends: what goes later is not seen to go.
        """
        found = []
        for one in self.propped:
            until_ns = None if one.until_ns is None else steps.clock_ns(one.until_ns)
            kept = until_ns is None or until_ns > ends_ns
            found.append(Standing(one, steps.clock_ns(one.from_ns), None if kept else until_ns))
        return tuple(found)

    def needed(self) -> dict[str, int]:
        """Return how many props of each type stand at the same time at most."""
        found: dict[str, int] = {}
        for name in sorted({prop.type for one in self.held for prop in one.props}):
            changes = []
            for one in self.held:
                count = sum(prop.type == name for prop in one.props)
                changes += [(one.from_ns, 1, count)] + ([(one.until_ns, 0, -count)] if one.until_ns is not None else [])
            found[name] = _most(changes)
        return found

    def documents(self, site: Site) -> dict[str, Any]:
        """Return ``held`` and ``props_needed`` for the JSON documents."""
        return {"held": [one.document(site) for one in self.held], "props_needed": self.needed()}


@dataclass(frozen=True, slots=True)
class Standing:
    """The props of a part, on the site's clock.

    Attributes:
        held: What they hold.
        from_ns: From when they stand.
        until_ns: When they go; None if that is not seen.
    """

    held: Held
    from_ns: int
    until_ns: int | None

    def stands_at(self, at_ns: int) -> bool:
        """Return whether they stand at a time."""
        return self.from_ns <= at_ns and (self.until_ns is None or at_ns < self.until_ns)


def _most(changes: Iterable[tuple[int, int, int]]) -> int:
    now = most = 0
    for _, _, change in sorted(changes):
        now += change
        most = max(most, now)
    return most


_NAMED = 3


def _name(part: Component) -> str:
    return part.name or part.id


def _seconds(at_ns: int | None) -> float | None:
    return None if at_ns is None else round(at_ns / 1e9, 3)


def _point(point_m: Point) -> list[float]:
    return [round(value, 3) + 0.0 for value in point_m]


PROP = Record(
    "Prop",
    "A prop in its place.",
    ("type", str, "Its type."),
    ("kind", str, "`push_pull` or `shore`.", lambda prop: prop.kind.value),
    ("head_m", tuple[float, ...], "Where it holds the part, site metres.", lambda prop: _point(prop.head_m)),
    ("foot_m", tuple[float, ...], "Where it stands, site metres.", lambda prop: _point(prop.foot_m)),
    ("load_kn", float, "What it bears along its axis, kN.", lambda prop: round(prop.load_kn, 1)),
    ("ballast_kg", float, "Mass of the block on which it stands; 0 if it stands on concrete of the model."),
)
HELD = Record(
    "Held",
    "What holds a lifted part when its slings come off, and until when.",
    ("number", int, "Number of its lift.", lambda it, _: it.order + 1),
    ("component", str, "Id of the part.", lambda it, site: site.components[it.component].id),
    ("name", str, "Its name.", lambda it, site: site.components[it.component].name),
    ("hold", str, "`props`, `shores`, `bearing`, `base`, `neighbours` or `nothing`.", lambda it, _: it.hold.value),
    ("words", str, "The same in words.", lambda it, site: it.in_words(site)),
    ("by", tuple[str, ...], "Ids of the parts that it lies on or is fixed to.",
     lambda it, site: [site.components[n].id for n in it.by]),
    ("props", Several(PROP), "Its props.", lambda it, _: [PROP.of(one) for one in it.props]),
    ("from_s", float, "From when it must be held, elapsed seconds.", lambda it, _: _seconds(it.from_ns)),
    ("until_s", Maybe(float), "When its props may go; null: as its designer says, or it has none.",
     lambda it, _: _seconds(it.until_ns)),
    ("clear_m", Maybe(float), "How far loads pass from its props at least, up to the rule's clearance.",
     lambda it, _: it.clear_m),
    ("holds_up", tuple[str, ...], "Ids of the parts that are built or set by hand where its props stand: they wait.",
     lambda it, site: [site.components[n].id for n in it.holds_up]),
    ("waits_for", tuple[str, ...], "Ids of the parts whose joints or concrete must carry before its props may go.",
     lambda it, site: [site.components[n].id for n in it.waits_for]),
)  # fmt: skip
