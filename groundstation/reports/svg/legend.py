"""Legend of a panel: a sign and a name for each mark that has one.

It stands in lines above the panel or in a column beside it.
"""

from collections.abc import Sequence

from groundstation.base.dataclasses import dataclass
from groundstation.plots.marks import (
    AnyMark,
    Band,
    Bars,
    Cells,
    Curve,
    Dots,
    Histogram,
    Intervals,
    Lanes,
    Limit,
    Outlines,
    Points,
    Spans,
    Told,
)
from groundstation.plots.plot import Panel
from groundstation.plots.scales import NO_PLACES
from groundstation.reports.svg import colours
from groundstation.reports.svg.font import label, middle, width_pt, written
from groundstation.reports.svg.symbols import symbol

LINE_PT, SIGN_PT, GAP_PT, BETWEEN_PT = 11.5, 13.0, 4.0, 11.0
MOST_ENTRIES, MOST_OF_A_NAME = 30, 60


@dataclass(frozen=True)
class Entry:
    """One line of a legend: the mark whose sign it has, its name, of shaded ground its kind."""

    mark: AnyMark
    name: str
    kind: str = ""

    @property
    def width_pt(self) -> float:
        """Room for sign, name and the space before the next."""
        return SIGN_PT + GAP_PT + width_pt(self.name) + BETWEEN_PT


def entries_of(panel: Panel) -> tuple[Entry, ...]:
    """Return entries of a panel, none twice; of shaded ground each kind."""
    if not panel.legend:
        return ()
    found: dict[tuple[str, str], Entry] = {}
    for mark in panel.marks:
        if not mark.name or isinstance(mark, Told | Cells | Lanes):
            continue
        if isinstance(mark, Spans):
            for kind in dict.fromkeys(mark.kind.tolist()):
                found.setdefault((mark.role, kind or mark.name), ground(mark, kind))
        else:
            found.setdefault((mark.role, mark.name), Entry(mark, label(mark.name, MOST_OF_A_NAME)))
    entries = tuple(found.values())
    if len(entries) <= MOST_ENTRIES:
        return entries
    more = f"… {len(entries) - MOST_ENTRIES + 1} more"
    return (*entries[: MOST_ENTRIES - 1], Entry(_MORE, more))


def ground(mark: Spans, kind: str) -> Entry:
    """Return shaded ground by its kind, or by its name where the kind is empty."""
    return Entry(mark, label(kind or mark.name, MOST_OF_A_NAME), kind)


_MORE = Told(x=NO_PLACES, y=NO_PLACES, value=NO_PLACES, title="")


def above(entries: Sequence[Entry], room_pt: float) -> tuple[tuple[Entry, ...], ...]:
    """Return lines of a legend above a panel, each as full as its width allows."""
    lines: list[list[Entry]] = []
    for entry in entries:
        if lines and sum(one.width_pt for one in lines[-1]) + entry.width_pt - BETWEEN_PT <= room_pt:
            lines[-1].append(entry)
        else:
            lines.append([entry])
    return tuple(map(tuple, lines))


def beside_pt(entries: Sequence[Entry]) -> float:
    """Return the room right of a panel for its legend."""
    return max((entry.width_pt for entry in entries), default=0.0)


def drawn_line(entries: Sequence[Entry], right: float, y: float) -> str:
    """Return a line of a legend that ends at ``right``, its middle at ``y``; points."""
    x = right - sum(entry.width_pt for entry in entries) + BETWEEN_PT
    parts = []
    for entry in entries:
        parts.append(drawn(entry, x, y))
        x += entry.width_pt
    return "".join(parts)


def drawn(entry: Entry, x: float, y: float) -> str:
    """Return the sign and name of an entry from ``x`` on, their middle at ``y``; points."""
    return _sign(entry, x, y) + written(entry.name, x + SIGN_PT + GAP_PT, y + middle())


def _sign(entry: Entry, x: float, y: float) -> str:
    mark = entry.mark
    colour = colours.COLOURS[mark.role]
    box = f'<path d="M{x:.2f} {y - 3.0:.2f}h{SIGN_PT:g}v6h-{SIGN_PT:g}z" '
    half = x + 0.5 * SIGN_PT
    if isinstance(mark, Spans):
        shade, opacity = colours.shade_of(entry.kind, mark.role, mark.emphasis)
        return f'{box}fill="{shade}"{colours.opacity("fill", opacity)}/>'
    if isinstance(mark, Band):
        return f'{box}fill="{colour}" fill-opacity="{colours.SHADE[mark.emphasis]:g}"/>'
    if isinstance(mark, Histogram):
        return f'{box}fill="{colour}" fill-opacity=".19" stroke="{colour}" stroke-width=".6"/>'
    if isinstance(mark, Dots):
        return symbol("dot", half, y, 2.6, colour)
    if isinstance(mark, Points | Intervals):
        return symbol(mark.symbol, half, y, colours.SYMBOL_PT, colour, is_hollow=getattr(mark, "is_hollow", False))
    if isinstance(mark, Bars):
        line = f'<path d="M{half:.2f} {y - 4.0:.2f}v8" stroke="{colour}" stroke-width="1"/>'
        return line + symbol("dot", half, y, 3.6, colour)
    if isinstance(mark, Curve | Limit | Outlines):
        pattern = colours.dashes(mark.dash)
        width = (colours.LIMIT_PT if isinstance(mark, Limit) else colours.LINE_PT)[mark.emphasis]
        return (
            f'<path d="M{x:.2f} {y:.2f}h{SIGN_PT:g}" fill="none" stroke="{colour}" stroke-width="{width:g}"{pattern}/>'
        )
    return ""
