"""Ticks of axes: round places and their texts.

Those of dates are hours, days, months or years of UTC, as in ISO 8601.
"""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from groundstation.chapters.wording import MINUS, NARROW_SPACE, clock
from groundstation.plots.scales import ScaleSpan
from groundstation.reports.svg.font import width_pt

TIME_STEPS = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800, 86400)
WEEK_S = 604_800
ANGLE_STEPS = (1, 2, 5, 10, 15, 30, 60, 90, 180)
ANGLE_FROM = 5  # degrees: of an axis with smaller steps the decimals are those of any number
TIME_ROOM_PT, ROOM_PT, UPRIGHT_PT = 40.0, 24.0, 16.0  # least room between ticks
MOST = 9  # spaces between ticks
POWERS = "⁰¹²³⁴⁵⁶⁷⁸⁹"
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
DATE_ROOM_PT = 62.0  # least room between ticks of dates
FIRST_S, LAST_S = -6.0e10, 2.5e11  # years of four digits
DAY_S = 86_400.0
# Steps by their length, the unit that they count, how many of it, and what is written of a date.
_STEPS = (
    *((3600.0 * count, "h", count, slice(5, 16)) for count in (1, 2, 3, 6, 12)),
    *((DAY_S * count, "D", count, slice(0, 10)) for count in (1, 2, 7, 14)),
    *((30.44 * DAY_S * count, "M", count, slice(0, 7)) for count in (1, 2, 3, 6)),
    *((365.25 * DAY_S * count, "Y", count, slice(0, 4)) for count in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)),
)
Tick = tuple[float, str]


def ticks_of(span: ScaleSpan, length_pt: float, *, is_upright: bool) -> tuple[Tick, ...]:
    """Return places along an axis of some length, each with its text.

    Examples
    --------
    >>> [text for _, text in ticks_of(ScaleSpan("linear", -0.1, 1.1), 100.0, is_upright=True)]
    ['0.0', '0.2', '0.4', '0.6', '0.8', '1.0']
    >>> [text for _, text in ticks_of(ScaleSpan("time", 0.0, 4000.0), 440.0, is_upright=False)]
    ['0:00', '10:00', '20:00', '30:00', '40:00', '50:00', '1:00:00']
    """
    low, high = min(span.low, span.high), max(span.low, span.high)
    if span.scale == "time":
        return _time(low, high, min(max(int(length_pt / TIME_ROOM_PT), 1), MOST))
    if span.scale == "date":
        return date_ticks(low, high, length_pt)
    if span.scale == "log":
        return _log(low, high, length_pt, is_upright)
    if span.scale == "symlog":
        return _symlog(span, length_pt, is_upright)
    if span.scale == "angle":
        most = max(length_pt / (UPRIGHT_PT if is_upright else 28.0), 1.0)
        step = next((step for step in ANGLE_STEPS if (high - low) / step <= most), 360)
        if step >= ANGLE_FROM:
            return tuple((place, _plain(place, 0)) for place in _multiples(step, low, high))
    return _linear(low, high, length_pt, is_upright)


def own_ticks(places: Sequence[float]) -> tuple[Tick, ...]:
    """Return numbers at given places, with as many decimals as they need.

    Examples
    --------
    >>> own_ticks([-0.5, 0.0, 25.0])
    ((-0.5, '−0.5'), (0.0, '0'), (25.0, '25'))
    """
    return tuple((float(place), of_decade(place)) for place in places if math.isfinite(place))


def _multiples(step: float, low: float, high: float) -> list[float]:
    """Return the multiples of a step from ``low`` to ``high``, ends included."""
    slack = 1e-9 * step
    first, last = math.ceil((low - slack) / step), math.floor((high + slack) / step)
    return [count * step for count in range(first, min(last, first + 100) + 1)]


def _linear(low: float, high: float, length_pt: float, is_upright: bool) -> tuple[Tick, ...]:
    if is_upright:
        return _at_steps(low, high, max(length_pt / UPRIGHT_PT, 1.0))
    room = ROOM_PT
    for _ in range(3):  # labels may need more room than was thought
        found = _at_steps(low, high, max(length_pt / room, 1.0))
        widest = max((width_pt(text) for _, text in found), default=0.0)
        if widest + 8.0 <= room or len(found) < 2:
            return found
        room = widest + 10.0
    return found


