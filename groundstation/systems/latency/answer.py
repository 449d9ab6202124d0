"""Answer of the latency estimator: delay of each sensor behind the motion of the INS."""

from dataclasses import field
from typing import Any, ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.roles import Delay, Delays

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

Quantity = Literal["velocity", "altitude", "field", "attitude"]
LatencyState = Literal["observed", "not_observable"]


@dataclass(frozen=True)
class Latency(Delay):
    """Latency of one sensor behind the reference.

    Parameters
    ----------
    reference, other : str
        Topics; the reference is an INS.
    quantity : {'velocity', 'altitude', 'field', 'attitude'}
        Quantity of the other that is compared with the reference.
    state : {'observed', 'not_observable'}
    reason : str
        Why it is not observable, or what it rests on.
    latency_s, sigma_s, confidence95_s
        Positive: the other shows a motion later, by its time stamps, than the reference. None where not observable.
    samples, windows, effective_windows
        Data it rests on; the last is the degrees of freedom of the interval.
    motion, residual : float or None
        RMS rate of the reference in the windows, slow motion taken away, and RMS of what is left unexplained, in
        ``unit`` per second and ``unit``.
    explained : float or None
        Share of the other's motion that the reference explains, of the component explained worst.
    """

    reference: str  #: Topic of the INS that is the reference.
    other: str  #: Topic whose latency is found.
    quantity: Quantity
    state: LatencyState  #: observed, or not_observable with the reason.
    reason: str
    latency_s: float | None = None  #: Positive: the other shows a motion later, by its stamps, than the reference.
    sigma_s: float | None = None  #: Standard deviation of the latency.
    confidence95_s: tuple[float, float] | None = None  #: 95 % interval of the latency [low, high].
    samples: int = 0  #: Samples of the other in the windows.
    windows: int = 0  #: Stretches of motion that were compared.
    effective_windows: float | None = None  #: Independent ones among them: degrees of freedom of the interval.
    motion: float | None = None  #: RMS rate of the reference in the windows, in `unit` per second.
    residual: float | None = None  #: RMS of what is left unexplained, in `unit`.
    unit: str = ""  #: Unit of the quantity compared.
    explained: float | None = None


@dataclass(frozen=True)
class Latencies(Answer, Delays):
    """Latencies of all pairs of a flight; ``settings`` by name."""

    analysis: ClassVar[str] = "latency"

    rows: tuple[Latency, ...]  #: Every pair of a sensor and its reference.
    settings: dict[str, Any] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    def __repr__(self) -> str:
        told = (f"{one.other} {one.quantity} {_told(one.latency_s)}" for one in self.rows)
        return f"<Latencies {'; '.join(told) or 'none'}>"

    def observed(self, reference: str, other: str) -> Latency | None:
        """The row of a pair where it is observed, else None."""
        found = (row for row in self.rows if (row.reference, row.other) == (reference, other))
        return next((row for row in found if row.state == "observed"), None)


def _told(latency_s: float | None) -> str:
    return "not observable" if latency_s is None else f"{latency_s:+.3f} s"
