"""A sheet that lines, shapes and words are drawn on, and its SVG.

The sheet has a light ground of its own, so that everything on it can be read on a dark page too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape

INK, GREY, FAINT, SHEET = "#1f2933", "#68737d", "#d7dce0", "#ffffff"
PART, MOVING, SET, FORBIDDEN = "#e07b1a", "#2b6cb0", "#2f855a", "#c53030"
"""A part in the yard, in transit, at its place (the colours of the page), and what nothing may touch."""

Point = tuple[float, float]


@dataclass
class Sketch:
    """One drawing.

    Attributes:
        title: What it shows, for readers who do not see it.
        width: In pixels.
        height: In pixels.
    """

    title: str
    width: int = 720
    height: int = 300
    shapes: list[str] = field(default_factory=list)

    def box(self, at: Point, size: Point, fill: str = "none", line: str = INK, dashed: bool = False) -> None:
        """Draw a rectangle from its upper left corner."""
        self.shapes.append(
            f'<rect x="{at[0]:g}" y="{at[1]:g}" width="{size[0]:g}" height="{size[1]:g}" {_look(fill, line, dashed)}/>'
        )

    def circle(self, at: Point, radius: float, fill: str = "none", line: str = INK, dashed: bool = False) -> None:
        """Draw a circle around a point."""
        self.shapes.append(f'<circle cx="{at[0]:g}" cy="{at[1]:g}" r="{radius:g}" {_look(fill, line, dashed)}/>')

    def line(self, *points: Point, colour: str = INK, dashed: bool = False, width: float = 1.5) -> None:
        """Draw a line through points."""
        drawn = " ".join(f"{x:g},{y:g}" for x, y in points)
        dash = ' stroke-dasharray="6 4"' if dashed else ""
        self.shapes.append(
            f'<polyline points="{drawn}" fill="none" stroke="{colour}" stroke-width="{width:g}"{dash} '
            'stroke-linejoin="round"/>'
        )

    def shape(self, *points: Point, fill: str = FAINT, line: str = INK) -> None:
        """Draw a closed polygon."""
        drawn = " ".join(f"{x:g},{y:g}" for x, y in points)
        self.shapes.append(f'<polygon points="{drawn}" {_look(fill, line, dashed=False)}/>')

    def arrow(self, *points: Point, colour: str = INK, both: bool = False, dashed: bool = False) -> None:
        """Draw a line with a head at its end, or at both."""
        self.line(*points, colour=colour, dashed=dashed)
        self._head(points[-2], points[-1], colour)
        if both:
            self._head(points[1], points[0], colour)

    def _head(self, start: Point, end: Point, colour: str) -> None:
        x, y = end[0] - start[0], end[1] - start[1]
        length = (x * x + y * y) ** 0.5
        x, y = x / length, y / length
        sides = [(end[0] - 9 * x + side * 4 * y, end[1] - 9 * y - side * 4 * x) for side in (1, -1)]
        self.shape(end, *((round(a, 1), round(b, 1)) for a, b in sides), fill=colour, line=colour)

    def words(self, at: Point, text: str, colour: str = INK, where: str = "start", size: int = 14) -> None:
        """Write one line or several; ``where`` is start, middle or end of each line."""
        for n, line in enumerate(text.split("\n")):
            self.shapes.append(
                f'<text x="{at[0]:g}" y="{at[1] + n * (size + 4):g}" fill="{colour}" font-size="{size}" '
                f'text-anchor="{where}">{escape(line)}</text>'
            )

    def labelled(self, at: Point, size: Point, text: str, fill: str = SHEET, line: str = INK) -> None:
        """Draw a box with its text in the middle."""
        self.box(at, size, fill, line)
        rows = text.count("\n") + 1
        self.words((at[0] + size[0] / 2, at[1] + size[1] / 2 + 5 - 9 * (rows - 1)), text, where="middle")

    def measure(self, start: Point, end: Point, text: str, beside: Point = (8, 5)) -> None:
        """Draw a distance with its text next to the middle of it."""
        self.arrow(start, end, colour=GREY, both=True)
        self.words(((start[0] + end[0]) / 2 + beside[0], (start[1] + end[1]) / 2 + beside[1]), text, GREY)

    def svg(self) -> str:
        """Return the sheet as an SVG file."""
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" width="{self.width}" '
            f'height="{self.height}" font-family="Helvetica, Arial, sans-serif" role="img">\n'
            f"<title>{escape(self.title)}</title>\n"
            f'<rect width="{self.width}" height="{self.height}" rx="8" fill="{SHEET}"/>'
        )
        return "\n".join([head, *self.shapes, "</svg>\n"])


def _look(fill: str, line: str, dashed: bool) -> str:
    return f'fill="{fill}" stroke="{line}" stroke-width="1.5"' + (' stroke-dasharray="6 4"' if dashed else "")
