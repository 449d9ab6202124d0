"""Approaches of a recorded flight: path against the runway's, touchdown, accuracy."""

from collections.abc import Iterator
from dataclasses import field, replace
from functools import partial
from typing import ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.frames import Brief
from groundstation.results.gates import Gate
from groundstation.systems.landing.criteria_answer import Criterion, Place, Score
from groundstation.systems.landing.events_answer import LandingEvent
from groundstation.systems.landing.runway_answer import RunwayUsed as RunwayUsed
from groundstation.systems.landing.touchdown_answer import Touchdown

Outcome = Literal["landing", "touch-and-go", "go-around"]
Measured = Literal["measured", "not measured"]
MOST_TOLD = 4  # approaches in the text of an answer
GLIDE_SLOPE_DOT = 0.12  # a dot is so much of the glide angle (ICAO Annex 10, volume I, 3.1.5.6.2)


@dataclass(frozen=True, kw_only=True)
class Established:
    """Part of a final that was flown on the guidance, and its deviations.

    Times are flight seconds.
    """

    start_s: float
    end_s: float
    length_m: float  #: Distance flown in it.
    start_height_m: float | None  #: Height above the threshold where it begins.
    end_height_m: float | None  #: Height above the threshold where it ends.
    line_course_deg: float  #: True course of the line through its positions.
    lateral_rms_dots: float  #: RMS deviation from the course.
    vertical_rms_dots: float | None  #: RMS deviation from the glide path.
    lateral_rms_m: float  #: RMS distance from the course.
    vertical_rms_m: float | None  #: RMS distance from the glide path.


StabilisedVerdict = Literal["stabilised", "not stabilised", "not measured"]
Side = Literal["", "left", "right", "low", "high"]  # of the course, of the path, or to which it banks


@dataclass(frozen=True)
class GatePlace:
    """Instant at which the value of a criterion was found, by the criterion's name.

    ``side``: of the course or the path, where the value counts from either; the bank's likewise.
    """

    name: str  #: Name of the criterion.
    at: Place  #: Instant of the value.
    side: Side = ""  #: Side of the course or the path; empty where there is none.


@dataclass(frozen=True)
class StabilityLost:
    """First loss of a limit below a check height.

    ``is_from_the_start``: it was not kept at the check height itself. ``side``: as in :class:`GatePlace`.
    """

    height_m: float  #: Height above the threshold.
    time_s: float  #: Flight second of the loss.
    criterion: str  #: Name of the criterion.
    is_from_the_start: bool  #: It was not kept at the check height itself.
    side: Side = ""  #: Side of the course or the path; empty where there is none.


@dataclass(frozen=True)
class StabilisedAt(Brief):
    """Criteria of a stabilised approach, from a check height down to the start of the flare.

    ``gates`` are the criteria; without any, ``reason`` says why none was measured. Criteria that are not in the log
    leave the verdict to the others: it is stabilised if any was met and none failed. ``places`` says where the values
    were found, ``lost`` where a limit was first left, ``stable_m`` the height from which all were kept for good.
    """

    height_m: float  #: Check height above the threshold.
    verdict: StabilisedVerdict  #: stabilised if a criterion was met and none failed.
    time_s: float | None  #: Flight second at which the height was passed.
    gates: tuple[Gate, ...]  #: Criteria with figure and limit.
    reason: str = ""  #: Why none was measured; empty where one was.
    places: tuple[GatePlace, ...] = ()  #: Where each value was found.
    lost: StabilityLost | None = None  #: First limit that was left below; null where none was.
    stable_m: float | None = None  #: Height from which all limits were kept for good.


@dataclass(frozen=True)
class ErrorPart:
    """Contribution of a part of the error budget to sigma at the threshold."""

    name: str  #: Where it comes from.
    sigma_m: float  #: Its standard deviation at the threshold.


@dataclass(frozen=True)
class PositionError:
    """Error of recorded positions across the course, against the localizer.

    The localizer is a reference without GNSS.

    Parameters
    ----------
    topic : str
        Topic of the positions.
    state : {'measured', 'not measured'}
        State of ``error_m``; ``reason`` says why not.
    error_m, sigma_m : float or None
        Position minus what the localizer says, right of the course positive, as the threshold is crossed.
    confidence95_m : (float, float) or None
    rate_mps, rate_sigma_mps : float or None
        Growth of the error across the course.
    rollout_error_m, rollout_sigma_m : float or None
        The same once more by the roll-out on the centre line.
    change_m, change_sigma_m : float or None
        Roll-out minus final, both on the course of the final continued: observable wherever the runway lies.
    drift_nmi_per_h : float or None
        Size of the error across the course over the time since the flight began: that of one direction.
    residual_ratio : float or None
        Root of the residuals' chi-square over their number; above 1 the sigmas were widened by it.
    """

    topic: str
    state: Measured
    reason: str  #: Why it is not measured; empty where it is.
    samples: int  #: Positions compared on the final.
    #: Recorded position minus the localizer's, right of the course positive, at the threshold.
    error_m: float | None = None
    sigma_m: float | None = None  #: Standard deviation of the error.
    confidence95_m: tuple[float, float] | None = None
    rate_mps: float | None = None  #: Growth of the error across the course.
    rate_sigma_mps: float | None = None  #: Standard deviation of the growth.
    rollout_error_m: float | None = None  #: The same error by the roll-out on the centre line.
    rollout_sigma_m: float | None = None  #: Standard deviation of the error by the roll-out.
    change_m: float | None = None  #: Error of the roll-out minus that of the final.
    change_sigma_m: float | None = None  #: Standard deviation of the change.
    drift_nmi_per_h: float | None = None
    residual_ratio: float | None = None
    parts: tuple[ErrorPart, ...] = ()  #: What the sigma is made of.


