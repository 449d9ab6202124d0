"""Symbols at places: discs, rings, triangles, crosses, stars, diamonds, as paths."""

import math

from groundstation.plots.marks import Symbol
from groundstation.reports.svg.colours import PAPER

_STAR = [
    (math.sin(math.pi * number / 5.0), -math.cos(math.pi * number / 5.0), 1.0 if number % 2 == 0 else 0.42)
    for number in range(10)
]
EDGE_PT, CROSS_PT = 1.1, 1.5


def symbol(kind: Symbol, x: float, y: float, size_pt: float, colour: str, *, is_hollow: bool = False) -> str:
    """Return a symbol about (x, y), so many points across; a hollow one has paper within."""
    return f'<path d="{outline(kind, x, y, 0.5 * size_pt)}" {look(kind, colour, is_hollow=is_hollow)}/>'


def look(kind: Symbol, colour: str, *, is_hollow: bool = False) -> str:
    """Return attributes by which the path of a symbol is painted."""
    if kind == "cross":
        return f'fill="none" stroke="{colour}" stroke-width="{CROSS_PT:g}"'
    if kind == "ring" or is_hollow:
        return f'fill="{PAPER}" stroke="{colour}" stroke-width="{EDGE_PT:g}"'
    return f'fill="{colour}"'


def outline(kind: Symbol, x: float, y: float, half: float) -> str:
    """Return the path of a symbol."""
    if kind in ("dot", "circle", "ring"):
        half *= 1.0 if kind == "dot" else 1.2
        arc = f"a{half:.2f} {half:.2f} 0 1 0 "
        return f"M{x - half:.2f} {y:.2f}{arc}{2 * half:.2f} 0{arc}-{2 * half:.2f} 0z"
    if kind == "cross":
        whole = f"{2 * half:.2f}"
        return f"M{x - half:.2f} {y - half:.2f}l{whole} {whole}m0-{whole}l-{whole} {whole}"
    if kind == "triangle":
        half *= 1.25
        return f"M{x:.2f} {y - half:.2f}l{0.87 * half:.2f} {1.5 * half:.2f}h-{1.74 * half:.2f}z"
    if kind == "diamond":
        half *= 1.45
        return f"M{x:.2f} {y - half:.2f}l{half:.2f} {half:.2f}-{half:.2f} {half:.2f}-{half:.2f}-{half:.2f}z"
    half *= 1.7
    return "M" + " ".join(f"{x + half * r * across:.2f} {y + half * r * up:.2f}" for across, up, r in _STAR) + "z"
