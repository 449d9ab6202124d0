"""Clock that several logs of one flight share, and the sources that analyses use of them."""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.frames import Brief

JoinMethod = Literal["own_clock", "gnss_time", "motion", "gnss_time_and_motion", "file_time"]


@dataclass(frozen=True)
class JoinedStretch:
    """Stretch over which the clock of a log runs evenly by that of the flight.

    Parameters
    ----------
    start_s, end_s : float
        Seconds of the joined flight.
    offset_s : float
        Flight's clock less that of the log, in the middle of the stretch.
    half_width95_s, largest_half_width95_s : float or None
        Half of the 95 % interval there, and where it is widest; None where nothing tells it.
    drift_ppm, drift_half_width95_ppm : float or None
        Positive: the log's clock is fast.
    """

    start_s: float
    end_s: float
    method: JoinMethod
    offset_s: float
    half_width95_s: float | None = None
    largest_half_width95_s: float | None = None
    drift_ppm: float | None = None
    drift_half_width95_ppm: float | None = None


@dataclass(frozen=True)
class JoinedLog(Brief):
    """One of the logs of a flight.

    Parameters
    ----------
    label : str
        Ends the names of its topics (``gnss.b``); empty for the first log, whose topics keep their names.
    source_name, sha256, reader : str
    rows : int
        Records that it has in the flight.
    reordered : int
        Records that were moved to keep order where the relation of the clocks steps.
    method : str
        Basis of its place in time; ``own_clock`` is the log whose clock the flight has.
    reason : str
        The same in words, with what could not be used and why.
    remarks : tuple of str
        Contradictions and steps.
    signals : tuple of str
        Signals of ``reference_topic`` and ``topic`` that were compared.
    correlation : float or None
        Correlation of the two motions.
    gnss_less_motion_s, gnss_less_motion_half_width95_s : float or None
        Offset by GNSS time less the offset by motion.
    stretches : tuple of JoinedStretch
    """

    label: str
    source_name: str
    sha256: str
    reader: str
    rows: int
    method: JoinMethod
    reason: str = ""
    reordered: int = 0
    remarks: tuple[str, ...] = ()
    signals: tuple[str, ...] = ()
    reference_topic: str = ""
    topic: str = ""
    correlation: float | None = None
    gnss_less_motion_s: float | None = None
    gnss_less_motion_half_width95_s: float | None = None
    stretches: tuple[JoinedStretch, ...] = ()


@dataclass(frozen=True)
class Joining:
    """Logs of a flight, in the order in which they were named."""

    logs: tuple[JoinedLog, ...] = ()


@dataclass(frozen=True)
class ChosenSource:
    """Source of a kind that the analyses use, among those of the logs, and the reason."""

    kind: str
    topic: str
    why: str
    others: tuple[str, ...] = ()


@dataclass(frozen=True)
class MotionAgreement:
    """Agreement of a joined log's motion with that of the log whose clock the flight has.

    ``residual_rms`` and ``motion_rms`` in ``unit``, of ``signal``, at the samples of the joined log.
    """

    label: str
    signal: str
    unit: str
    samples: int
    motion_rms: float
    residual_rms: float


@dataclass(frozen=True)
class Together(Answer):
    """Several logs of one flight on one clock."""

    analysis: ClassVar[str] = "together"

    logs: tuple[JoinedLog, ...]
    sources: tuple[ChosenSource, ...] = ()
    agreement: tuple[MotionAgreement, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()