@dataclass(frozen=True)
class AlongError:
    """Error of recorded positions along the course, against the glide path.

    Parameters
    ----------
    topic : str
        Topic of the positions.
    state : {'measured', 'not measured'}
        ``reason`` says why not.
    error_m, sigma_m : float or None
        Position minus what height and glide path say, forward positive, as the threshold is crossed.
    confidence95_m : (float, float) or None
    error_from_end_m : float or None
        The same if the threshold were not displaced: it may not have been when the log was recorded. None where the
        runway has no displaced threshold.
    scale : float or None
        Distances by the glide path over those by the positions; 1 where angle and height are as taken.
    """

    topic: str
    state: Measured
    reason: str  #: Why it is not measured; empty where it is.
    samples: int  #: Positions compared on the final.
    error_m: float | None = None  #: Recorded position minus the glide path's, forward positive, at the threshold.
    sigma_m: float | None = None  #: Standard deviation of the error.
    confidence95_m: tuple[float, float] | None = None
    error_from_end_m: float | None = None
    scale: float | None = None
    parts: tuple[ErrorPart, ...] = ()  #: What the sigma is made of.


@dataclass(frozen=True)
class HeightError:
    """Error of a recorded altitude on the roll-out, against the elevation of the runway.

    The elevation is a reference without GNSS.

    Parameters
    ----------
    topic : str
        Topic of the altitude.
    state : {'measured', 'not measured'}
        ``reason`` says why not.
    samples : int
        On the roll-out.
    error_m, sigma_m : float or None
        Altitude less what elevation and height above the wheels say, upwards positive.
    confidence95_m : (float, float) or None
    parts : tuple of ErrorPart
        Parts of sigma.
    """

    topic: str
    state: Measured
    reason: str  #: Why it is not measured; empty where it is.
    samples: int  #: Altitudes compared on the roll-out.
    error_m: float | None = None  #: Recorded altitude minus elevation and height above the wheels, upwards positive.
    sigma_m: float | None = None  #: Standard deviation of the error.
    confidence95_m: tuple[float, float] | None = None
    parts: tuple[ErrorPart, ...] = ()  #: What the sigma is made of.


@dataclass(frozen=True)
class Sensitivity:
    """Ratio of positions across the course to what the localizer shows of them.

    The ratio is 1 where the localizer's sense and width fit. ``ratio`` is None where the aircraft never was far enough
    off the course for it.
    """

    #: Positions across the course over what the deviations show; 1 fits, null where never far enough off.
    ratio: float | None
    sigma: float | None  #: Standard deviation of the ratio.
    samples: int