def _at_steps(low: float, high: float, most: float) -> tuple[Tick, ...]:
    """Return ticks at round places, with at most ``most`` spaces between them."""
    most = min(most, MOST)
    power = 10.0 ** math.floor(math.log10((high - low) / most))
    step = next((power * part for part in (1.0, 2.0, 5.0, 10.0) if (high - low) / (power * part) <= most), 20.0 * power)
    places = _multiples(step, low, high)
    exponent = math.floor(math.log10(step) + 1e-9)
    largest = max(abs(low), abs(high))
    if largest >= 1e7 or largest < 1e-4:
        top = math.floor(math.log10(largest))
        return tuple(_told(places, lambda place: _powered(place, top, max(top - exponent, 0))))
    return tuple(_told(places, lambda place: _plain(place, min(max(-exponent, 0), 12))))


def _told(places: Iterable[float], text: Callable[[float], str]) -> list[Tick]:
    return [(place, text(place)) for place in places]


def _plain(value: float, places: int) -> str:
    text = f"{abs(value):.{places}f}"
    if abs(value) >= 10_000:
        text = f"{abs(value):,.{places}f}".replace(",", NARROW_SPACE)
    return (MINUS if value < 0.0 and float(f"{value:.{places}f}") else "") + text


def _powered(value: float, exponent: int, places: int) -> str:
    """Return a number as a multiple of a power of ten."""
    if value == 0.0:
        return "0"
    power = f"·10{str(exponent).translate(RAISED)}"
    return f"{value / 10.0**exponent:.{min(places, 9)}f}".replace("-", MINUS) + power


def _time(low: float, high: float, most: int) -> tuple[Tick, ...]:
    if high - low < most / 2.0:  # parts of a second
        found = _at_steps(low, high, most)
        places = len(found[0][1].partition(".")[2]) if found else 0
        return tuple((place, _clock(place, places)) for place, _ in found)
    step = next((step for step in TIME_STEPS if (high - low) / step <= most), 0)
    if not step:
        step = WEEK_S * math.ceil((high - low) / (WEEK_S * most))
    return tuple((place, clock(place)) for place in _multiples(step, low, high))


def _clock(seconds: float, places: int) -> str:
    rounded = round(abs(seconds), places)
    whole = math.floor(rounded)
    sign = MINUS if seconds < 0.0 and rounded else ""
    part = f"{rounded - whole:.{places}f}"
    return sign + clock(whole) + (part[1:] if places else "")


def _log(low: float, high: float, length_pt: float, is_upright: bool) -> tuple[Tick, ...]:
    decades = math.log10(high) - math.log10(low)
    room = UPRIGHT_PT if is_upright else ROOM_PT
    per_decade = length_pt / decades / room
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    parts = (1.0, 2.0, 5.0) if per_decade >= 3.0 else (1.0,)
    stride = max(math.ceil(1.0 / per_decade), 1)
    places = [
        part * 10.0**power
        for power in range(first, last + 1)
        if power % stride == 0 or len(parts) > 1
        for part in parts
        if low * (1.0 - 1e-9) <= part * 10.0**power <= high * (1.0 + 1e-9)
    ]
    if len(places) < 2:
        places = _of_few_decades(low, high, room / length_pt)
    if len(places) < 2:
        return tuple(tick for tick in _linear(low, high, length_pt / 2.0, is_upright) if tick[0] >= low)
    texts = [of_decade(place) for place in places]
    if any(text[-1] in POWERS for text in texts):  # all as powers, or none
        texts = [of_decade(place, as_power=True) for place in places]
    return tuple(zip(places, texts, strict=True))


def _of_few_decades(low: float, high: float, room: float) -> list[float]:
    """Return whole decades, then twos and fives of them, where there is room.

    ``room`` is a share of the axis.
    """
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    kept: list[float] = []
    for part in (1.0, 2.0, 5.0):
        for place in (part * 10.0**power for power in powers):
            apart = (abs(math.log(place / other)) / math.log(high / low) for other in kept)
            if low <= place <= high and all(share >= room for share in apart):
                kept.append(place)
    return sorted(kept)


