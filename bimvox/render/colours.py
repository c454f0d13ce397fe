"""The colours of pictures: the paper's, in tones that people with any colour vision tell apart.

The paper's states are orange, blue, green and pink (Zhu, Pauwels and de Vries 2021); taken from the palette of Okabe
and Ito they stay apart for colour-blind readers. Its construction area has the blue of the load in transit, which
cannot be told apart in a picture: the area is pale here. Classes of parts have the light palette of Paul Tol.
"""

from __future__ import annotations

Rgb = tuple[int, int, int]
"""sRGB, 0..255."""

UNBUILT: Rgb = (230, 145, 20)
IN_TRANSIT: Rgb = (0, 100, 190)
ARRIVED: Rgb = (0, 158, 115)
ASSEMBLED: Rgb = (228, 150, 186)

GROUND: Rgb = (178, 178, 176)
CONSTRUCTION_AREA: Rgb = (206, 222, 240)
YARD: Rgb = (236, 222, 190)
STRUCTURE: Rgb = (150, 150, 152)
OBSTRUCTION: Rgb = (52, 52, 56)
CRANE: Rgb = (236, 188, 28)
CRANE_EDGE: Rgb = (92, 74, 22)
CONCRETE: Rgb = (170, 168, 164)
ROPE: Rgb = (60, 60, 64)
FLOOR: Rgb = (234, 234, 230)

PATH: Rgb = IN_TRANSIT
START_BOX: Rgb = (214, 120, 0)
TARGET_BOX: Rgb = (196, 62, 130)

PAPER: Rgb = (250, 250, 248)
"""The background: flat, so that a frame of few colours stays one of few colours."""
INK: Rgb = (40, 40, 44)
FAINT_INK: Rgb = (104, 104, 110)

CLASSES: tuple[Rgb, ...] = (
    (119, 170, 221),
    (238, 136, 102),
    (238, 221, 136),
    (68, 187, 153),
    (255, 170, 187),
    (187, 204, 51),
    (153, 221, 255),
    (170, 170, 0),
    (190, 170, 205),
)
"""For the classes of parts, the most numerous first; classes beyond the last share it."""
