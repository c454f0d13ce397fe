"""The schema of the page's data: site, cranes, shapes and parts."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from bimvox.site.config.validation import Point2, Point3, Table

Count = Annotated[int, Field(ge=0)]
Numbers = tuple[Literal["u8", "u16", "u32", "i32", "f32"], Count, Count]
"""Type, offset in bytes and count of values in ``numbers``."""
Colour = tuple[Count, Count, Count]
Joint = Annotated[int, Field(ge=0, le=4)]


class PageSite(Table):
    """The site."""

    name: str
    """Its name."""
    model: str
    """Name of the model's file."""
    model_sha256: str
    """SHA-256 of that file."""
    model_format: str
    """Its format."""
    shape: tuple[Count, Count, Count]
    """Cells along x, y and z."""
    voxel_size_m: float
    """Edge of a cell."""
    origin_m: Point3
    """Lowest corner of cell (0, 0, 0)."""
    slab: Numbers
    """Columns, y slowest: 0 nothing, 1 ground, 2 construction area, 3 yard, 4 access of trucks; 8 more where hook or
    load must not be. Nothing where the ground is not as high as the yard: it stands among the fixed things."""
    slab_low_m: float
    """Lower side of the slab, a cell thick, whose top is the level of the yard."""
    notes: tuple[str, ...]
    """Notes about the site."""
    geometry_digest: str
    """Digest of its geometry."""
    view_deg: Point2
    """Azimuth and elevation from which to look."""


class PageColours(Table):
    """Colours, 0 to 255."""

    states: dict[str, Colour]
    """Of parts by state."""
    kinds: dict[str, Colour]
    """Of areas and fixed things by kind."""
    groups: tuple[Colour, ...]
    """Of groups without an order, such as classes; the last is of all others."""
    shares: tuple[Colour, ...]
    """Of ranges of utilisation, from low to critical."""
    remarks: dict[str, Colour]
    """Of parts by their most severe remark."""
    none: Colour
    """Of parts that belong to no group."""


class PageOverride(Table):
    """What the site file changes in a machine."""

    key: str
    """The key."""
    catalogue: str
    """The machine's value."""
    site: str
    """The site's value."""


class PageJib(Table):
    """A luffing jib, or a boom."""

    pivot_offset_m: float
    """Radius of the pivot."""
    pivot_height_m: float
    """Height of the pivot."""
    length_m: float
    """From pivot to tip."""


class PageChart(Table):
    """A load chart."""

    radius_m: tuple[float, ...]
    """Radii, ascending."""
    capacity_kg: tuple[float, ...]
    """Capacity at each: load, rigging and hook block."""


class PageLines(Table):
    """The lines of a drawn crane."""

    points: Numbers
    """Two ends of each line, x, y, z in the frame of their joints."""
    joints: Numbers
    """The joint of each end."""
    styles: Numbers
    """Of each line: red, green, blue, width in pixels, width in metres."""


class PageBlock(Table):
    """A box of a drawn crane."""

    centre_m: Point3
    """Its centre in the frame of its joint."""
    half_m: tuple[Point3, Point3, Point3]
    """Its three half edges."""
    rgb: Colour
    """Its colour."""
    joint: Joint
    """Its joint."""


class PageCrane(Table):
    """A crane. Joints: 0 fixed; 1 slewing; 2 with the trolley; 3 with the hook; 4 with the luffing jib."""

    name: str
    """Its name."""
    machine: str
    """Its machine."""
    jib_length_m: float
    """Largest hook radius."""
    falls: Count
    """Parts of rope that carry the hook."""
    overrides: tuple[PageOverride, ...]
    """What the site file changes."""
    kind: Literal["hammerhead", "luffing", "mobile"]
    """Its kind."""
    luffing: PageJib | None
    """Null for a jib with a trolley."""
    base_m: Point3
    """Foot of the slewing axis."""
    jib_height_m: float
    """Height of the rope exit; of a luffing jib its highest."""
    min_radius_m: float
    """Smallest hook radius."""
    mast_size_m: float
    """Edge of the mast."""
    sling_m: float
    """Height of the slings of the empty hook."""
    rigging_mass_kg: float
    """Mass of rigging and hook block."""
    chart: PageChart
    """Its load chart."""
    lines: PageLines
    """How it is drawn: lines."""
    blocks: tuple[PageBlock, ...]
    """How it is drawn: boxes."""


class PageGeometry(Table):
    """A shape that parts share."""

    step_m: float
    """Length of a step of its lattice."""
    points: Numbers
    """x, y, z of each point in steps, from the shape's lowest corner."""
    faces: Numbers
    """Three points of each triangle."""
    edges: Numbers
    """Two points of each visible edge."""


class PagePart(Table):
    """A part."""

    id: str
    """Its id."""
    global_id: str
    """Its GlobalId; of a mesh the body's name."""
    name: str
    """Its name."""
    ifc_class: str
    """Its IFC class."""
    type_name: str | None
    """Its type."""
    storey: str | None
    """Its storey."""
    material: str | None
    """Its material."""
    mass_kg: float
    """Its mass."""
    mass_source: str
    """Where its mass comes from."""
    cells: Count
    """Its volume in cells."""
    target_m: Point3
    """Lowest corner of its cells when it is set."""
    size_m: Point3
    """Size of its cells' box."""
    geometry: Count
    """Index in ``geometries``."""
    low_m: Point3
    """From ``target_m`` to the shape's lowest corner."""
    boxes: Numbers
    """Its cells as boxes: lowest x, y, z and the ends, in cells from ``target_m``."""


class PageStanding(Table):
    """Something that stands on the site: structure, or an obstruction."""

    id: str
    """Its id."""
    kind: str
    """Its kind."""
    name: str
    """Its name in the model; empty if it has none."""
    boxes: Numbers
    """Its cells as boxes: lowest x, y, z and the ends, in cells of the site."""
    geometry: Count | None = None
    """Index in ``geometries``; null without a shape. Only in ``standing``."""
    low_m: Point3 | None = None
    """Lowest corner of the shape. Only in ``standing``."""
