"""Words that pages, findings and sentences share: lists, counts, times of a clock."""

from collections.abc import Sequence


def listed(names: Sequence[str]) -> str:
    """Return names in a row of words.

    Examples
    --------
    >>> listed(("gnss",)), listed(("a", "b", "c"))
    ('gnss', 'a, b and c')
    """
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def counted(number: float, noun: str) -> str:
    """Return a number with its noun, in the plural but for one.

    Examples
    --------
    >>> counted(1, "row"), counted(0, "row"), counted(926, "row")
    ('1 row', '0 rows', '926 rows')
    """
    return f"{number:.0f} {noun}{'' if number == 1 else 's'}"


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
