"""What hangs on the hook, and what holds it when the slings come off."""

from __future__ import annotations

from docs.sketches.canvas import FAINT, GREY, MOVING, PART, SET, Sketch


def slings() -> Sketch:
    """Two legs, the angle between them, and the hook's height."""
    draw = Sketch("Slings: the hook is above the centre of mass, the legs spread by at most 60 degrees", height=320)
    draw.line((240, 15), (240, 50))
    draw.labelled((222, 50), (36, 28), "", FAINT)
    draw.words((270, 68), "hook and hook block: part of the load")
    draw.line((240, 78), (150, 234), width=2)
    draw.line((240, 78), (330, 234), width=2)
    draw.line((217, 118), (240, 126), (263, 118), colour=GREY)
    draw.words((240, 148), "≤ 60°", where="middle")
    draw.words((318, 150), "chain sling and shackles:\nthe smallest whose limits hold")
    draw.box((90, 234), (300, 45), "#bee3f8", MOVING)
    for x in (150, 330):
        draw.circle((x, 234), 5, PART)
    draw.circle((240, 257), 5, "#1f2933")
    draw.line((240, 160), (240, 252), colour=GREY, dashed=True)
    draw.words((252, 262), "centre of mass")
    draw.measure((150, 298), (330, 298), "lifting points; more than 6 m apart: a spreader", (100, 5))
    return draw


def turning_over() -> Sketch:
    """Lying, turning, upright: the share of each hook."""
    draw = Sketch("A panel is turned over between the main and the auxiliary hook", height=300)
    for left, head in ((30, "1. lying"), (270, "2. turning"), (510, "3. upright")):
        draw.words((left, 30), head)
    draw.shape((50, 190), (220, 190), (220, 204), (50, 204), fill="#bee3f8", line=MOVING)
    draw.line((60, 60), (60, 190), colour=PART, width=2)
    draw.line((210, 60), (210, 190), width=2)
    draw.shape((290, 246), (402, 118), (413, 127), (301, 256), fill="#bee3f8", line=MOVING)
    draw.line((305, 60), (318, 214), colour=PART, width=2)
    draw.line((408, 60), (408, 122), width=2)
    draw.shape((560, 90), (574, 90), (574, 260), (560, 260), fill="#bee3f8", line=MOVING)
    draw.line((567, 60), (567, 90), width=2)
    draw.words((60, 52), "auxiliary", PART, "middle", 12)
    draw.words((210, 52), "main", where="middle", size=12)
    draw.words((30, 235), "auxiliary: two thirds\nmain: one third", GREY)
    draw.words((430, 160), "shares are\ncomputed every 5°", GREY, size=12)
    draw.words((590, 160), "main: all of it;\na crew takes the\nauxiliary hook off", GREY, size=12)
    draw.line((20, 282), (700, 282), width=2.5)
    draw.words((30, 298), "ground", GREY, size=12)
    return draw


def props() -> Sketch:
    """A wall on two push-pull props."""
    draw = Sketch("A wall is held by two push-pull props until its joints carry", height=320)
    draw.line((20, 280), (700, 280), width=2.5)
    draw.box((180, 60), (24, 220), "#c6f6d5", SET)
    draw.words((192, 50), "wall, from the side", where="middle")
    draw.line((204, 133), (310, 280), width=4, colour=PART)
    draw.circle((204, 133), 5, PART)
    draw.circle((310, 280), 5, PART)
    draw.words((252, 272), "40° to 60°", GREY)
    draw.measure((150, 133), (150, 280), "two thirds", (-78, 5))
    draw.box((440, 60), (220, 220), "#c6f6d5", SET)
    draw.words((550, 50), "the same wall, from the front", where="middle")
    for x in (500, 600):
        draw.line((x, 133), (x, 280), width=4, colour=PART)
    draw.measure((500, 200), (600, 200), "≥ 40 %", (-24, -8))
    draw.words((20, 308), "Heads at about two thirds of the height; feet on whole concrete or level ground.", GREY)
    return draw


def tandem() -> Sketch:
    """Two hooks, a fifth of the length from each end."""
    draw = Sketch("Two cranes carry a part together; the hook nearer to the centre of mass carries more", height=270)
    draw.box((110, 150), (500, 44), "#bee3f8", MOVING)
    for x, name, colour in ((210, "crane 1", MOVING), (510, "crane 2", PART)):
        draw.line((x, 20), (x, 150), colour=colour, width=2)
        draw.circle((x, 150), 5, colour)
        draw.words((x + 10, 40), name, colour)
    draw.circle((310, 172), 5, "#1f2933")
    draw.words((320, 178), "centre of mass")
    draw.words((222, 110), "larger share", MOVING)
    draw.words((522, 110), "smaller share", PART)
    draw.measure((110, 215), (210, 215), "a fifth of the length", (-50, 22))
    draw.measure((510, 215), (610, 215), "a fifth", (-24, 22))
    draw.words((20, 262), "Ropes hang straight down; both cranes drive in time, at half of their rates at most.", GREY)
    return draw
