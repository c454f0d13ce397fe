"""Around the plan: what it is made of, what is in the way, when it happens, and what it becomes."""

from __future__ import annotations

from docs.sketches.canvas import FAINT, FORBIDDEN, GREY, MOVING, PART, SET, Sketch


def obstructions() -> Sketch:
    """The shapes of an obstruction file, from above."""
    draw = Sketch("Obstructions on a site, from above: a box, a cylinder, cells, and points of a scan", height=300)
    draw.arrow((40, 260), (120, 260))
    draw.arrow((40, 260), (40, 180))
    draw.words((124, 265), "x")
    draw.words((36, 172), "y")
    draw.words((52, 282), "the site frame", GREY)
    draw.box((190, 50), (420, 190), FAINT)
    draw.words((400, 42), "site", where="middle")
    draw.labelled((220, 80), (70, 120), "box", "#fed7d7", FORBIDDEN)
    draw.circle((355, 110), 32, "#fed7d7", FORBIDDEN)
    draw.words((355, 115), "cylinder", where="middle", size=12)
    for x, y in ((320, 180), (340, 180), (340, 200), (360, 200)):
        draw.box((x, y), (20, 20), "#fed7d7", FORBIDDEN)
    draw.words((388, 214), "voxels", size=12)
    for n in range(24):
        draw.circle((450 + 13 * (n % 8) + 3 * (n // 8), 100 + 14 * (n // 8) + 4 * (n % 3)), 2.5, FORBIDDEN, FORBIDDEN)
    draw.words((490, 165), "points of a scan", where="middle", size=12)
    draw.box((560, 190), (100, 36), "#fed7d7", FORBIDDEN, dashed=True)
    draw.words((560, 262), "clipped at the edge, with a note", GREY, size=12)
    return draw


def days() -> Sketch:
    """Deliveries, unloading, lifts and a wait over two days."""
    draw = Sketch(
        "Two working days: lorries come, the crane unloads and lifts, and waits run through the night", height=250
    )
    for left, name in ((110, "day 1"), (420, "day 2")):
        draw.box((left, 30), (270, 150), "#f7fafc", FAINT)
        draw.words((left + 135, 22), name, where="middle")
    draw.words((20, 72), "lorries")
    draw.words((20, 122), "crane")
    draw.words((20, 167), "joints")
    for left, text in ((110, "1"), (160, "2"), (420, "3")):
        draw.labelled((left, 50), (48, 32), text, "#feebc8", PART)
    draw.labelled((110, 100), (100, 34), "unload", "#feebc8", PART)
    draw.labelled((210, 100), (165, 34), "lifts", "#bee3f8", MOVING)
    draw.labelled((420, 100), (50, 34), "unl.", "#feebc8", PART)
    draw.labelled((490, 100), (195, 34), "lifts of the next storey", "#bee3f8", MOVING)
    draw.arrow((375, 162), (488, 162), colour=SET)
    draw.words((430, 155), "16 h", SET, "middle")
    draw.words(
        (20, 215),
        "A lift begins only if it ends before the break or the end of the shift. Waits run through nights.",
        GREY,
    )
    return draw


def exports() -> Sketch:
    """From one log to other people's files."""
    draw = Sketch("One log becomes programmes, 4D models, tables, films and robot trajectories", height=300)
    draw.labelled((40, 120), (120, 60), "log\n(.mcap)", "#feebc8", PART)
    for n, (name, who) in enumerate(
        (
            ("msproject", "programme: MS Project, Primavera P6"),
            ("ifc", "4D model: building with tasks"),
            ("csv, json", "tables: spreadsheets, scripts"),
            ("glb", "3D animation: viewers"),
            ("ros2, mjcf, urdf", "robots and simulators"),
        )
    ):
        top = 16 + 56 * n
        draw.labelled((260, top), (150, 38), name, "#bee3f8", MOVING)
        draw.words((425, top + 24), who)
        draw.arrow((160, 150), (258, top + 19), colour=GREY)
    draw.words((40, 215), "Each shows what\nthe log says.", GREY)
    return draw


def ground() -> Sketch:
    """Where the ground is: terrain, the storey at the ground, excavation, piles."""
    draw = Sketch("The height of the ground, and the excavation around what is set below it", height=300)
    draw.line((20, 150), (230, 150), (230, 230), (530, 230), (530, 150), (700, 150), width=2.5)
    draw.box((260, 60), (240, 90), FAINT)
    draw.words((380, 108), "building", where="middle")
    draw.box((260, 150), (240, 80), "#c6f6d5", SET)
    draw.words((380, 195), "basement", where="middle")
    for x in (290, 380, 470):
        draw.box((x - 6, 230), (12, 50), FAINT)
    draw.words((500, 272), "piles: in place before the first lift", GREY, size=12)
    draw.words((30, 140), "1. terrain around the building")
    draw.words((540, 100), "2. a stated level\n3. the storey at the\n   ground")
    draw.words((30, 272), "4. the top of the piles\n5. the lowest part", GREY)
    draw.measure((230, 185), (260, 185), "1 m wider", (-102, 5))
    return draw


def sectors() -> Sketch:
    """A mobile crane from above: outriggers, heading, sectors."""
    draw = Sketch("A mobile crane from above: outriggers, heading, and a sector with a chart of its own", height=300)
    draw.shape((290, 150), (160, 75), (160, 225), fill="#feebc8", line=PART)
    draw.words((80, 155), "over rear:\na chart\nof its own", PART)
    draw.box((220, 125), (190, 50), FAINT)
    draw.words((360, 155), "carrier", where="middle")
    for x, y in ((225, 80), (365, 80), (225, 210), (365, 210)):
        draw.box((x, y), (16, 16), "#bee3f8", MOVING)
        draw.line((x + 8, y + (16 if y < 150 else 0)), (x + 8, 125 if y < 150 else 175), colour=MOVING)
    draw.circle((290, 150), 7, "#1f2933")
    draw.arrow((410, 150), (520, 150))
    draw.words((528, 155), "heading_deg: where\nits front points")
    draw.words((392, 92), "outriggers: pads from the slewing axis", MOVING)
    draw.words((300, 262), "every other direction: the chart without a sector", GREY, "middle")
    draw.line((290, 150), (250, 40), width=3)
    draw.words((262, 40), "boom: its direction decides which chart holds")
    return draw
