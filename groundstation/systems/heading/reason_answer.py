"""Reason of a heading verdict: the sentences it is written with, and the reason alone.

All who write a reason and all who take one apart use these constants; a report says the number to enter elsewhere.
"""

import re

ALL_PASSED = "every required gate passed"
ENTER = ": enter "
NOT_ENTERED = ". Not to be entered: "
IF_ENOUGH = ". To be entered only where that is enough: "
GOOD_TO = "good to +-"
BETWEEN = "; "  # of the parts of a reason
_NUMBER_BEGINS = re.compile("|".join(map(re.escape, (ENTER, NOT_ENTERED, IF_ENOUGH))))


def good_to(half_width_arcmin: float) -> str:
    """Return the beginning of the reason of an advisory.

    Examples
    --------
    >>> good_to(24.2)
    'good to +-24 arcmin'
    """
    return f"{GOOD_TO}{half_width_arcmin:.0f} arcmin"


def why_alone(reason: str) -> tuple[str, ...]:
    """Return the parts of a reason without the number to enter and how good it is.

    Examples
    --------
    >>> why_alone(f"{good_to(24.0)}; taxi the other way{IF_ENOUGH}-1 deg")
    ('taxi the other way',)
    >>> why_alone(f"{ALL_PASSED}{ENTER}-1 deg")
    ('every required gate passed',)
    """
    why = _NUMBER_BEGINS.split(reason)[0]
    return tuple(part for part in why.split(BETWEEN) if not part.startswith(GOOD_TO))
