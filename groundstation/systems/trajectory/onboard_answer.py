"""Errors of the on-board filter, as the answer tells them."""

from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.words import clock_text, with_half
from groundstation.results.frames import Brief
from groundstation.systems.trajectory.quantity_answer import OPENING_ERROR, Quantity

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

OffsetCause = Literal["", "mounting", "antenna", "datum", "sign"]


@dataclass(frozen=True)
class WrongSpan:
    """Span in which the on-board filter was wrong beyond 95 %.

    ``value`` is the median error in it, constant offset taken off; ``half95`` half of its 95 % interval, by the sigmas
    of the smoothed solution and of the offset. ``largest`` is the largest error in it.
    """

    start_s: float
    end_s: float
    value: float  #: Median error in it, filter minus solution, constant taken off.
    half95: float  #: Half of the 95 % interval of the median.
    largest: float  #: Largest error in it.

    def over(self, quantity: Quantity) -> float:
        """Return what is sure of the error, over the one that a report opens with."""
        return (abs(self.value) - self.half95) / OPENING_ERROR[quantity]


@dataclass(frozen=True)
class ChangeOfConstant:
    """Moment at which the constant of the on-board filter became another one.

    The filter was wrong before it or behind it, by ``by`` with half of its 95 % interval ``half95``; the log does not
    tell which. Of a vector ``by`` is the length.
    """

    at_s: float  #: Flight second of the change.
    by: float  #: Constant after less constant before; of a vector the length.
    half95: float  #: Half of the 95 % interval of the change.

    def over(self, quantity: Quantity) -> float:
        """Return what is sure of it, over the error that a report opens with."""
        return (abs(self.by) - self.half95) / OPENING_ERROR[quantity]


@dataclass(frozen=True)
class OnboardError(Brief):
    """Error of the on-board filter in one quantity: its output minus the smoothed solution.

    Parameters
    ----------
    quantity : str
    unit : str
    samples : int
    judged_share : float
        Of the filter's samples: the smoothed attitude beside the others is not sure itself.
    offset, offset_sigma : float or None
        Constant over the log; None where none was looked for. It is never an error of the filter.
    offset_cause : str
        What a constant offset comes from; empty where it is not different from zero.
    offset_words : str
        "antenna or reference point 1.2 m forward, 0.3 m right".
    rms : float
        Of the rest; horizontal: of the vector.
    sigma_rms : float
        Of the smoothed solution at the same times.
    correlation_s : float
        Time for which its errors last.
    spans : tuple of WrongSpan
        The worst first.
    changes : tuple of ChangeOfConstant
        The largest first.
    axes_sigma : float or None
        Sigma of the filter's axes against ours, by which an error with nothing taken off is known; None where they are
        not known.
    """

    quantity: Quantity  #: Quantity compared.
    unit: str
    samples: int  #: Outputs of the filter compared.
    offset: float | None  #: Constant difference over the log, taken off; null where none was looked for.
    offset_sigma: float | None  #: Standard deviation of the constant.
    offset_cause: OffsetCause
    offset_words: str
    rms: float
    sigma_rms: float
    correlation_s: float
    spans: tuple[WrongSpan, ...] = ()
    changes: tuple[ChangeOfConstant, ...] = ()
    axes_sigma: float | None = None
    judged_share: float = 1.0

    @property
    def changed(self) -> str:
        """Words on the largest change: "changed by 2.1 +- 0.2 deg at 6:36 (95 %) ..."."""
        if not self.changes:
            return ""
        one = self.changes[0]
        by = with_half(one.by, one.half95, self.unit)
        return f"changed by {by} at {clock_text(one.at_s)} (95 %): wrong before or after, which cannot be told"


@dataclass(frozen=True)
class OnboardErrors(Brief):
    """Errors of the on-board filter of one topic, by quantity.

    Parameters
    ----------
    topic : str
        ``ins``, or the topics that a lane of the autopilot's filter logs.
    rows : tuple of OnboardError
    delay_s, delay_sigma_s : float or None
        How much later than the inertial unit its stamps are, taken off; None where the motion does not tell.
    name : str
        Of the filter, "EKF3"; empty where the log does not tell it.
    flew : bool or None
        The aircraft was flown by it; None where the log does not tell. ``flew_source`` is the parameter that does.
    """

    topic: str  #: Topic of the filter: ins, or those of its lane.
    rows: tuple[OnboardError, ...]  #: Its error in every quantity.
    #: How much later its stamps are than those of the inertial unit, taken off; null where not known.
    delay_s: float | None = None
    delay_sigma_s: float | None = None  #: Standard deviation of that delay.
    name: str = ""
    flew: bool | None = None
    flew_source: str = ""  #: Parameter that tells whether it flew.

    @property
    def title(self) -> str:
        """Topic with the name of the filter: "ins, EKF3"."""
        return f"{self.topic}, {self.name}" if self.name else self.topic

    def row(self, quantity: Quantity) -> OnboardError | None:
        """Return the row of a quantity, None where the filter does not log it."""
        return next((one for one in self.rows if one.quantity == quantity), None)
