"""Answer of autopilot health: verdict of each check and of the flight."""

from collections.abc import Mapping
from dataclasses import field
from typing import Any, ClassVar, Literal

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.words import clock_text, tenths_text
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.frames import Brief

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

Verdict = Literal["pass", "warn", "fail", "not_logged"]
HEADLINES: Mapping[Verdict, str] = {"pass": "Good", "warn": "Warnings", "fail": "Bad", "not_logged": "Not judged"}
DECLINATION = "declination"
FALL = "log ends in the air"  # how the text of a fall begins
LOST = "attitude_lost_deg"  # quantity of the tracking check
IN_TENTHS_S = 10.0  # a shorter span is told in tenths of a second
WHOLE_LOG = "in the whole log"  # what is judged where nothing says that it flew
FIRST = ("gnss", "innovations", "vibration")  # checks that a flight's sentence and chapter always tell


def _percent(share: float) -> str:
    """Return a share that is not zero: ``12 %``, ``under 0.1 %``."""
    if share < 0.001:
        return "under 0.1 %"
    return f"{100.0 * share:.0f} %" if share >= 0.0995 else f"{100.0 * share:.1f} %"


@dataclass(frozen=True)
class Measure:
    """One logged quantity as it was judged.

    Parameters
    ----------
    check, quantity, title, sensor, source, unit : str
        Keys of check and threshold, what it is and which of several, topic and field.
    verdict : {'pass', 'warn', 'fail', 'not_logged'}
        ``not_logged`` where it is logged, but not in the air, or has no limit.
    rule : {'share', 'median', 'mean', 'rise'}
        What of it the limits judge.
    figure : float or None
        Worst value in the air, median, mean over time, or rise of a counter.
    worst, worst_at_s : float
        Worst value in the air (of the log where it is not logged there) and its flight time. Of a limit that must be
        passed for some time, the worst value that was.
    median : float or None
        Of the samples in the air.
    mean : float or None
        Over the time in the air.
    amber_share, red_share : float or None
        Shares of the time in the air in which it is logged; amber includes red.
    amber_share_log, red_share_log : float or None
        The same of the whole log.
    logged_share : float
        Share of the time in the air in which it is logged.
    span_start_s, span_end_s : float or None
        Longest red span in the air, else the longest amber one, flight seconds.
    amber, red : float or None
        Limits.
    is_below : bool
        Values below the limits are bad, not those above.
    threshold_source : str
        Where the limits come from.
    is_flag : bool
        It is set or not, or one of a few states: its number says nothing to people.
    """

    check: str  #: Key of the check that it belongs to.
    quantity: str  #: Key of the threshold.
    title: str  #: Quantity for people.
    sensor: str  #: Which of several; empty where there is one.
    source: str  #: Topic and field.
    unit: str
    verdict: Verdict
    rule: Literal["share", "median", "mean", "rise"]
    figure: float | None
    worst: float  #: Worst value in the air; of a counter its highest reading, which may be from before.
    worst_at_s: float  #: Flight second of the worst.
    median: float | None
    mean: float | None
    amber_share: float | None  #: Share of the time in the air beyond the amber limit, red included.
    red_share: float | None  #: Share of the time in the air beyond the red limit.
    amber_share_log: float | None  #: The same of the whole log, amber.
    red_share_log: float | None  #: The same of the whole log, red.
    logged_share: float
    span_start_s: float | None  #: Flight second at which the longest bad span begins.
    span_end_s: float | None  #: Flight second at which the longest bad span ends.
    amber: float | None  #: Limit of a warning.
    red: float | None  #: Limit of a failure.
    is_below: bool
    threshold_source: str
    is_flag: bool = False

    @property
    def name(self) -> str:
        """Title and which of several: ``vibration (IMU 0)``."""
        return f"{self.title} ({self.sensor})" if self.sensor else self.title

    @property
    def is_unjudged(self) -> bool:
        """Tell whether it is logged in the air, and has no limit."""
        return self.amber is None and self.red is None and self.logged_share > 0.0

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Shares that are red and amber, then how much of its first limit the figure is."""
        limit = self.amber if self.amber is not None else self.red
        near = 0.0
        if self.figure is not None and limit is not None and self.figure * limit > 0.0:
            near = limit / self.figure if self.is_below else self.figure / limit
        return self.red_share or 0.0, self.amber_share or 0.0, near

    @property
    def told(self) -> str:
        """The figure in words, with its limit and share of the time."""
        unit = f" {self.unit}" if self.unit else ""
        share = self.red_share if self.red_share else self.amber_share
        limit = self.red if self.red_share else self.amber
        if self.figure is None:
            return self.name
        if self.rule == "rise" and self.figure == 0.0:
            stood = f", its counter stood at {self.worst:g} throughout" if self.worst > 0.0 else ""
            return f"{self.name}: none{stood}"
        if self.rule != "share":
            how = {"median": "median", "mean": "mean", "rise": "rose by"}[self.rule]
            return f"{self.name} {how} {self.figure:.3g}{unit}"
        if self.is_flag:
            return f"{self.name} for {_percent(share)} of the time" if share else f"{self.name}: never"
        over = (
            f", {'below' if self.is_below else 'above'} {limit:g}{unit} for {_percent(share)} of the time"
            if share
            else ""
        )
        return f"{self.name} {'down to' if self.is_below else 'up to'} {self.figure:.3g}{unit}{over}"


LOGGED_BLANK = "logged, but "  # begins the reason of a check whose quantities have no value


@dataclass(frozen=True)
class Check(Brief):
    """One check: its verdict, why, and the quantities behind it.

    ``events_in_air`` counts warnings and failures that were logged in the air; ``first_event_s`` is the flight time of
    the first one that decided.
    """

    key: str  #: Stable name for scripts.
    title: str  #: Name for people.
    verdict: Verdict  #: pass, warn, fail or not_logged.
    reason: str  #: What decided it, with figure and limit.
    measures: tuple[Measure, ...]  #: Quantities behind it.
    events_in_air: int = 0  #: Warnings and failures logged in the air.
    first_event_s: float | None = None  #: Flight second of the first one that decided; null without any.

    @property
    def is_blank(self) -> bool:
        """Tell whether its quantities are logged without a value."""
        return self.verdict == "not_logged" and self.reason.startswith(LOGGED_BLANK)

    @property
    def is_told(self) -> bool:
        """Tell whether it has a verdict, or values in the air that no limit judges."""
        return self.verdict != "not_logged" or any(one.is_unjudged for one in self.measures)

    @property
    def begins_s(self) -> float | None:
        """Start of what is told of it: its first event, else its worst span."""
        measure = self.decisive
        return self.first_event_s if self.first_event_s is not None or measure is None else measure.span_start_s

    @property
    def is_bad(self) -> bool:
        """Tell whether it warns or fails."""
        return self.verdict in ("warn", "fail")

    @property
    def decisive(self) -> Measure | None:
        """The quantity that decided: of several the one farthest beyond its limits."""
        own = [one for one in self.measures if one.verdict == self.verdict]
        return max(own, key=lambda one: one.gravity, default=None)


@dataclass(frozen=True)
class Happening:
    """Something that the autopilot logged or did, flight seconds, with its grade."""

    time_s: float
    check: str  #: Key of the check that it belongs to.
    grade: Literal["info", "warn", "fail"]  #: info, warn or fail.
    text: str  #: What happened, for people.
    source: str  #: Topic it is from.
    in_the_air: bool  #: Whether it was in the air.


@dataclass(frozen=True)
class SettingFound:
    """Setting of the autopilot beside what the flight shows.

    ``found`` is None where the flight does not show it; ``reason`` says why, or what it rests on. ``source`` is the
    topic of the parameters.
    """

    name: str  #: Parameter of the autopilot.
    what: str  #: What it sets, for people.
    unit: str
    stated: float  #: Value in the autopilot.
    found: float | None  #: Value that the flight shows; null where it does not.
    sigma: float | None  #: Standard deviation of the value found.
    verdict: Verdict  #: pass, warn, fail or not_logged.
    reason: str  #: Why there is no value, or what it rests on.
    source: str  #: Topic of the parameters.

    @property
    def told(self) -> str:
        """The two in a line: ``GPS_DELAY_MS: 0.22 s set, 0.12 s found``."""
        found = "not found" if self.found is None else f"{self.found:.3g} {self.unit} found"
        after = f": {self.consequence}" if self.consequence else ""
        return f"{self.what} ({self.name}): {self.stated:.3g} {self.unit} set, {found}{after}"

    @property
    def consequence(self) -> str:
        """Effect of a setting that is off; empty where it is not, or not known."""
        if self.what != DECLINATION or self.verdict != "warn" or self.found is None:
            return ""
        off_deg = float(wrap_180(self.stated - self.found))
        return f"true headings {abs(off_deg):.2g} deg too {'large' if off_deg > 0.0 else 'small'}"


@dataclass(frozen=True)
class ChangedParameter:
    """Parameter that differs from its default, by the log itself."""

    name: str  #: Parameter of the autopilot.
    value: float  #: Value in the flight.
    default: float  #: Value as shipped, by the log itself.


@dataclass(frozen=True)
class MotorOutput:
    """Output to one motor in the time judged after control of attitude was lost.

    Parameters
    ----------
    number : int
        Of the output, from 1.
    low, high : float
        What it may be at least and at most in flight.
    mean : float
    thrust : float
        Mean thrust commanded, of the greatest: 0 to 1.
    at_low_s, at_high_s : float
        How long it stood at its lowest and at its highest.
    """

    number: int
    low: float  #: Least output in flight.
    high: float  #: Greatest output in flight.
    mean: float  #: Mean output while judged.
    thrust: float
    at_low_s: float  #: Seconds at its lowest.
    at_high_s: float  #: Seconds at its highest.


@dataclass(frozen=True)
class AttitudeLoss:
    """Loss of control of attitude, and what the motors of a multirotor were commanded then.

    ``motors`` is empty where they are not logged, or fewer than four. ``suspect`` is the output whose motor, ESC or
    propeller is suspect, None without one; ``all_full``: every motor was near its greatest thrust.
    """

    start_s: float  #: Flight second of the loss.
    judged_s: float = 0.0  #: Length of the time that the motors are judged over.
    unit: str = ""  #: Unit of the motor outputs.
    source: str = ""  #: Topic that shows it.
    motors: tuple[MotorOutput, ...] = ()  #: Commands to each motor then; empty where they are not logged.
    suspect: int | None = None  #: Output whose motor, ESC or propeller is suspect; null without one.
    all_full: bool = False  #: Every motor was near its greatest thrust.

    @property
    def told(self) -> str:
        """Highest and lowest output with their limits; empty without outputs."""
        if not self.motors:
            return ""
        highest = max(self.motors, key=lambda one: one.thrust)
        lowest = min(self.motors, key=lambda one: one.thrust)
        if self.all_full:
            return "all motors near full thrust: too little thrust or a weak battery, no single motor suspect"
        shown = f"{self._stood(highest, is_high=True)}, {self._stood(lowest, is_high=False)}"
        if self.suspect is None:
            return f"{shown}: no single motor suspect"
        return f"{shown}: suspect motor, ESC or propeller of output {self.suspect}"

    def _stood(self, one: MotorOutput, *, is_high: bool) -> str:
        limit, at_s = (one.high, one.at_high_s) if is_high else (one.low, one.at_low_s)
        end = "highest" if is_high else "lowest"
        unit = f" {self.unit}" if self.unit else ""
        if at_s >= 0.5 * self.judged_s:
            return f"output {one.number} at its {end} ({limit:.4g}{unit}) for {at_s:.1f} of {self.judged_s:.1f} s"
        return f"output {one.number} {end} (mean {one.mean:.4g}{unit}, limit {limit:.4g}{unit})"


@dataclass(frozen=True)
class AutopilotHealth(Answer):
    """Health of the autopilot of a flight.

    ``verdict`` is the worst of the checks, ``sentence`` a person's summary; ``judged_over`` says over which time
    (in the air, while armed, in the whole log) and ``judged_by`` what showed it, ``judged_s`` its length.
    ``differing`` are the parameters off their defaults, where the log tells defaults (``has_defaults``); ``estimator``
    flew the aircraft, empty where the log does not tell it. ``loss`` is the first loss of control of attitude, None
    without one; ``cannot_taxi`` tells that the log is of a multirotor or helicopter.
    """

    analysis: ClassVar[str] = "health"

    verdict: Verdict  #: Worst of the checks.
    sentence: str  #: Summary for people.
    autopilot: str  #: Autopilot and version, as logged.
    judged_over: str  #: Time judged: in the air, while armed, or the whole log.
    judged_by: str  #: What showed that time.
    judged_s: float  #: Length of the time judged.
    checks: tuple[Check, ...]  #: Every check, with its quantities.
    happenings: tuple[Happening, ...] = ()  #: What the autopilot logged or did, in order of time.
    happenings_left_out: int = 0  #: Number of happenings beyond those listed.
    settings_found: tuple[SettingFound, ...] = ()  #: Settings of the autopilot against what the flight shows.
    parameters_logged: int = 0  #: Number of parameters in the log.
    has_defaults: bool = False  #: Whether the log tells the defaults.
    differing: tuple[ChangedParameter, ...] = ()  #: Parameters off their defaults.
    estimator: str = ""  #: Filter that flew the aircraft; empty where the log does not tell.
    estimator_source: str = ""  #: Parameter or field that tells it.
    not_flown: str = ""  #: Flag by which it did not fly; empty where it flew, or where no flag says it.
    loss: AttitudeLoss | None = None  #: First loss of control of attitude; null without one.
    cannot_taxi: bool = False  #: The log is of a multirotor or helicopter.
    settings: dict[str, Any] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    @property
    def is_flown(self) -> bool:
        """Tell whether anything says that it flew, or was armed."""
        return self.judged_over != WHOLE_LOG

    @property
    def measures(self) -> tuple[Measure, ...]:
        """The quantities of all checks, in their order."""
        return tuple(measure for one in self.checks for measure in one.measures)

    def check(self, key: str) -> Check:
        """Return the check of that key."""
        return next(one for one in self.checks if one.key == key)


def gravity(check: Check) -> tuple[bool, bool, bool]:
    """Return what orders the checks.

    Failed ones come first, of those a lost attitude, then GNSS, filter and vibration.
    """
    is_lost = check.decisive is not None and check.decisive.quantity == LOST
    return check.verdict != "fail", not is_lost, check.key not in FIRST


def span_words(start_s: float, end_s: float) -> tuple[str, str]:
    """Return start and end of a span: in tenths of a second where it is shorter than ten.

    Examples
    --------
    >>> span_words(77.61, 80.51), span_words(723.0, 759.0)
    (('1:17.6', '1:20.5'), ('12:03', '12:39'))
    """
    told = tenths_text if end_s - start_s < IN_TENTHS_S else clock_text
    return told(start_s), told(end_s)
