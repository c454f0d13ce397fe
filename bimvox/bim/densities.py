"""Density by the name of a material, in the languages that models use.

Values: EN 1991-1-1 Annex A where it lists the material (1 kN/m3 taken as 100 kg/m3), EN 338 and EN 14080 for timber,
manufacturers' data sheets for boards and insulation. Mixed layers (studs, cavities) have the density of the whole
layer, not that of the material they are named after.
"""

from __future__ import annotations

import functools
import re
import unicodedata

DEFAULT_DENSITY_KG_M3 = 2400.0
"""For parts of unknown material: plain concrete, which is on the safe side for most parts."""
STEEL_KG_M3 = 7850.0

_TABLE: tuple[tuple[str, float], ...] = (
    # First match wins: compounds before the words they contain ("Stahlbeton" is concrete, "Betonstahl" is steel).
    (
        r"betonst[aå][hl]l?|betonstaal|rebar|reinforcing|reinforcement|bewehrung|wapening|armadura|\bfeb ?\d{3}",
        STEEL_KG_M3,
    ),
    # Mostly air: a 92 mm stud layer modelled as a solid is not 92 mm of steel.
    (r"\bstuds?\b|furring|st[äa]nderwerk|metal ?stud|(joist|rafter|truss|framing)\b.*\blayer", 100.0),
    (r"porenbeton|gasbeton|cellenbeton|aerated|aircrete|ytong|siporex|b[ée]ton cellulaire|hormig[oó]n celular", 600.0),
    (r"lightweight concrete|leichtbeton|lichtbeton|b[ée]ton l[ée]ger|hormig[oó]n ligero", 1800.0),
    (r"concrete block|betonblo[ck]k?|\bcmu\b|parpaing|bloque de hormig[oó]n", 1800.0),
    (r"\bair\b|\bair (space|gap)|cavity|luft(schicht|raum)?\b|spouw|lame d.air|c[áa]mara de aire", 1.2),
    (
        r"insulat|d[äa]mm|isolati|isolant|aislante|\bisol\b|wool|wolle\b|\bwol\b|laine|lana (mineral|de roca)"
        r"|\beps\b|\bxps\b|\bpir\b|\bpur?\b|polystyr|polyureth|styro|foam glass|schaum",
        40.0,
    ),
    # EN 1991-1-1 Table A.1: normal weight concrete 24 kN/m3, and 1 kN/m3 more for its reinforcement.
    (
        r"concrete|beton|b[ée]ton|hormig[oó]n|calcestruzzo|concreto|бетон|混凝土|precast|kanaalplaat|breedplaat"
        r"|predal|\bc\d\d[/ -]\d\d|\bc(12|16|20|25|30|35|40|45|50|55|60)\b|\bb\d\d\b",
        2500.0,
    ),
    (r"alumini?um|aluminio|alluminio|\balu\b", 2700.0),
    (r"copper|kupfer|koper|cuivre|cobre|\brame\b", 8900.0),
    (r"\blead\b|\bblei\b|plomb", 11300.0),
    (r"\bzin[ck]\b|titanzink", 7200.0),
    (
        r"steel|stahl|staal|\bacier|\bacero|acciaio|\baço\b|сталь|\bst[åa]l\b|\bst ?(33|37|44|50|52|60)\b"
        r"|\bs ?(235|275|355|420|450|460|690)|\bfe ?\d{3}|\ba36\b|\ba992\b|metal|métal|\biron|gusseisen|inox",
        STEEL_KG_M3,
    ),
    (r"plaster|gypsum|gips|pl[âa]tre|yeso|cartongesso|drywall", 900.0),
    (r"\bosb\b|plywood|sperrholz|multiplex|contreplaqu[ée]|\bmdf\b|chipboard|spanplatte|particle ?board", 650.0),
    (
        r"timber|wood|holz|\bhout|\bbois\b|madera|legno|madeira|древесина|lumber|glulam|gelamineerd|lamell[ée]"
        r"|laminado|\bclt\b|\bxlam\b|\blvl\b|\bgl ?\d\d|\bkvh\b|\bbsh\b|\bc24\b|spruce|fichte|vuren|\bpine\b"
        r"|larch|l[äa]rche|\b[ée]pic[ée]a",
        500.0,
    ),
    (r"\boak\b|\beiche\b|eiken|ch[êe]ne|\bbeech\b|buche\b|cherry|maple|walnut|azob[ée]|hardwood", 750.0),
    (r"granit|marble|marmor|marmer|marbre|basalt|naturstein|natuursteen|slate\b|schiefer", 2700.0),
    (
        r"brick|masonry|mauerwerk|ziegel|metselwerk|baksteen|ladrillo|brique|mattone|ma[çc]onnerie|mamposter[íi]a"
        r"|block|kalk[sz]and|sand[ -]?lime|klinker",
        1800.0,
    ),
    (r"ceramic|porcelain|fliese|tegel\b|carrelage|azulejo|\btiles?\b|keramik", 2300.0),
    (r"glass|glas\b|glazing|verre|vidrio|vetro|vidro", 2500.0),
    (r"mortar|m[öo]rtel|grout|screed|estrich|dekvloer|chape\b|mortero", 2000.0),
    (r"asphalt|bitum", 2100.0),
    (r"soil|erdreich|\bgrond\b|sand\b|\bzand\b|gravel|kies\b|grind\b|schotter|ballast", 1800.0),
    (r"\bstone\b|\bstein\b|\bsteen\b|\bpierre\b|\bpiedra\b|pietra", 2400.0),
    (r"\bpvc\b|plastic|kunststo[f]+|acryl|polycarbonat|rubber|gummi|neopreen|neoprene|\bepdm\b", 1300.0),
)
_COMPILED = tuple((re.compile(pattern), density) for pattern, density in _TABLE)


@functools.cache
def density_by_name(material: str) -> float | None:
    """Return the density that a material's name implies, kg/m3; None if it implies none.

    >>> density_by_name("Concrete - Precast C35/45")
    2500.0
    """
    name = unicodedata.normalize("NFC", material).lower().replace("_", " ")
    return next((density for pattern, density in _COMPILED if pattern.search(name)), None)
