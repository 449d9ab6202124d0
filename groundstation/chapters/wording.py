"""Numbers and marks in text: true minus signs, units, an em dash for what is absent."""

import math
import re
from collections.abc import Sequence
from typing import Any, TypeGuard

from groundstation.base.printable import printable
from groundstation.base.unit_names import UNITS, split_unit
from groundstation.base.units import M_PER_FOOT
from groundstation.base.words import capitalised, clock_text, length_text

ABSENT = "—"
MINUS = "−"
NARROW_SPACE = "\u202f"
WORD_UNITS = ("dots",)  # units that are words, which have a plural
MOST_NAMES = 6  # of aircraft, named in a line
HIDDEN = "\ufffd"  # stands for a control, or a mark that turns the direction of the text around it


def clean(text: str) -> str:
    """Return text of a log in one line, without control and direction characters.

    Examples
    --------
    >>> clean("a\\u202eb\\x00\\n")
    'a\ufffdb\ufffd '
    """
    return printable(text, HIDDEN)


def is_number(value: Any) -> TypeGuard[float]:
    """Tell whether a JSON value is a finite number (a bool is none)."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def number(value: Any, places: int, unit: str = "", signed: bool = False) -> str:
    """Return a number with its unit, rounded, with a true minus; an em dash without one.

    Examples
    --------
    >>> number(-1.0449, 2, "°"), number(0.4, 1, "m/s", signed=True), number(None, 2, "m")
    ('−1.04°', '+0.4 m/s', '—')
    """
    if not is_number(value):
        return ABSENT
    rounded = round(float(value), places) + 0.0
    sign = MINUS if rounded < 0 else "+" if signed and rounded > 0 else ""
    grouped = "," if abs(rounded) >= 10_000 else ""
    text = sign + f"{abs(rounded):{grouped}.{places}f}".replace(",", NARROW_SPACE)
    return number_with_unit(text, unit)


def with_feet(value_m: Any, places: int = 0) -> str:
    """Return a height or a length of an approach in metres, and in feet as crews speak of it.

    Examples
    --------
    >>> with_feet(83.9), with_feet(None)
    ('84\u202fm (275\u202fft)', '—')
    """
    return f"{number(value_m, places, 'm')} ({number(value_m / M_PER_FOOT, 0, 'ft')})" if is_number(value_m) else ABSENT


def percent(share: Any, places: int = 0) -> str:
    """Return a share in per cent.

    Examples
    --------
    >>> percent(0.953), percent(None)
    ('95%', '—')
    """
    return number(100.0 * share, places, "%") if is_number(share) else ABSENT


def significant(value: Any, digits: int = 3) -> str:
    """Return a number of unknown kind with so many significant digits.

    Plain notation where that is readable.

    Examples
    --------
    >>> significant(0.0123456), significant(12345.6), significant(20.0), significant(-3), significant(1.2e-9)
    ('0.0123', '12 346', '20', '−3', '1.2e−9')
    """
    if not is_number(value):
        return ABSENT
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if not -5 <= exponent <= 14:
        mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
        mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        return f"{mantissa}e{int(power)}".replace("-", MINUS)
    places = max(digits - 1 - exponent, 0)
    text = number(value, places)
    return text.rstrip("0").rstrip(".") if places else text


def interval(bounds: Any, places: int, unit: str) -> str:
    """Return an interval with its unit.

    Examples
    --------
    >>> interval([-0.1, 0.25], 2, "°"), interval(None, 2, "°")
    ('−0.10° … +0.25°', '—')
    """
    if not isinstance(bounds, list | tuple) or len(bounds) != 2 or not all(map(is_number, bounds)):
        return ABSENT
    return f"{number(bounds[0], places, unit, signed=True)} … {number(bounds[1], places, unit, signed=True)}"


def step_places(step: Any) -> int:
    """Return decimals needed to write multiples of an entry step.

    Examples
    --------
    >>> step_places(0.05), step_places(0.1), step_places(1.0), step_places(None)
    (2, 1, 0, 2)
    """
    if not is_number(step) or step <= 0:
        return 2
    return next((places for places in range(5) if abs(step * 10**places - round(step * 10**places)) < 1e-9), 4)


def clock(seconds: Any) -> str:
    """Return flight time as minutes and seconds, hours when there are any.

    Examples
    --------
    >>> clock(75.4), clock(3725.0), clock(-5.0), clock(float("nan"))
    ('1:15', '1:02:05', '−0:05', '—')
    """
    if not is_number(seconds):
        return ABSENT
    return (MINUS if seconds < 0 and round(abs(seconds)) else "") + clock_text(seconds)


def duration(seconds: Any) -> str:
    """Return the length of a log, to the millisecond where it is short.

    Examples
    --------
    >>> duration(0.654), duration(75.4), duration(None)
    ('0.654 s', '1:15', '—')
    """
    return length_text(seconds) if is_number(seconds) else ABSENT


def typeset(text: str) -> str:
    """Return text of a terminal with the signs of a page: true minus, plus-minus, degree.

    Examples
    --------
    >>> typeset("enter -1.05 deg, 0.3 +- 0.1 deg/h, a-b, 3 degrees")
    'enter −1.05°, 0.3 ± 0.1°/h, a-b, 3 degrees'
    """
    text = clean(text).replace("+-", "±")
    return re.sub(r"(?<=\d) deg\b", "°", re.sub(r"(?<![\w.])-(?=\d)", MINUS, text))


def sentence(text: str) -> str:
    """Return text written for a terminal as a sentence of a page.

    Examples
    --------
    >>> sentence("coverage: 0.9, at least 0.98"), sentence("fit -1.2 deg.")
    ('Coverage: 0.9, at least 0.98.', 'Fit −1.2°.')
    """
    told = typeset(text).strip().rstrip(".")
    return f"{capitalised(told)}."


def with_full_stop(text: str) -> str:
    """Return text with a capital, and a full stop where it ends without a sign.

    Examples
    --------
    >>> with_full_stop("every required gate passed"), with_full_stop("Why?")
    ('Every required gate passed.', 'Why?')
    """
    text = text.strip()
    return capitalised(text) + ("" if not text or text[-1] in ".!?" else ".")


def words(name: str) -> str:
    """Return a field name as words: ``largest_gap`` becomes ``largest gap``."""
    return clean(name).replace("_", " ").strip()


def named_quantity(name: str) -> tuple[str, str]:
    """Split a field name into words and the sign of its unit.

    Examples
    --------
    >>> named_quantity("drift_deg_per_h"), named_quantity("speed_limit_mps"), named_quantity("cycles")
    (('drift', '°/h'), ('speed limit', 'm/s'), ('cycles', ''))
    >>> named_quantity("walk_mps_per_sqrt_s"), named_quantity("drift_walk_dph_per_sqrt_h"), named_quantity("tilt_rad")
    (('walk', 'm/s/√s'), ('drift walk', '°/h/√h'), ('tilt', 'rad'))
    """
    what, unit = split_unit(name)
    return words(what), "" if unit is None else unit.sign


def unit_sign(unit: str) -> str:
    """Return the printed sign of a unit: ``deg`` becomes ``°``; unknown ones stay as they are."""
    return UNITS[unit].sign if unit in UNITS else unit


def any_value(value: Any, unit: str = "") -> str:
    """Return a JSON value of unknown kind in words."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int) and not unit:
        return number(value, 0)
    if is_number(value):
        return number_with_unit(significant(value, 6), unit)
    if isinstance(value, list | tuple):
        return ", ".join(any_value(item, unit) for item in value) or "none"
    return ABSENT if value is None or value == "" else clean(str(value))


