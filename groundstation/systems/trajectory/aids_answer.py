"""Aids of a trajectory beside GNSS: which were used, and why another was not."""

from typing import Literal

from groundstation.base.dataclasses import dataclass

AidName = Literal["no sideways motion", "barometer", "wheel speed", "magnetic heading"]


@dataclass(frozen=True)
class AidRow:
    """Aid that a log has, or that the aircraft file states.

    Parameters
    ----------
    name : str
    topic : str
        Empty of one that is no sensor.
    is_used : bool
    reason : str
        Why it is not used; of one that is: with what.
    is_wrong : bool
        Its readings cannot be right.
    """

    name: AidName  #: Which aid.
    topic: str
    is_used: bool  #: Whether the solution rests on it.
    reason: str
    is_wrong: bool = False
