"""The plan as a whole: what becomes of a part, in which order, when, and what verified means."""

from __future__ import annotations

from docs.sketches.canvas import FAINT, FORBIDDEN, GREY, MOVING, PART, SET, Sketch


def ways() -> Sketch:
    """From what a part is to how it gets to its place."""
    draw = Sketch("What a part is decides how it gets to its place", height=300)
    draw.labelled((20, 120), (130, 60), "a part of\nthe model")
    draw.labelled((200, 120), (140, 60), "its kind, size\nand mass", FAINT)
    draw.arrow((150, 150), (198, 150))
    for n, (name, text, fill) in enumerate(
        (
            ("crane", "a lift with a path and a proof", "#bee3f8"),
            ("in_situ", "cast in place: a step with times", "#feebc8"),
            ("built", "built in place by its trade: a step", "#feebc8"),
            ("by_hand", "set by people, in bundles", "#feebc8"),
            ("out", "not in the plan", FAINT),
        )
    ):
        top = 20 + n * 54
        draw.labelled((410, top), (90, 34), name, fill)
        draw.words((515, top + 22), text, size=12)
        draw.arrow((340, 150), (408, top + 17), colour=GREY)
    draw.words((20, 220), "Your line in kinds, or\nin [[component]],\nwins over all of it.", GREY)
    return draw


def order() -> Sketch:
    """What must come before what, and where there is a choice."""
    draw = Sketch("The erection sequence: a part is set after what it rests on", height=320)
    draw.line((20, 290), (430, 290), width=2.5)
    places = (
        ((60, 200), (24, 90), "1"),
        ((200, 200), (24, 90), "2"),
        ((340, 200), (24, 90), "4"),
        ((60, 180), (160, 20), "3"),
        ((226, 180), (138, 20), "5"),
        ((60, 158), (304, 22), "6"),
        ((60, 68), (24, 90), "7"),
        ((340, 68), (24, 90), "8"),
    )
    for (x, y), (width, height), number in places:
        draw.labelled((x, y), (width, height), number, "#c6f6d5", SET)
    draw.words((460, 50), "must: 3 after 1 and 2,\n6 after 3 and 5, 7 after 6", MOVING)
    draw.words((460, 110), "storey by storey:\n7 and 8 after 1 to 6", SET)
    draw.words(
        (460, 170), "choice: the bay 1, 2, 3 first,\nor all columns first. The\nshortest crane time decides.", PART
    )
    draw.words((460, 250), "before, after and programme\nof yours count too.", GREY)
    return draw


def two_clocks() -> Sketch:
    """Crane time stands while everything waits for concrete."""
    draw = Sketch("Crane time and elapsed time: while all wait for concrete, the crane's clock stands", height=240)
    draw.words((20, 52), "work")
    for left, width, text, fill in (
        (110, 120, "lifts 1 to 5", "#bee3f8"),
        (230, 110, "cast", "#feebc8"),
        (340, 170, "concrete hardens", FAINT),
        (510, 150, "lifts 6 to 9", "#bee3f8"),
    ):
        draw.labelled((left, 30), (width, 36), text, fill)
    draw.words((20, 112), "elapsed")
    draw.arrow((110, 107), (670, 107))
    draw.words((20, 162), "crane")
    draw.arrow((110, 157), (230, 157), colour=MOVING)
    draw.line((230, 157), (510, 157), colour=GREY, dashed=True)
    draw.arrow((510, 157), (670, 157), colour=MOVING)
    draw.words((370, 150), "pause: this clock stands", GREY, "middle", 12)
    draw.words(
        (20, 215), "Lifts that do not rest on the new work would be done during the wait; here there are none.", GREY
    )
    return draw


def verified() -> Sketch:
    """Planner and proof share the log, not the code."""
    draw = Sketch("The proof reads the log, and has rules and code of its own", height=330)
    draw.labelled((20, 40), (150, 60), "your files: model,\nsite, obstructions", FAINT)
    draw.labelled((230, 40), (120, 60), "planner", "#bee3f8", MOVING)
    draw.labelled((410, 40), (120, 60), "log", "#feebc8", PART)
    draw.arrow((170, 70), (228, 70))
    draw.arrow((350, 70), (408, 70))
    draw.labelled((410, 160), (120, 60), "proof", "#c6f6d5", SET)
    draw.arrow((470, 100), (470, 158))
    draw.arrow((530, 190), (588, 190))
    draw.words((600, 180), "verdict,\nconditions,\nclaims", SET)
    draw.line((210, 130), (390, 130), colour=FORBIDDEN, dashed=True)
    draw.words((300, 150), "no search, no rule and\nno result goes across", FORBIDDEN, "middle")
    draw.arrow((95, 100), (95, 190), (408, 190), colour=GREY, dashed=True)
    draw.words((105, 208), "--site, --model, --obstructions:\nis this log of these files?", GREY)
    draw.box((20, 260), (680, 50), "none", GREY, dashed=True)
    draw.words((35, 290), "Outside: the real ground, people, weather, strength, and whether the model is right.", GREY)
    return draw


def watching() -> Sketch:
    """What becomes of each lift after a change."""
    draw = Sketch("After a change each lift is kept, planned again, or infeasible", height=270)
    draw.labelled((20, 100), (130, 60), "obstructions\nchange")
    draw.labelled((200, 100), (170, 60), "is a new obstruction\nin what its proof read?", FAINT)
    draw.arrow((150, 130), (198, 130))
    for top, text, answer, fill, colour in (
        (25, "kept, bit for bit", "no", "#c6f6d5", SET),
        (110, "planned and proven again", "yes", "#bee3f8", MOVING),
        (195, "infeasible, with the reason", "no path", "#fed7d7", FORBIDDEN),
    ):
        draw.labelled((470, top), (230, 42), text, fill, colour)
        draw.arrow((370, 130), (468, top + 21), colour=GREY)
        draw.words((400, 92 if top < 50 else 124 if top < 150 else 182), answer, GREY, size=12)
    draw.words((20, 250), "Lifts that are done stay as they are. Later lifts move in time.", GREY)
    return draw
