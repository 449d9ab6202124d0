"""The picture of docs/architecture.md, drawn from the imports; ``python -m tests.architecture_picture`` writes it.

A room stands one row above the highest of the rooms that it imports. An arrow is left out where a path over other rooms
says the same.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "groundstation"
PICTURE = Path(__file__).parents[1] / "docs" / "images" / "rooms.svg"
SYSTEMS = "systems/*"
WIDTH, BOX, HEIGHT, GAP, ROW = 900, 116, 34, 18, 92
INK, LINE, FILL = "#1c2530", "#8d97a3", "#d3e7f5"


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """A node and the statements in it, inside functions too; not their expressions, which are ten times as many."""
    yield node
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        inside = getattr(node, name, ())
        for one in inside if isinstance(inside, list) else ():
            yield from statements(one)


@cache
@cache
def import_nodes(path: Path) -> tuple[ast.Import | ast.ImportFrom, ...]:
    """The imports of a file, inside functions too."""
    nodes = statements(ast.parse(path.read_text(encoding="utf-8")))
    return tuple(node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom))


def imports_between_rooms() -> set[tuple[str, str]]:
    """Which room imports which."""
    found: set[tuple[str, str]] = set()
    for path in sorted(PACKAGE.glob("*/**/*.py")):
        names = [node.module or "" for node in import_nodes(path) if isinstance(node, ast.ImportFrom)]
        room = _box(path.relative_to(PACKAGE).with_suffix("").parts)
        boxes = [_box(tuple(name.split(".")[1:])) for name in names if name.startswith("groundstation.")]
        is_system = room == SYSTEMS
        found |= {(room, box) for box in boxes if box != room and (box != SYSTEMS or is_system)}
    return found | {("pipeline", SYSTEMS)}


def _box(parts: tuple[str, ...]) -> str:
    """Room of a module; the folders of the systems are one box, the files beside them another."""
    inside = parts[0] == "systems" and len(parts) > 1 and (PACKAGE / "systems" / parts[1]).is_dir()
    return SYSTEMS if inside else parts[0]


def rows_of(edges: set[tuple[str, str]]) -> dict[str, int]:
    """The row of every room: 0 for one that imports none."""
    rooms = {room for edge in edges for room in edge}
    rows: dict[str, int] = {}
    while len(rows) < len(rooms):
        for room in sorted(rooms - rows.keys()):
            below = [other for one, other in edges if one == room]
            if all(other in rows for other in below):
                rows[room] = 1 + max((rows[other] for other in below), default=-1)
    return rows


def without_shortcuts(edges: set[tuple[str, str]]) -> list[tuple[str, str]]:
    """The arrows that no path over another room stands for already."""

    def reaches(start: str, end: str) -> bool:
        return any(one == start and (other == end or reaches(other, end)) for one, other in edges)

    return sorted(
        (one, other)
        for one, other in edges
        if not any(reaches(between, other) for start, between in edges if start == one and between != other)
    )


def picture() -> str:
    """The picture as SVG text."""
    edges = imports_between_rooms()
    rows = rows_of(edges)
    highest = max(rows.values())
    place: dict[str, tuple[float, float]] = {}
    for row in range(highest + 1):
        rooms = sorted(room for room in rows if rows[room] == row)
        left = (WIDTH - len(rooms) * BOX - (len(rooms) - 1) * GAP) / 2.0
        for number, room in enumerate(rooms):
            place[room] = (left + number * (BOX + GAP) + BOX / 2.0, 40.0 + (highest - row) * ROW)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {80 + highest * ROW}" font-family="sans-serif">',
        '<defs><marker id="end" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        f'<path d="M0 0L8 4L0 8z" fill="{LINE}"/></marker></defs>',
    ]
    for one, other in without_shortcuts(edges):
        (x1, y1), (x2, y2) = place[one], place[other]
        y1, y2 = y1 + HEIGHT / 2.0, y2 - HEIGHT / 2.0
        lines.append(
            f'<path d="M{x1:.0f} {y1:.0f}C{x1:.0f} {y1 + 30:.0f} {x2:.0f} {y2 - 30:.0f} {x2:.0f} {y2:.0f}" fill="none" '
            f'stroke="{LINE}" marker-end="url(#end)"/>'
        )
    for room, (x, y) in sorted(place.items()):
        lines.append(
            f'<rect x="{x - BOX / 2:.0f}" y="{y - HEIGHT / 2:.0f}" width="{BOX}" height="{HEIGHT}" rx="5" '
            f'fill="{FILL}"/>'
            f'<text x="{x:.0f}" y="{y + 5:.0f}" text-anchor="middle" font-size="14" fill="{INK}">{room}/</text>'
        )
    return "\n".join([*lines, "</svg>"]) + "\n"


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