def number_with_unit(text: str, unit: str) -> str:
    """Join a written number and the sign of its unit as is usual for that unit.

    A unit that is a word is in the singular behind one.

    Examples
    --------
    >>> number_with_unit("0.05", "°"), number_with_unit("1", "dots"), number_with_unit("2", "dots")
    ('0.05°', '1\u202fdot', '2\u202fdots')
    """
    if not unit or text == ABSENT:
        return text
    if text == "1" and unit in WORD_UNITS:
        unit = unit.removesuffix("s")
    return text + (unit if unit in "°′%" else NARROW_SPACE + unit)


def names_or_count(names: Sequence[str]) -> str:
    """Return the names of a few aircraft, or the count of many.

    Examples
    --------
    >>> names_or_count(["A", "B"]), names_or_count(["A"] * 20)
    ('A, B', '20 aircraft')
    """
    return ", ".join(names) if len(names) <= MOST_NAMES else f"{len(names)} aircraft"


def plural(count: int, one: str, many: str = "") -> str:
    """Return a count with its noun, typeset for a page.

    Examples
    --------
    >>> plural(1, "flight"), plural(3, "log"), plural(2, "is", "are")
    ('1 flight', '3 logs', '2 are')
    """
    return f"{number(count, 0)} {one if count == 1 else many or one + 's'}"
