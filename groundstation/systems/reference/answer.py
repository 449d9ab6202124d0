"""Answer of the comparison with a reference: errors, and claimed against seen.

The errors are those of what was recorded and of what was estimated.
"""

from dataclasses import field
from typing import Any, ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData

Quantity = Literal["position", "velocity", "attitude"]
ClaimState = Literal["consistent", "too_sure", "too_careful", "too_few", "reference_too_coarse"]
Observed = Literal["observed", "stated", "not_observable"]
Alignment = Literal["none", "shift", "shift_and_yaw"]

# What is judged, in the order it is shown; a second receiver or INS is "gnss.2", "ins.2".
SUBJECTS: dict[str, str] = {
    "gnss": "GNSS",
    "ins": "INS",
    "corrected": "INS, filtered",
    "smoothed": "INS, smoothed",
    "trajectory": "best trajectory",
    "heading": "INS less the error found",
}


@dataclass(frozen=True)
class Spread:
    """Statistics of one error.

    Intervals are 95 % ones by ``effective_samples``; None where those are too few.

    Parameters
    ----------
    effective_samples : float
        Number of independent errors that would know the mean as well as these correlated ones do.
    mean, std, rmse, median, smallest, largest : float
        Statistics of the error with its sign; ``largest`` of a length (axis ``horizontal``) is the worst.
    """

    samples: int  #: Number of errors.
    effective_samples: float
    mean: float  #: Mean of subject minus reference.
    std: float  #: Standard deviation about the mean.
    rmse: float  #: Root mean square.
    median: float  #: Middle value.
    smallest: float  #: Least value, with its sign.
    largest: float  #: Greatest value; of a length the worst.
    #: 95 % interval of the mean [low, high]; null with too few independent samples.
    mean95: tuple[float, float] | None = None
    std95: tuple[float, float] | None = None  #: 95 % interval of the standard deviation [low, high].
    rmse95: tuple[float, float] | None = None  #: 95 % interval of the root mean square [low, high].
    median95: tuple[float, float] | None = None  #: 95 % interval of the median [low, high].


@dataclass(frozen=True)
class ErrorRow:
    """Errors of one subject along one axis, error = subject - reference.

    ``axis`` is ``along`` and ``cross`` of the reference's motion, ``vertical`` (up positive), ``horizontal`` (a
    length), ``roll``, ``pitch`` or ``heading``. ``reference_sigma`` is what the reference claims of itself (RMS),
    None where it claims nothing; ``is_coarse``: it is so large that most of the error may be the reference's own.
    """

    subject: str  #: Recording or estimate that is judged.
    quantity: Quantity  #: position, velocity or attitude.
    axis: str  #: along, cross, vertical, horizontal, roll, pitch or heading.
    unit: str
    spread: Spread  #: Statistics of the error.
    reference_sigma: float | None  #: What the reference claims of itself, RMS; null where it claims nothing.
    is_coarse: bool = False  #: Most of the error may be the reference's own.


@dataclass(frozen=True)
class ClaimRow:
    """Share of the errors inside the 95 % region that is claimed.

    Subject and reference claim it together. ``claimed_sigma`` and ``reference_sigma`` are RMS, of a horizontal length
    those of north and east together; ``confidence95`` is of the share, by the effective number of samples.
    """

    subject: str  #: Recording or estimate that is judged.
    quantity: Quantity  #: position, velocity or attitude.
    axis: str  #: Axis as of the errors.
    unit: str
    samples: int  #: Number of errors.
    effective_samples: float  #: Independent errors that would tell as much.
    claimed_sigma: float  #: Sigma that the subject claims, RMS.
    reference_sigma: float | None  #: Sigma that the reference claims, RMS.
    share_inside95: float  #: Share of the errors inside the 95 % that both claim together.
    confidence95: tuple[float, float]  #: 95 % interval of that share [low, high].
    state: ClaimState  #: consistent, too_sure, too_careful, or why it cannot be told.


@dataclass(frozen=True)
class PathRow:
    """Absolute trajectory error: RMS of the horizontal position error after an alignment.

    The yaw is in degrees.
    """

    subject: str  #: Recording or estimate that is judged.
    alignment: Alignment  #: What was taken out before: nothing, a shift, a shift and a turn.
    rmse_m: float  #: RMS of the horizontal position error then.
    yaw_deg: float | None = None  #: Turn that was taken out.


@dataclass(frozen=True)
class RelativeRow:
    """Relative error: change of the horizontal position error over a time or a distance.

    ``length`` is in ``unit`` (s or m), errors in metres; ``effective_pairs`` of the overlapping ``pairs`` are
    independent. ``share_of_way`` is the RMS over the mean way between the two ends.
    """

    subject: str  #: Recording or estimate that is judged.
    length: float  #: Time or distance over which the error changes, in `unit`.
    unit: str = field(metadata={"one_of": ("s", "m")})  #: s or m, of `length`.
    pairs: int  #: Overlapping pairs of ends.
    effective_pairs: float  #: Independent ones among them.
    rmse_m: float  #: RMS change of the horizontal position error.
    rmse95_m: tuple[float, float] | None  #: 95 % interval of the RMS [low, high].
    median_m: float  #: Median change.
    largest_m: float  #: Largest change.
    share_of_way: float | None  #: RMS over the mean way between the two ends.


