"""The mass of an element: what the file states if the mesh does not contradict it, otherwise volume times density."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

from bimvox.bim.ifc.properties import Properties, Stated, has_thickness, layers_of, numbers_in
from bimvox.bim.ifc.text import label
from bimvox.bim.ifc.units import Units
from bimvox.bim.kinds.words import DEFAULT_DENSITY_KG_M3, density_by_name
from bimvox.bim.mesh.repair import SHEET_M

# Net before gross: a gross weight is that of the stock before cuts and openings (50 % more on one cut balcony).
_WEIGHTS = (
    *("netweight", "nettogewicht", "poidsnet", "pesonetto", "weight", "mass", "gewicht", "masse", "massa", "poids"),
    *("peso", "grossweight", "bruttogewicht", "poidsbrut", "pesobruto", "pesolordo"),
)
_VOLUMES = ("netvolume", "nettovolumen", "volume", "volumen", "grossvolume", "bruttovolumen")
_PLAUSIBLE_KG_M3 = (10.0, 23000.0)
"""From foam to above lead: a stated density outside this has a wrong number or unit."""
_ODD_KG_M3 = (50.0, 12000.0)
"""A stated weight that gives a density outside this is used, with a note."""
_DOUBTFUL_SHARES = (0.2, 5.0)
"""A stated weight that is less or more of what volume and material say is doubtful. In between, a part may be hollow,
or have reinforcement, inserts and faces that are not drawn (professional judgement)."""
_ABSURD_SHARE = 100.0
"""One that is more than this is not a weight of the part: it counts for nothing."""
_SLIP_SHARES = (0.5, 2.0)
"""A weight in another unit than stated is recognised only if it then is this share of what the part should weigh."""
_SLIP_DEFAULT_SHARES = (0.3, 3.5)
"""The same if the material is not known: it may be steel."""
_WEIGHT_SLIPS = (1e3, 1e-3)
"""Tonnes and grams, stated as kilograms."""
_VOLUME_SLIPS = (1e-9, 1e-6, 1e-3)
"""Cubic millimetres, cubic centimetres and litres, stated as cubic metres."""
_THICKNESSES = (
    "thickness",
    "dicke",
    "stärke",
    "epaisseur",
    "épaisseur",
    "dikte",
    "spessore",
    "espesor",
    "width",
    "depth",
)
_SHEETS_M = (2e-4, 0.6)
"""From sheet metal to a thick wall."""
_LEAST_SHARE = 5e-3
"""Least share of a guessed volume that a stated one is believed to be: a sheet of 0.05 mm, guessed as 10 mm."""
_LEAST_SLIP_SHARE = 0.3
"""The same for a stated volume in another unit than stated."""
_LEAST_GUESS_SHARE = 0.5
"""Least share of a guessed volume that is used to judge a stated weight."""
_STATED_LESS = 0.9
"""A part that is drawn solid has its stated volume if that is at most this share of the drawn one."""
_ROUNDING = 1e-6
SOURCES = ("quantity", "density", "default")
"""Where a mass comes from, most reliable first."""

WEIGHT_SLIP = "stated weights that are those of the part only in tonnes or grams, so converted (check the unit)"
WEIGHT_DOUBTFUL = (
    "stated weights under a fifth or above five times what volume and material say: the greater one counts, but a "
    "stated one only up to a hundred times the other"
)
WEIGHT_ODD = (
    "stated weights that are unusual for the volume of the part (under 50 or over 12,000 kg/m3), but used: check them"
)
VOLUME_SLIP = "stated volumes that fit the part only in mm3, cm3 or litres, so converted (check the unit)"
VOLUME_REFUSED = "stated volumes that are impossible for the box of the part, so its surface counts (check the unit)"
REPEATED = "wholes with a body of their own, in which their parts lie: what is there twice weighs once"
REPEATED_WHOLE = "wholes whose body is that of their parts, which are elements: it is left out"
ASSEMBLY_LOW = (
    "assemblies that are stated to be lighter than their parts, whose weights add up: those of the parts count"
)
OVERFULL = "parts whose bodies enclose more than their box, so drawn more than once: their box counts"
DRAWN_SOLID = (
    "planks, rooms, stairs, trusses and machines that are drawn solid, so weighed as such parts usually are "
    "(state their weight)"
)
DOUBTS = (
    *(DRAWN_SOLID, WEIGHT_SLIP, WEIGHT_DOUBTFUL, WEIGHT_ODD, VOLUME_SLIP, VOLUME_REFUSED, OVERFULL),
    *(REPEATED, REPEATED_WHOLE, ASSEMBLY_LOW),
)
"""Notes about what is stated, in the order in which they are given."""


@dataclass(frozen=True, slots=True)
class Mass:
    """A mass, its source, and what is doubtful about it.

    Attributes:
        kg: The mass.
        source: Where it comes from.
        guessed: Whether it is a guessed volume times a density.
        doubts: What of ``DOUBTS`` holds.
        doubted_kg: The weight that the file states, and the one by volume and material, if these contradict each other.
    """

    kg: float
    source: str
    guessed: bool = False
    doubts: tuple[str, ...] = ()
    doubted_kg: tuple[float, ...] = ()


class Masses:
    """Masses of the products of one file.

    Args:
        file: The ``ifcopenshell.file``.
        properties: Looks its properties up.
        default_kg_m3: Returns the density of a product whose material is not known.
        instead_kg_m3: Returns the density that counts instead of that of its material; None if none does.
        solid_share: Returns how much of its volume a product is that is drawn as one solid block, by that volume,
            its density, and whether that is an assumption; None if it is all of it.
    """

    def __init__(
        self,
        file: Any,
        properties: Properties,
        default_kg_m3: Callable[[Any], float] = lambda _: DEFAULT_DENSITY_KG_M3,
        instead_kg_m3: Callable[[Any], float | None] = lambda _: None,
        solid_share: Callable[[Any, float, float, bool], float | None] = lambda *_: None,
    ) -> None:
        self._properties = properties
        self._instead_kg_m3 = instead_kg_m3
        self._default_kg_m3 = default_kg_m3
        self._solid_share = solid_share
        self._units = Units(file)
        self._density_by_material: dict[int, float | None] = {}
        self._old_densities: dict[int, float] = {}
        if file.schema == "IFC2X3":
            for entry in file.by_type("IfcGeneralMaterialProperties"):
                if entry.MassDensity:
                    self._old_densities[entry.Material.id()] = float(entry.MassDensity)

    def of(self, product: Any, volume_m3: float, exact: bool, box_m3: float = inf, sheet_m2: float = 0.0) -> Mass:
        """Return the mass of one product.

        A stated weight comes first, then volume times density of its material, then volume times default density. What
        is stated must fit the mesh: its volume if that is exact, otherwise its box.

        Args:
            product: The ``IfcProduct``.
            volume_m3: Volume of its mesh.
            exact: Whether that volume is exact; if not, a stated volume replaces it.
            box_m3: Volume of the box around its mesh, as thick as a part is.
            sheet_m2: Area of the sheets in an open mesh, whose thickness is assumed; a stated one replaces it.
        """
        box_m3 = max(box_m3, _SHEETS_M[1] * sheet_m2)  # the surface of a wall stands for all of it
        expected, volume_m3 = self.by_volume(product, volume_m3, exact, box_m3, sheet_m2)
        return self.stated(product, expected, volume_m3, box_m3)

    def by_volume(
        self, product: Any, volume_m3: float, exact: bool, box_m3: float = inf, sheet_m2: float = 0.0
    ) -> tuple[Mass, float]:
        """Return the mass of one product by volume and density, and that volume; the arguments are those of ``of``."""
        guess_m3 = volume_m3
        doubts: tuple[str, ...] = ()
        if not exact:
            volume_m3, doubts = self._volume(product, volume_m3, max(volume_m3, box_m3))
            thickness_m = self._thickness(product) if sheet_m2 and volume_m3 == guess_m3 else None
            if thickness_m is not None:
                volume_m3 += (thickness_m - SHEET_M) * sheet_m2
        elif volume_m3 > (1.0 + _ROUNDING) * box_m3:
            volume_m3, doubts = box_m3, (OVERFULL,)
        instead = self._instead_kg_m3(product)
        density = self._density(product) if instead is None else None
        kg_m3 = (instead or self._default_kg_m3(product)) if density is None else density
        source = "default" if density is None else "density"
        is_guess = not exact and volume_m3 == guess_m3
        share = self._solid_share(product, volume_m3, kg_m3, density is None) if volume_m3 > 0.0 else None
        if share is None:
            return Mass(volume_m3 * kg_m3, source, is_guess, doubts), volume_m3
        stated_m3, _ = self._volume(product, volume_m3, _STATED_LESS * volume_m3)
        if stated_m3 < volume_m3 and density is not None:
            return Mass(stated_m3 * kg_m3, source), volume_m3
        # the volume is that of an assumption, so the source is the least reliable
        return Mass(share * volume_m3 * kg_m3, SOURCES[-1], is_guess, (*doubts, DRAWN_SOLID)), volume_m3

    def stated(self, product: Any, expected: Mass, volume_m3: float, box_m3: float = inf) -> Mass:
        """Return the stated mass of a product if its volume does not contradict it, otherwise the greater one of both.

        A weight in tonnes or grams that is stated in kilograms is converted before that. Zero is not stated.

        Args:
            product: The ``IfcProduct``.
            expected: Its mass by volume and density.
            volume_m3: That volume.
            box_m3: The most that its volume can be, if that is guessed.
        """
        weights = self._properties.stated(product, _WEIGHTS, negative=True)
        masses_kg = [kg for kg in map(self._units.kg, weights) if kg is not None]
        if not masses_kg or not volume_m3 > 0.0:
            return expected
        low_kg, high_kg = (share * expected.kg for share in _DOUBTFUL_SHARES)
        if expected.guessed:
            low_kg, high_kg = _LEAST_GUESS_SHARE * low_kg, max(volume_m3, box_m3) / volume_m3 * high_kg
        as_stated = _first(masses_kg, (1.0,), low_kg, high_kg)
        if as_stated is not None:
            odd = not expected.guessed and not _ODD_KG_M3[0] <= as_stated / volume_m3 <= _ODD_KG_M3[1]
            return Mass(as_stated, "quantity", doubts=(WEIGHT_ODD,) * odd)
        shares = _SLIP_DEFAULT_SHARES if expected.source == "default" else _SLIP_SHARES
        low_kg, high_kg = (share * expected.kg for share in shares)
        converted = _first(masses_kg, _WEIGHT_SLIPS, low_kg, high_kg)
        doubt, counts_kg = (WEIGHT_DOUBTFUL, masses_kg[0]) if converted is None else (WEIGHT_SLIP, converted)
        found = replace(expected, doubts=(*expected.doubts, doubt), doubted_kg=(masses_kg[0], expected.kg))
        if expected.kg <= counts_kg <= _ABSURD_SHARE * expected.kg:
            return replace(found, kg=counts_kg, source="quantity", guessed=False)
        return found

    def _volume(self, product: Any, guess_m3: float, most_m3: float) -> tuple[float, tuple[str, ...]]:
        """Return the stated volume of a product whose mesh is open if it fits, otherwise the guess; and doubts."""
        stated = self._properties.stated(product, _VOLUMES)
        volumes_m3 = [m3 for m3 in map(self._units.m3, stated) if m3 is not None]
        as_stated = _first(volumes_m3, (1.0,), _LEAST_SHARE * guess_m3, most_m3)
        if as_stated is not None:
            return as_stated, ()
        converted = _first(volumes_m3, _VOLUME_SLIPS, _LEAST_SLIP_SHARE * guess_m3, most_m3)
        if converted is not None:
            return converted, (VOLUME_SLIP,)
        return guess_m3, (VOLUME_REFUSED,) * bool(volumes_m3)

    def _thickness(self, product: Any) -> float | None:
        """Return the thickness of a sheet: that of its layers, otherwise a stated one; None if there is none."""
        layers_m = sum(thickness for _, thickness in layers_of(product)) * self._units.metres
        stated = map(self._units.m, self._properties.stated(product, _THICKNESSES))
        found = [layers_m] if has_thickness(product) else [one for one in stated if one is not None]
        return next((one for one in found if _SHEETS_M[0] <= one <= _SHEETS_M[1]), None)

    def _density(self, product: Any) -> float | None:
        """Return the mean density of the layers with a known density, weighted by thickness; None if there are none."""
        known = [(self._density_of(material), thickness) for material, thickness in layers_of(product)]
        pairs = [(density, thickness) for density, thickness in known if density is not None]
        total = sum(thickness for _, thickness in pairs)
        return sum(density * thickness for density, thickness in pairs) / total if total > 0 else None

    def _density_of(self, material: Any) -> float | None:
        key = material.id()
        if key not in self._density_by_material:
            by_name = density_by_name(label(material.Name))
            stated = self._stated_density(material)
            if stated is not None and by_name is None and stated < _PLAUSIBLE_KG_M3[0]:
                stated *= 1e3  # tonnes per cubic metre
            elif stated is not None and by_name is not None and abs(stated * 1e3 - by_name) < abs(stated - by_name):
                stated *= 1e3
            if stated is None or not _PLAUSIBLE_KG_M3[0] <= stated <= _PLAUSIBLE_KG_M3[1]:
                stated = by_name
            self._density_by_material[key] = stated
        return self._density_by_material[key]

    def _stated_density(self, material: Any) -> float | None:
        """Return the density that the properties of a material state; None if they state none."""
        old = self._old_densities.get(material.id())
        entries: Iterable[Stated] = () if old is None else (Stated(old),)
        if old is None:
            sets = getattr(material, "HasProperties", None) or ()
            entries = (entry for one in sets for name, entry in numbers_in(one) if name == "massdensity")
        return next((found for found in map(self._units.kg_m3, entries) if found is not None), None)


def weakest(sources: Sequence[str]) -> str:
    """Return the least reliable of several mass sources."""
    return max(sources, key=SOURCES.index)


def _first(values: Sequence[float], factors: Sequence[float], low: float, high: float) -> float | None:
    """Return the first value times a factor, earlier values first, that is within limits."""
    return next((value * factor for value in values for factor in factors if low <= value * factor <= high), None)
