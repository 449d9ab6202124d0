"""Parts that the interval of an error is made of."""

from dataclasses import dataclass


@dataclass(frozen=True)
class IntervalPart:
    """One part of the interval of the error: ``taxi``, ``wind`` or ``installation``.

    The squares of the sigmas add up. ``half_width_deg`` is what the 95 % interval would be with this part alone.
    """

    name: str
    sigma_deg: float
    half_width_deg: float
