"""Clock that several logs of one flight share, and the sources that analyses use of them."""

from dataclasses import field
from typing import ClassVar, Literal

from groundstation.base.dataclasses import dataclass
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

    start_s: float  #: Second of the joined flight at its beginning.
    end_s: float  #: Second of the joined flight at its end.
    method: JoinMethod  #: What places it in time.
    offset_s: float
    #: Half of the 95 % interval of the offset in its middle; null where nothing tells it.
    half_width95_s: float | None = None
    largest_half_width95_s: float | None = None  #: The same where it is widest.
    drift_ppm: float | None = None  #: Parts per million, positive where the log's clock is fast.
    drift_half_width95_ppm: float | None = None  #: Half of the 95 % interval of the drift.


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
    source_name: str  #: File name without folders.
    sha256: str  #: SHA-256 of the file.
    reader: str  #: Format as the reader names it.
    rows: int
    method: JoinMethod
    reason: str = ""
    reordered: int = 0
    remarks: tuple[str, ...] = ()
    signals: tuple[str, ...] = ()
    reference_topic: str = ""  #: Topic of the first log that was compared; empty without a comparison.
    topic: str = ""  #: Topic of this log that was compared.
    correlation: float | None = None
    gnss_less_motion_s: float | None = None  #: Offset by GNSS time less the offset by motion: a check of either.
    gnss_less_motion_half_width95_s: float | None = None  #: Half of the 95 % interval of that difference.
    stretches: tuple[JoinedStretch, ...] = ()  #: Offset of its clock over time.


@dataclass(frozen=True)
class Joining:
    """Logs of a flight, in the order in which they were named."""

    logs: tuple[JoinedLog, ...] = ()


@dataclass(frozen=True)
class ChosenSource:
    """Source of a kind that the analyses use, among those of the logs, and the reason."""

    kind: str  #: Kind of source: ins, gnss and so on.
    topic: str  #: Topic used.
    why: str  #: Reason for the choice.
    others: tuple[str, ...] = ()  #: Topics that were not used.


@dataclass(frozen=True)
class MotionAgreement:
    """Agreement of a joined log's motion with that of the log whose clock the flight has.

    ``residual_rms`` and ``motion_rms`` in ``unit``, of ``signal``, at the samples of the joined log.
    """

    label: str  #: Label of the joined log.
    signal: str  #: Signal compared.
    unit: str
    samples: int
    motion_rms: float  #: RMS of the motion itself.
    residual_rms: float  #: RMS of the difference.


@dataclass(frozen=True)
class Together(Answer):
    """Several logs of one flight on one clock."""

    analysis: ClassVar[str] = "together"

    logs: tuple[JoinedLog, ...]  #: Every log with its place in time.
    sources: tuple[ChosenSource, ...] = ()  #: Topic that the analyses use of each kind, and why.
    agreement: tuple[MotionAgreement, ...] = ()  #: How well the motions of the logs agree.
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()
