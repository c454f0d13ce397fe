"""The schema of the site file's ``[project]`` table: what the lift plan's title block states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from bimvox.site.config.validation import NotNegative, Positive, Table, Text

MOST_REVISIONS = 1000
Words = Annotated[Text, Field(max_length=1000)]


class RevisionConfig(Table):
    """One issue of the lift plan."""

    revision: Words
    """Its letter or number."""
    date: Words
    """When it was issued."""
    changes: Words | None = None
    """What it changes."""


class ProjectConfig(Table):
    """The project and the people of the lift plan, for `bimvox report`. It changes nothing in the plan."""

    name: Words | None = None
    """Name of the project. Default: the site's."""
    number: Words | None = Field(default=None, examples=["2026-014"])
    """Number of the project, or of the document."""
    address: Words | None = None
    """Where the site is."""
    client: Words | None = None
    """Who ordered the work."""
    contractor: Words | None = None
    """Who erects."""
    revision: Words | None = None
    """Letter or number of this issue. Default: that of the last of `revisions`."""
    revisions: Annotated[tuple[RevisionConfig, ...], Field(max_length=MOST_REVISIONS)] = ()
    """The issues so far, the latest last."""
    prepared_by: Words | None = Field(default=None, examples=["A. Person"])
    """Who wrote the lift plan."""
    checked_by: Words | None = None
    """Who checked it."""
    approved_by: Words | None = None
    """Who approves it."""
    appointed_person: Words | None = None
    """Who is responsible for all lifting operations on the site."""
    lifting_supervisor: Words | None = None
    """Who supervises the lifts."""
    crane_operator: Words | None = None
    """Who operates the crane."""
    slinger: Words | None = None
    """Who slings the loads and gives the signals."""
    emergency: Words | None = None
    """What to do in an emergency, or the document that says it."""
    emergency_contact: Words | None = None
    """Whom to call first, with telephone number."""
    rescue_plan: Words | None = None
    """How the operator is brought down from the crane, and who does it."""
    hospital: Words | None = None
    """Nearest hospital with an emergency department: name, address."""
    assembly_point: Words | None = None
    """Where everybody meets after an alarm."""
    communication: Words | None = None
    """How operator and signaller communicate: radio channel, hand signals."""
    foundation: Words | None = None
    """Foundation, ties or outriggers of the crane: document and loads."""
    ground: Words | None = None
    """Permitted ground pressure, and where it is stated."""

    @property
    def issue(self) -> str | None:
        """The revision of this issue."""
        return self.revision or (self.revisions[-1].revision if self.revisions else None)


MOST_SUPPORTS = 100
Mass = Annotated[Positive, Field(le=1e7)]


class SupportConfig(Table):
    """What the maker states of a crane as it stands, and its mats, for `bimvox report`, which invents none.

    The foundation of a tower crane is part of the plan: distances, drawings and remarks are measured from it.
    """

    crane: Text | None = None
    """Name of the crane. Default: the first."""
    machine: Text | None = Field(default=None, examples=["hammerhead-45"])
    """Machine for which it holds, as in ``[crane] machine``; with another one it does not count. Default: any."""
    crane_mass_kg: Mass | None = None
    """Mass of the crane as erected, with ballast and counterweight, without hook block and rigging."""
    back_moment_knm: Annotated[NotNegative, Field(le=1e7)] | None = None
    """Moment of its own masses towards the counterweight, without a load. Default: not stated."""
    free_standing_m: Annotated[Positive, Field(le=1000.0)] | None = None
    """Highest hook above the foot up to which the crane stands without ties."""
    mat_m2: Annotated[Positive, Field(le=1e4)] | None = None
    """Area of the mat under an outrigger, or of the foundation under a tower crane, which is drawn as a square."""
    permitted_kpa: Annotated[Positive, Field(le=1e6)] | None = None
    """Permitted pressure on the ground."""


def support_of(given: Sequence[SupportConfig], crane: str, machine: str, *, is_first: bool) -> SupportConfig | None:
    """Return what is stated of a crane, a machine; a table without a crane's name is about the first one."""
    own = (one for one in given if one.machine in (None, machine))
    return next((one for one in own if one.crane == crane or (one.crane is None and is_first)), None)
