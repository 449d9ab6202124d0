"""Colours: one per meaning, everywhere, from the palette of Okabe and Ito.

Colour-blind readers tell them apart on the light and the dark theme.

Source: M. Okabe, K. Ito, Color Universal Design, 2008 (https://jfly.uni-koeln.de/color/).
"""

import itertools
import math
from collections.abc import Iterable, Mapping
from typing import Final, TypeAlias

from groundstation.plots.marks import Emphasis, Role

Colour: TypeAlias = tuple[int, int, int, int]
UNSEEN: Final[Colour] = (0, 0, 0, 1)  # wholly transparent means "choose a colour" to Rerun
NO_WIDTH: Final = 1e-6  # of an unseen bar, in the unit of its axis


def _rgb(code: int, alpha: int = 255) -> Colour:
    return (code >> 16 & 255, code >> 8 & 255, code & 255, alpha)


SKY: Final = _rgb(0x56B4E9)
ORANGE: Final = _rgb(0xE69F00)
GREEN: Final = _rgb(0x1FB58A)
YELLOW: Final = _rgb(0xE3CF2E)
BLUE: Final = _rgb(0x3A86C8)
VERMILION: Final = _rgb(0xE0661A)
PINK: Final = _rgb(0xCC79A7)
GREY: Final = _rgb(0x8C8C8C)
DIM: Final = _rgb(0x5A5A5A)
LIGHT: Final = _rgb(0xB0B0B0)
YELLOW_GREEN: Final = _rgb(0xA3C14A)

FAINT: Final = 0.35  # brightness of a filled band, of that of its line

# Meanings. A quantity keeps its colour on every tab.
INS, GNSS, ANSWER, LIMIT, HONEST, PAPER = SKY, ORANGE, GREEN, VERMILION, PINK, YELLOW
SAMPLES, NORMAL, OVER_LIMIT = GREY, VERMILION, ORANGE
WORDS: Final[dict[Colour, str]] = {
    SKY: "blue",
    BLUE: "dark blue",
    ORANGE: "orange",
    GREEN: "green",
    YELLOW_GREEN: "yellow-green",
    YELLOW: "yellow",
    VERMILION: "red",
    PINK: "pink",
    GREY: "grey",
    DIM: "dark grey",
    LIGHT: "light grey",
}
SERIES: Final = (SKY, ORANGE, GREEN, PINK, YELLOW, BLUE, VERMILION, GREY)

PHASES: Final[dict[str, Colour]] = {
    "unknown": DIM,
    "standstill": BLUE,
    "taxi": GREEN,
    "take-off run": ORANGE,
    "airborne": SKY,
    "landing roll": PINK,
    "driving": GREEN,
    "walking": YELLOW_GREEN,
    "under way": GREEN,
    "on the ground": GREY,
    "moving": LIGHT,
}
GNSS_STATES: Final[dict[str, Colour]] = {
    "good": GREEN,
    "DOP not logged": GREY,
    "integrity lost": VERMILION,
    "no fix": VERMILION,
    "no GNSS": DIM,
    "not logged": LIGHT,
}
GATES: Final[dict[str, Colour]] = {
    "used": GREEN,
    "too slow": BLUE,
    "turning": YELLOW,
    "too fast": ORANGE,
    "take-off run": ORANGE,
    "landing roll": PINK,
    "no ground run": DIM,
    "airborne": SKY,
    "not proven ground": GREY,
    "single epoch": DIM,
    "no heading": DIM,
    "geometry": ORANGE,
    "integrity": VERMILION,
    "excluded": PINK,
    "outlier": VERMILION,
}
STATES: Final[dict[str, Colour]] = {
    "armed": VERMILION,
    "disarmed": GREY,
    "on the ground": BLUE,
    "in the air": SKY,
}
FILTER_STATES: Final[dict[str, Colour]] = {"GNSS used": GREEN, "forecast": ORANGE, "GNSS not used": GREY}
DATA_STATES: Final[dict[str, Colour]] = {"data": GREEN, "gap": VERMILION, "not logged": LIGHT}
FLAGS: Final[dict[str, Colour]] = {"yes": GREEN, "no": GREY}
SEVERITIES: Final[dict[str, Colour]] = {"info": LIGHT, "warn": ORANGE, "fail": VERMILION}
STATES_OF_LANES: Final[dict[str, Colour]] = {**STATES, **FILTER_STATES, **GNSS_STATES, **PHASES, **GATES}

# What a mark of a plot means.
ROLES: Final[dict[Role, Colour]] = {
    "truth": LIGHT,
    "gnss": GNSS,
    "ins": INS,
    "answer": ANSWER,
    "limit": LIMIT,
    "unused": SAMPLES,
    "paper": DIM,
    "ink": YELLOW,
    "faint": GREY,
    "good": GREEN,
    "warn": OVER_LIMIT,
    "bad": VERMILION,
    "other": PINK,
    "series 1": SKY,
    "series 2": ORANGE,
    "series 3": GREEN,
    "series 4": PINK,
    "series 5": YELLOW_GREEN,
    "series 6": BLUE,
    "series 7": LIGHT,
}
# Widths of lines and sizes of dots, in points.
LINE: Final[dict[Emphasis, float]] = {"faint": 0.6, "thin": 1.0, "usual": 1.5, "bold": 2.5}
DOT: Final[dict[Emphasis, float]] = {"faint": 1.0, "thin": 1.3, "usual": 1.6, "bold": 3.5}


def faint(colour: Colour) -> Colour:
    """Return a dark shade of a colour, to fill with.

    Lines drawn beside one another must not be transparent.

    Examples
    --------
    >>> faint((200, 100, 50, 255))
    (70, 35, 18, 255)
    """
    red, green, blue = (math.ceil(FAINT * part) for part in colour[:3])
    return red, green, blue, colour[3]


def for_states(states: Iterable[str], known: Mapping[str, Colour]) -> dict[str, Colour]:
    """Return a colour for every state, in order of appearance.

    Known states keep theirs, the others take those that are left.

    Examples
    --------
    >>> shades = for_states(["good", "odd"], GNSS_STATES)
    >>> shades["good"] == GREEN, shades["odd"] == SKY
    (True, True)
    """
    names = list(dict.fromkeys(states))
    taken = {known[name] for name in names if name in known}
    left = [colour for colour in SERIES if colour not in taken] or list(SERIES)
    spare = itertools.cycle(left)
    return {name: known[name] if name in known else next(spare) for name in names}


def for_series(count: int) -> tuple[Colour, ...]:
    """Return colours of ``count`` series without a meaning; they repeat after eight.

    Examples
    --------
    >>> len(for_series(9)), for_series(9)[8] == for_series(1)[0]
    (9, True)
    """
    return tuple(SERIES[number % len(SERIES)] for number in range(count))
