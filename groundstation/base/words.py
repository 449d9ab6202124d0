"""Words that pages, findings and sentences share: lists, counts, times, intervals."""

import math
from collections.abc import Sequence

NEAR_END_S = 15.0  # a span that ends so near the end of all of it lasts on
IN_MS_BELOW_S = 9.9995  # a log that is shorter is told to the millisecond


def listed(names: Sequence[str]) -> str:
    """Return names in a row of words.

    Examples
    --------
    >>> listed(("gnss",)), listed(("a", "b", "c"))
    ('gnss', 'a, b and c')
    """
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def capitalised(text: str) -> str:
    """Return a text with a capital first letter, the others as they are.

    Examples
    --------
    >>> capitalised("fit of the INS"), capitalised("")
    ('Fit of the INS', '')
    """
    return text[:1].upper() + text[1:]


def counted(number: float, noun: str, nouns: str = "") -> str:
    """Return a number with its noun, in the plural but for one.

    ``nouns`` is the plural where it is not the noun with an s.

    Examples
    --------
    >>> counted(1, "row"), counted(0, "row"), counted(926, "row"), counted(2, "approach", "approaches")
    ('1 row', '0 rows', '926 rows', '2 approaches')
    """
    return f"{number:.0f} {noun if number == 1 else nouns or f'{noun}s'}"


def clock_text(seconds: float) -> str:
    """Return a time as minutes and seconds, hours when there are any; it has no sign.

    Examples
    --------
    >>> clock_text(723.4), clock_text(3725.0)
    ('12:03', '1:02:05')
    """
    hours, rest = divmod(round(abs(seconds)), 3600)
    tail = f"{rest // 60:02d}:{rest % 60:02d}" if hours else f"{rest // 60}:{rest % 60:02d}"
    return f"{hours}:{tail}" if hours else tail


def length_text(seconds: float) -> str:
    """Return the length of a log: to the millisecond below ten seconds, else as a clock.

    Examples
    --------
    >>> length_text(0.6537), length_text(2.0), length_text(26.2), length_text(3725.0)
    ('0.654 s', '2 s', '0:26', '1:02:05')
    """
    if not 0.0 < seconds < IN_MS_BELOW_S:
        return clock_text(seconds)
    text = f"{seconds:.3f}".rstrip("0").rstrip(".")
    return f"{text} s" if float(text) else "below 1 ms"


def tenths_text(seconds: float) -> str:
    """Return a time as minutes, seconds and tenths; it has no sign.

    Examples
    --------
    >>> tenths_text(77.61), tenths_text(3725.96)
    ('1:17.6', '1:02:06.0')
    """
    tenths = round(abs(seconds) * 10.0)
    whole, rest = divmod(tenths, 10)
    return f"{clock_text(float(whole))}.{rest}"


def span_text(span_s: tuple[float, float], whole_s: tuple[float, float]) -> str:
    """Return the time of a span within a whole one.

    Examples
    --------
    >>> whole = (0.0, 900.0)
    >>> span_text((100.0, 200.0), whole), span_text((723.0, 890.0), whole), span_text((3.0, 899.0), whole)
    ('1:40 to 3:20', 'from 12:03 on', 'throughout')
    """
    from_start, to_end = span_s[0] - whole_s[0] < NEAR_END_S, whole_s[1] - span_s[1] < NEAR_END_S
    if from_start and to_end:
        return "throughout"
    if to_end:
        return f"from {clock_text(span_s[0])} on"
    return f"{clock_text(span_s[0])} to {clock_text(span_s[1])}"


def with_half(value: float, half: float, unit: str) -> str:
    """Return a value with half of its interval, rounded by the latter.

    Examples
    --------
    >>> with_half(2.134, 0.31, "deg"), with_half(-18.27, 1.23, "m"), with_half(151.2, 32.0, "m")
    ('2.1 +- 0.3 deg', '-18.3 +- 1.2 m', '151 +- 32 m')
    """
    places = places_of(half)
    return f"{round(value, places) + 0.0:.{places}f} +- {half:.{places}f} {unit}".strip()


def places_of(half: float) -> int:
    """Return the decimals with one digit, two where it begins with a one.

    Examples
    --------
    >>> places_of(0.31), places_of(0.123), places_of(32.0), places_of(0.0)
    (1, 2, 0, 1)
    """
    if not half > 0.0 or not math.isfinite(half):
        return 1
    exponent = math.floor(math.log10(half))
    leading = round(half / 10.0**exponent, 1)
    return min(max(-exponent + (1 if leading < 2.0 else 0), 0), 6)


def never_a_fix(rows: int, satellites: float | None) -> str:
    """Return the sentence on receivers that never had a fix.

    ``satellites`` are the most that were used or seen, None where they are not logged.

    Examples
    --------
    >>> never_a_fix(926, 0.0)
    'GNSS never had a fix: 926 rows, 0 satellites'
    >>> never_a_fix(1, 4.0), never_a_fix(12, None)
    ('GNSS never had a fix: 1 row, at most 4 satellites', 'GNSS never had a fix: 12 rows')
    """
    most = "" if satellites is None else f", {'at most ' if satellites else ''}{counted(satellites, 'satellite')}"
    return f"GNSS never had a fix: {counted(rows, 'row')}{most}"
