"""Ticks of an axis of dates: hours, days, months or years of UTC, as in ISO 8601."""

import numpy as np

ROOM_PT = 62.0  # least room between ticks
FIRST_S, LAST_S = -6.0e10, 2.5e11  # years of four digits
DAY_S = 86_400.0
# Steps by their length, the unit that they count, how many of it, and what is written of a date.
_STEPS = (
    *((3600.0 * count, "h", count, slice(5, 16)) for count in (1, 2, 3, 6, 12)),
    *((DAY_S * count, "D", count, slice(0, 10)) for count in (1, 2, 7, 14)),
    *((30.44 * DAY_S * count, "M", count, slice(0, 7)) for count in (1, 2, 3, 6)),
    *((365.25 * DAY_S * count, "Y", count, slice(0, 4)) for count in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)),
)


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
    most = max(length_pt / ROOM_PT, 1.0)
    _, unit, count, part = next((one for one in _STEPS if (high_s - low_s) / one[0] <= most), _STEPS[-1])
    first, last = (np.datetime64(int(np.floor(end)), "s").astype(f"datetime64[{unit}]") for end in (low_s, high_s))
    numbers = np.arange(first.astype(np.int64), last.astype(np.int64) + 1)
    offset = 1970 if unit == "Y" else 0
    dates = numbers[(numbers + offset) % count == 0].astype(f"datetime64[{unit}]").astype("datetime64[s]")
    places = dates.astype(np.int64).astype(np.float64)
    texts = [str(text)[part].replace("T", " ") for text in np.datetime_as_string(dates)]
    found = zip(places.tolist(), texts, strict=True)
    return tuple((place, text) for place, text in found if low_s <= place <= high_s)
