"""Room around a load: clearances, how they give way, zones, swing."""

from __future__ import annotations

from docs.sketches.canvas import FAINT, FORBIDDEN, GREY, INK, MOVING, PART, SET, Sketch


def clearances() -> Sketch:
    """From the yard over a wall to the place: which distance holds where."""
    draw = Sketch("A lift from the side: the clearances of its departure, transit and approach", 770, 360)
    draw.line((20, 320), (700, 320), width=2.5)
    draw.box((60, 290), (90, 30), PART)
    draw.words((105, 340), "yard", where="middle")
    draw.box((205, 200), (60, 120), FAINT)
    draw.words((235, 270), "part", where="middle")
    draw.box((60, 210), (90, 30), "none", MOVING, dashed=True)
    draw.box((350, 190), (70, 130), FAINT)
    draw.words((385, 260), "what is\nthere", where="middle")
    draw.box((490, 170), (40, 150), FAINT)
    draw.box((660, 270), (30, 50), FAINT)
    draw.box((565, 190), (90, 30), "none", MOVING, dashed=True)
    draw.box((565, 290), (90, 30), "#c6f6d5", SET, dashed=True)
    draw.words((610, 340), "place", where="middle")
    draw.box((60, 80), (90, 30), "#bee3f8", MOVING)
    draw.box((345, 80), (90, 30), "#bee3f8", MOVING)
    draw.arrow((105, 286), (105, 114), colour=MOVING)
    draw.arrow((154, 95), (341, 95), colour=MOVING)
    draw.arrow((439, 95), (610, 95), (610, 284), colour=MOVING)
    draw.line((390, 80), (390, 20), colour=MOVING)
    draw.measure((385, 112), (385, 188), "transit_clearance_m: 2 m")
    draw.measure((392, 40), (460, 40), "rope_clearance_m: 0.5 m,\nto what is higher", (42, -4))
    draw.measure((152, 225), (203, 225), "", (0, 0))
    draw.words((112, 160), "departure_clearance_m:\n0.5 m", GREY)
    draw.measure((532, 205), (563, 205), "", (0, 0))
    draw.words((618, 130), "approach_\nclearance_m: 0.5 m", GREY)
    draw.words(
        (20, 30), "departure: straight up\ntransit: from there to above the place\napproach: the last moves", GREY
    )
    return draw


def gives_way() -> Sketch:
    """The ladder of a default clearance."""
    draw = Sketch("A default clearance gives way step by step", height=300)
    steps = ("2 m", "1.5 m", "1 m", "0.5 m", "0.25 m", "0 m")
    for n, step in enumerate(steps):
        left, top = 30 + n * 112, 40 + n * 26
        draw.labelled((left, top), (84, 30), step, "#bee3f8" if n == 0 else "#fefcbf" if n < 5 else "#fed7d7")
        if n < 5:
            draw.arrow((left + 86, top + 15), (left + 125, top + 15), (left + 125, top + 26), colour=GREY)
    draw.words((130, 32), "no path, and no other place in the yard: the next smaller step", GREY)
    draw.words((30, 150), "all of it is kept:\nno remark", MOVING)
    draw.words((240, 235), "less is kept: remark small_clearance, and a condition of the verdict", PART)
    draw.words(
        (30, 275),
        "no path at all: the lift is infeasible. A value of yours has one step only: kept, or infeasible.",
        FORBIDDEN,
    )
    return draw


def swing() -> Sketch:
    """A gust, and the clearance that it uses."""
    draw = Sketch("A gust swings the load; it may use the clearance in transit", height=300)
    draw.line((60, 30), (480, 30), width=4)
    draw.words((60, 22), "jib")
    draw.line((220, 30), (220, 180))
    draw.box((180, 180), (80, 50), "#bee3f8", MOVING)
    draw.line((220, 30), (320, 172), colour=GREY, dashed=True)
    draw.box((282, 170), (80, 50), "none", MOVING, dashed=True)
    draw.box((420, 120), (60, 150), FAINT)
    draw.measure((222, 250), (322, 250), "swing in the gust", (-50, 22))
    draw.measure((262, 205), (418, 205), "", (0, 0))
    draw.words((425, 110), "what is there")
    draw.words((500, 180), "clearance in transit\nfrom the load at rest\nto what is there", GREY)
    for n in range(3):
        draw.arrow((60, 170 + 25 * n), (130, 170 + 25 * n), colour=GREY)
    draw.words((60, 150), "gust", GREY)
    draw.words((500, 255), "swing ≤ clearance:\nthe wind is permitted", SET)
    return draw


def zones() -> Sketch:
    """What each kind of zone keeps out."""
    draw = Sketch("What each kind of zone keeps out", height=230)
    heads = ("empty hook", "hook with load", "outline of the load")
    rows = (
        ("prohibited", "out", "out", "may enter"),
        ("no_load", "may enter", "out", "out"),
        ("public", "out", "out", "out"),
    )
    for n, head in enumerate(heads):
        draw.words((260 + n * 170, 40), head, where="middle")
    for n, (name, *cells) in enumerate(rows):
        draw.words((40, 82 + n * 52), name)
        for k, cell in enumerate(cells):
            kept_out = cell == "out"
            draw.labelled((190 + k * 170, 60 + n * 52), (140, 34), cell, "#fed7d7" if kept_out else "#c6f6d5", INK)
    draw.words((40, 215), "slow, limiter and assembly keep nothing out.", GREY)
    return draw