@dataclass(frozen=True)
class Placed:
    """Place and clock of a subject against the reference, from its position in motion.

    The place is that against the reference's point, from position in turns; the clock offset says whose clock is late.

    Parameters
    ----------
    arm_state, clock_state : str
        ``observed``, ``stated`` (by the settings) or ``not_observable``: then it stays in the errors.
    arm_forward_m, arm_right_m : float, optional
        From the reference's point to the subject's, body axes.
    arm_half_width_m : float, optional
        Half width of the 95 % interval of an observed arm, the wider of the two.
    clock_offset_s : float, optional
        Positive: the subject shows a position later, by its time stamps, than the reference.
    rmse_with_arm_m, rmse_m : float
        Horizontal RMS of the errors with the arm in them, and as they are judged.
    """

    subject: str  #: Recording or estimate that is judged.
    arm_state: Observed  #: Whether the arm was observed, stated or not observable.
    clock_state: Observed  #: Whether the offset was observed, stated or not observable.
    reason: str  #: What it rests on, or why it is not observable.
    arm_forward_m: float | None  #: From the reference's point to the subject's, forward.
    arm_right_m: float | None  #: From the reference's point to the subject's, right.
    arm_half_width_m: float | None
    clock_offset_s: float | None
    clock_offset95_s: tuple[float, float] | None  #: 95 % interval of the offset [low, high].
    rmse_with_arm_m: float  #: Horizontal RMS error with the arm in it.
    rmse_m: float  #: Horizontal RMS error as judged.
    is_arm_taken_out: bool = False  #: Whether the arm was taken out before judging.


@dataclass(frozen=True)
class HeadingCheck:
    """Heading error that was found, against INS minus reference at the same samples.

    Both have their intervals. ``seen95_deg`` allows for errors correlated in time; ``is_inside``: the difference is
    within the 95 % that both claim together.
    """

    ins_topic: str
    claimed_deg: float  #: Heading error that the analysis found.
    claimed95_deg: tuple[float, float]  #: Its 95 % interval [low, high].
    seen_deg: float  #: INS minus reference at the same samples.
    seen95_deg: tuple[float, float]  #: Its 95 % interval [low, high].
    difference_deg: float  #: Claimed minus seen.
    sigma_deg: float  #: Standard deviation of the difference.
    samples: int
    is_inside: bool  #: The difference is within the 95 % that both claim.


@dataclass(frozen=True)
class ForecastCheck:
    """Replayed forecast of the position error, against the reference, at one horizon."""

    method: str  #: How the error is forecast.
    horizon_min: float  #: Minutes since GNSS was lost.
    starts: int  #: Outages replayed.
    rmse_m: float  #: RMS error of the forecast position.
    raw_rmse_m: float  #: RMS error of the raw INS.
    share_inside95: float | None  #: Share of the errors inside the 95 % claimed.
    confidence95: tuple[float, float] | None  #: 95 % interval of that share [low, high].


@dataclass(frozen=True)
class ReferenceResult(Answer):
    """Errors of a flight's recordings and estimates by a reference that none of them has seen.

    Parameters
    ----------
    reference : str
        Name of the file, or "the log's own truth".
    is_judge : bool
        False: the reference judges nothing, ``reason`` says why, and the errors are told for what they are.
    interval_s, covered_share, longest_gap_s
        Figures of the reference: median time between samples, the share of the flight that it covers, its longest gap.
    placed : tuple of Placed
    errors, claims, paths, relative : tuples of rows
    headings : tuple of HeadingCheck
    forecasts : tuple of ForecastCheck
    figures : tuple of FigureData
        ``reference_errors``: errors with claimed sigmas over time, by subject; ``reference_track``: plan view in
        metres; ``reference_checks``: one independent sample of every claim after the other.
    """

    analysis: ClassVar[str] = "reference"

    reference: str
    is_judge: bool
    reason: str  #: Why it judges nothing; empty where it judges.
    interval_s: float  #: Median time between samples of the reference.
    covered_share: float  #: Share of the flight that the reference covers.
    longest_gap_s: float  #: Longest gap of the reference.
    placed: tuple[Placed, ...]  #: Arm and clock of each subject against the reference.
    errors: tuple[ErrorRow, ...]  #: Errors of each subject, by axis.
    claims: tuple[ClaimRow, ...] = ()  #: Whether the sigmas that are claimed hold.
    paths: tuple[PathRow, ...] = ()  #: Absolute trajectory errors.
    relative: tuple[RelativeRow, ...] = ()  #: Errors over a time or a distance.
    headings: tuple[HeadingCheck, ...] = ()  #: Heading errors found, against the reference.
    forecasts: tuple[ForecastCheck, ...] = ()  #: Replayed forecasts, against the reference.
    settings: dict[str, Any] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    def error(self, subject: str, quantity: str, axis: str) -> ErrorRow | None:
        """The row of a subject and axis, None where it was not compared."""
        wanted = (subject, quantity, axis)
        return next((row for row in self.errors if (row.subject, row.quantity, row.axis) == wanted), None)

    def claim(self, subject: str, quantity: str, axis: str) -> ClaimRow | None:
        """The claim of a subject along an axis, None where it made none."""
        wanted = (subject, quantity, axis)
        return next((row for row in self.claims if (row.subject, row.quantity, row.axis) == wanted), None)


def title_of(subject: str) -> str:
    """A subject for people.

    Examples
    --------
    >>> title_of("gnss"), title_of("ins.2")
    ('GNSS', 'INS 2')
    """
    kind, _, instance = subject.partition(".")
    return f"{SUBJECTS.get(kind, kind)} {instance}".strip()