def of_decade(value: float, *, as_power: bool = False) -> str:
    """Return a round number of any size as text.

    Its decade is a power of ten where that is far from one, or ``as_power``.

    Examples
    --------
    >>> of_decade(0.002), of_decade(-5000.0), of_decade(2e-7), of_decade(1e9), of_decade(0.0)
    ('0.002', '−5000', '2·10⁻⁷', '10⁹', '0')
    """
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(value)) + 1e-9)
    sign = MINUS if value < 0.0 else ""
    if 0 <= exponent <= 1 or (-4 <= exponent <= 5 and not as_power):
        return sign + f"{abs(value):.{max(-exponent, 0) + 3}f}".rstrip("0").rstrip(".")
    part = f"{abs(value) / 10.0**exponent:g}"
    power = f"10{str(exponent).translate(RAISED)}"
    return sign + (power if part == "1" else f"{part}·{power}")


def _symlog(span: ScaleSpan, length_pt: float, is_upright: bool) -> tuple[Tick, ...]:
    """Return ticks at zero, at the end of the linear part, and at round numbers beyond.

    Where room is short, decades and numbers nearest to zero go first.
    """
    low, high = min(span.low, span.high), max(span.low, span.high)
    reach = max(abs(low), abs(high))
    sizes = [0.0]
    for power in range(math.floor(math.log10(span.linear_to)) - 1, math.ceil(math.log10(max(reach, 1e-300))) + 1):
        sizes += [part * 10.0**power for part in (1.0, 2.0, 5.0)]
    by_weight = sorted(sizes, key=lambda size: (_weight(size, span.linear_to), size))
    kept: list[float] = []
    room = (UPRIGHT_PT if is_upright else ROOM_PT) / length_pt
    for size in by_weight:
        for place in dict.fromkeys((-size, size)):
            share = span.share(place)
            if low <= place <= high and all(abs(share - span.share(other)) >= room for other in kept):
                kept.append(place + 0.0)
    return tuple((place, of_decade(place)) for place in sorted(kept))


def _weight(size: float, linear_to: float) -> int:
    """Return the rank of a mark where there is no room for all: zero, decades, fives and twos."""
    if size == 0.0:
        return 0
    part = size / 10.0 ** math.floor(math.log10(size) + 1e-9)
    return (1 if abs(part - 1.0) < 1e-9 else 2) + (2 if size < linear_to * (1.0 - 1e-9) else 0)


def date_ticks(low_s: float, high_s: float, length_pt: float) -> tuple[tuple[float, str], ...]:
    """Return round dates between two moments, seconds since 1970, each with its text.

    Examples
    --------
    >>> [text for _, text in date_ticks(1.7e9, 1.71e9, 300.0)]
    ['2023-12', '2024-01', '2024-02', '2024-03']
    >>> [text for _, text in date_ticks(0.0, 50_000.0, 300.0)]
    ['01-01 00:00', '01-01 03:00', '01-01 06:00', '01-01 09:00', '01-01 12:00']
    """
    low_s, high_s = (min(max(end, FIRST_S), LAST_S) for end in (low_s, high_s))
    most = max(length_pt / DATE_ROOM_PT, 1.0)
    _, unit, count, part = next((one for one in _STEPS if (high_s - low_s) / one[0] <= most), _STEPS[-1])
    first, last = (np.datetime64(int(np.floor(end)), "s").astype(f"datetime64[{unit}]") for end in (low_s, high_s))
    numbers = np.arange(first.astype(np.int64), last.astype(np.int64) + 1)
    offset = 1970 if unit == "Y" else 0
    dates = numbers[(numbers + offset) % count == 0].astype(f"datetime64[{unit}]").astype("datetime64[s]")
    places = dates.astype(np.int64).astype(np.float64)
    texts = [str(text)[part].replace("T", " ") for text in np.datetime_as_string(dates)]
    found = zip(places.tolist(), texts, strict=True)
    return tuple((place, text) for place, text in found if low_s <= place <= high_s)