@dataclass(frozen=True, kw_only=True)
class Protection:
    """Protection levels of a satellite receiver along a final.

    Protection levels are no errors: the error itself is not known.

    Parameters
    ----------
    horizontal_max_m, vertical_max_m : float or None
        Greatest protection level of the final; of several kinds the greater.
    horizontal_alarm_limit_m, vertical_alarm_limit_m : float or None
        Smallest logged.
    within_share : float or None
        Share of epochs with every logged protection level within its alarm limit; None without a limit.
    operations : tuple of str
        Operations whose alarm limits all protection levels stay within.
    """

    epochs: int  #: Epochs with a protection level.
    horizontal_max_m: float | None  #: Greatest horizontal protection level of the final.
    vertical_max_m: float | None  #: Greatest vertical protection level of the final.
    horizontal_alarm_limit_m: float | None  #: Smallest horizontal alarm limit logged.
    vertical_alarm_limit_m: float | None  #: Smallest vertical alarm limit logged.
    within_share: float | None
    operations: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Approach(Brief):
    """One approach.

    Times are flight seconds; distances are before the threshold, behind it negative.
    """

    number: int  #: From 1, in order of time.
    outcome: Outcome  #: landing, touch-and-go or go-around.
    start_s: float  #: Flight second at which the final begins.
    end_s: float  #: Flight second at which the final ends.
    final_length_m: float  #: Distance before the threshold at which the final begins.
    lowest_height_m: float | None  #: Lowest height above the threshold.
    position_topic: str  #: Topic of the positions that path and places are of.
    guidance_topic: str  #: Topic of the deviations; empty where none are logged.
    guidance_source: str  #: What the deviations are measured by.
    height_source: str  #: Topic and field of the height.
    runway: RunwayUsed  #: Runway it is measured against.
    established: Established | None  #: Part flown on the guidance; null where there is none.
    sensitivity: Sensitivity | None  #: Whether sense and width of the logged deviations fit the positions.
    touchdown: Touchdown | None  #: Place, time and manner; null of a go-around.
    stabilised: tuple[StabilisedAt, ...]  #: Criteria at each check height.
    position_errors: tuple[PositionError, ...]  #: Recorded positions across the course, by the localizer.
    protection: Protection | None  #: Protection levels of the receiver; null where not logged.
    claim: str  #: What the figures allow to be claimed, in words.
    #: Steps in which positions are logged [north, east]; null where none shows.
    position_step_m: tuple[float, float] | None = None
    height_errors: tuple[HeightError, ...] = ()  #: Recorded altitudes against the elevation of the runway.
    #: Why there is no touchdown; empty where there is one.
    touchdown_reason: str = ""  # why a landing has no touchdown
    along_errors: tuple[AlongError, ...] = ()  #: Recorded positions along the course, by the glide path.
    #: Positions along the course by the path of satellite guidance; what is beyond sigma is of its path or threshold.
    path_offset: AlongError | None = None
    criteria: tuple[Criterion, ...] = ()  #: The user's own criteria.
    score: Score | None = None  #: Share of the user's weights that was met; null without weights.


@dataclass(frozen=True)
class LeftOutApproach:
    """Descent that is not listed as an approach, and the reason."""

    time_s: float  #: Flight second of its end.
    reason: str  #: Why it is no approach.


@dataclass(frozen=True)
class LandingResult(Answer):
    """Approaches of a flight, each against its runway.

    The figures show accuracy only: integrity and the rest are not shown.

    Parameters
    ----------
    approaches : tuple of Approach
    left_out : tuple of LeftOutApproach
    figures
        ``landing_path`` (every sample of every final) and ``landing_protection`` (protection levels and alarm limits).
    """

    analysis: ClassVar[str] = "landing"

    approaches: tuple[Approach, ...]  #: Every approach, against its runway.
    left_out: tuple[LeftOutApproach, ...] = ()  #: Descents that are not listed, with the reason.
    remarks: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    @property
    def last(self) -> Approach | None:
        """The last landing, or the last approach of a flight without one."""
        landings = [one for one in self.approaches if one.outcome != "go-around"]
        return next(reversed(landings or self.approaches), None)

    @property
    def events(self) -> tuple[LandingEvent, ...]:
        """Events of all approaches in order of time: from the start of each to its end."""
        every = dict.fromkeys(one for made in self.approaches for one in _events(made))
        return tuple(sorted(every, key=lambda one: one.time_s))

    def __repr__(self) -> str:
        told = [f"{one.number}: {one.outcome} on runway {one.runway.name or 'not known'}" for one in self.approaches]
        more = f"; and {len(told) - MOST_TOLD} more" if len(told) > MOST_TOLD else ""
        return f"<LandingResult {'; '.join(told[:MOST_TOLD]) or 'no approach'}{more}>"


def _events(made: Approach) -> Iterator[LandingEvent]:
    new = partial(LandingEvent, approach=made.number)
    yield new(time_s=made.start_s, event="start")
    if (on := made.established) is not None:
        yield new(time_s=on.start_s, event="established", height_m=on.start_height_m)
        yield new(time_s=on.end_s, event="end of established", height_m=on.end_height_m)
    for lost in (check.lost for check in made.stabilised if check.lost is not None):
        yield new(
            time_s=lost.time_s,
            event="limit left",
            what=f"{lost.criterion} {lost.side}".rstrip(),
            height_m=lost.height_m,
        )
    places = {one.name: one.at for one in made.criteria if one.at is not None}
    for one in made.criteria:
        if one.state == "not met" and (at := places.get(one.name)) is not None:
            seen = new(time_s=at.time_s, event="criterion not met", what=one.name, value=one.value, unit=one.unit)
            yield replace(seen, height_m=at.height_m, before_threshold_m=at.before_threshold_m)
    if (down := made.touchdown) is not None:
        behind_m = None if down.past_threshold_m is None else -down.past_threshold_m
        before_m = places["touchdown"].before_threshold_m if "touchdown" in places else behind_m
        yield new(time_s=down.time_s, event="touchdown", what=down.found_by, before_threshold_m=before_m)
        for again in down.second_contacts:
            unit = "" if again.load_g is None else "g"
            yield new(time_s=again.time_s, event="second contact", what=again.found_by, value=again.load_g, unit=unit)
    yield new(time_s=made.end_s, event="end", what=made.outcome)
