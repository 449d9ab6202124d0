"""Names that differ from a known one by one character, through damage or a typing slip."""

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping

SHORT_WORD = 5  # letters; another letter in a shorter word may well be another word: gdop, vdop
ONE_IN = 6  # characters of a name, of which one may be replaced
_PLAIN = re.compile(r"[A-Za-z0-9_. -]*$")
_WORD = re.compile(r"[A-Za-z0-9]+")


def slips(names: Iterable[str], known: Iterable[str]) -> Mapping[str, str]:
    """Find names that are almost known ones, each with the known name that was perhaps meant.

    Almost: one character replaced, added or left out, two swapped, or one in six replaced. Known names that are there
    as well were not meant.

    Examples
    --------
    >>> dict(slips(["gnss.latitude_deg", "gnss.longit%de_deg", "gnss.vdop"], ["gnss.longitude_deg", "gnss.gdop"]))
    {'gnss.longit%de_deg': 'gnss.longitude_deg'}
    """
    present = frozenset(names)
    by_length: dict[int, list[str]] = defaultdict(list)
    for one in dict.fromkeys(known):
        if one not in present:
            by_length[len(one)].append(one)
    wanted = {one for listed in by_length.values() for one in listed}
    found = {}
    for name in sorted(present - wanted):
        near = [one for size in (0, 1, -1) for one in by_length.get(len(name) + size, ()) if is_slip(name, one)]
        if near:
            found[name] = near[0]
    return found


def is_slip(name: str, known: str) -> bool:
    """Tell whether a name is almost a known one.

    Another letter in a short word does not count: it may be another word.

    Examples
    --------
    >>> [is_slip(name, "pressure") for name in ("pressure", "presure", "pres\\x00ure", "pressrue", "measure")]
    [False, True, True, True, False]
    """
    if name == known or abs(len(name) - len(known)) > 1:
        return False
    first = next(
        (at for at, (a, b) in enumerate(zip(name, known, strict=False)) if a != b), min(map(len, (name, known)))
    )
    if len(name) != len(known):
        longer, shorter = (name, known) if len(name) > len(known) else (known, name)
        is_near = longer[first + 1 :] == shorter[first:]
    else:
        wrong = sum(a != b for a, b in zip(name, known, strict=True))
        is_swapped = name[first : first + 2] == known[first : first + 2][::-1]
        is_near = wrong <= max(1, len(known) // ONE_IN) or (wrong == 2 and is_swapped)
    return is_near and (not _PLAIN.match(name) or len(_word_at(known, first)) >= SHORT_WORD)


def _word_at(text: str, at: int) -> str:
    """Return the word that holds a character; the last word for one behind the end."""
    words = [one for one in _WORD.finditer(text) if one.start() <= at]
    return words[-1].group() if words else ""
