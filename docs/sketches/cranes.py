"""Cranes: the load chart, two of them, and one that moves."""

from __future__ import annotations

from docs.sketches.canvas import FAINT, FORBIDDEN, GREY, MOVING, PART, SET, Sketch


def chart() -> Sketch:
    """Capacity over radius: steps, 85 %, and a part at its place."""
    draw = Sketch("A load chart: between two radii the smaller capacity holds, and 85 % of it is used", height=320)
    draw.arrow((60, 270), (500, 270))
    draw.arrow((60, 270), (60, 30))
    draw.words((440, 292), "radius")
    draw.words((70, 40), "capacity")
    steps = (
        (60, 60),
        (140, 60),
        (140, 110),
        (220, 110),
        (220, 155),
        (300, 155),
        (300, 190),
        (380, 190),
        (380, 215),
        (460, 215),
    )
    draw.line(*steps, width=2.5)
    draw.line(*((x, 270 - 0.85 * (270 - y)) for x, y in steps), colour=MOVING, dashed=True, width=2)
    draw.circle((250, 200), 6, SET)
    draw.words((262, 208), "A", SET)
    draw.circle((330, 196), 6, PART)
    draw.words((342, 184), "B", PART)
    draw.circle((420, 170), 6, FORBIDDEN)
    draw.words((432, 168), "C", FORBIDDEN)
    draw.words((520, 70), "solid: the chart\ndashed: 85 % of it", GREY)
    draw.words((520, 130), "A is planned", SET)
    draw.words((520, 160), "B needs more than 85 %:\nplanned, with a remark", PART)
    draw.words((520, 208), "C is infeasible", FORBIDDEN)
    draw.words((60, 312), "All on the hook counts: load, rigging and hook block.", GREY)
    return draw


def two_cranes() -> Sketch:
    """Two circles from above, and who waits."""
    draw = Sketch("Two cranes: where their jibs overlap, one passes before the other", height=380)
    draw.circle((230, 150), 130, "#ebf8ff", MOVING)
    draw.circle((420, 150), 130, "none", PART)
    draw.circle((230, 150), 6, MOVING, MOVING)
    draw.circle((420, 150), 6, PART, PART)
    draw.line((230, 150), (340, 100), colour=MOVING, width=3)
    draw.line((420, 150), (520, 225), colour=PART, width=3)
    draw.words((215, 175), "north", MOVING, "end")
    draw.words((435, 148), "south", PART)
    draw.words((325, 160), "both\nreach", GREY, "middle", 12)
    draw.words(
        (570, 60),
        "At every moment\nthey keep their\nseparation, on\nplan or in height,\neven if they brake.",
        GREY,
    )
    for n, (name, colour, bars) in enumerate(
        (("north", MOVING, ((120, 170), (300, 180), (560, 120))), ("south", PART, ((120, 110), (370, 180))))
    ):
        top = 302 + 32 * n
        draw.words((30, top + 16), name, colour)
        for left, width in bars:
            draw.box((left, top), (width, 22), "#bee3f8" if n == 0 else "#fbd38d", colour)
    draw.line((230, 345), (370, 345), colour=GREY, dashed=True)
    draw.words((300, 366), "waits, then starts", GREY, "middle", 12)
    draw.arrow((120, 374), (690, 374), colour=GREY)
    return draw


def set_ups() -> Sketch:
    """A mobile crane in two places, one after the other."""
    draw = Sketch("A crane that moves: two set-ups, each with its parts, and the move between them", height=380)
    draw.box((210, 60), (300, 120), FAINT)
    draw.words((360, 50), "building, from above", where="middle")
    for n, (x, name, colour) in enumerate(((250, "west", MOVING), (470, "east", PART))):
        draw.circle((x, 190), 100, "none", colour, dashed=True)
        draw.box((x - 16, 208), (32, 24), "#bee3f8" if n == 0 else "#fbd38d", colour)
        draw.words((x, 252), name, colour, "middle")
    draw.arrow((270, 220), (450, 220), colour=GREY)
    draw.words((360, 212), "drives", GREY, "middle", 12)
    for k in range(6):
        draw.box((222 + 48 * k, 100), (34, 44), "#bee3f8" if k < 3 else "#fbd38d", MOVING if k < 3 else PART)
    draw.words((20, 320), "time", GREY)
    for left, width, text, fill in (
        (70, 70, "rig", FAINT),
        (140, 190, "lifts of west", "#bee3f8"),
        (330, 150, "derig, drive, rig", FAINT),
        (480, 190, "lifts of east", "#fbd38d"),
    ):
        draw.labelled((left, 300), (width, 34), text, fill)
    draw.words((70, 362), "The crane is in one place at a time, and returns to none.", GREY)
    return draw
