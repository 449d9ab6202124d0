"""Roles that one system asks of another by type, without importing it.

An analysis offers a role (``Analysis.offers``); another one finds it with ``known.role(kind)``, None where nobody
offers it.
"""

from collections.abc import Callable
from typing import Protocol

from groundstation.base.dataclasses import dataclass
from groundstation.methods.taxi.settings import TaxiLimits
from groundstation.results.roles import HeadingByTrack
from groundstation.tables.table import Flight


class FindHeadingError(Protocol):
    """Estimate of an INS heading error from the ground before lift-off."""

    def __call__(
        self, part: Flight, whole: Flight, ins_topic: str, speeds_mps: tuple[float, float] | None = None
    ) -> HeadingByTrack:
        """Estimate it from the GNSS epochs of a part of a flight.

        Parameters
        ----------
        part : Flight
        whole : Flight
            By which ground contact is judged.
        ins_topic : str
        speeds_mps : (float, float), optional
            Lowest and highest ground speed of an epoch used; None: those of taxi.

        Raises
        ------
        NotAssessableError
            With the reason.
        """


@dataclass(frozen=True)
class HeadingOnGround:
    """Role of an estimator of INS heading errors on the ground.

    It works with the user's settings and intervals.
    """

    find: FindHeadingError


@dataclass(frozen=True)
class InsKinds:
    """Role of an analysis that tells INSs corrected by GNSS from others.

    It goes by the log and by the user's statement.

    ``find(flight)`` gives the kind (:mod:`groundstation.tables.sources`) of each INS topic that can be judged.
    """

    find: Callable[[Flight], dict[str, str]]


@dataclass(frozen=True)
class LimitsOfTaxi:
    """Role of an analysis whose settings hold the limits of taxi."""

    limits: TaxiLimits
