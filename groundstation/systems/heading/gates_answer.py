"""Gates of the heading correction: a row for each, with all that tells one from another.

A new gate is a row here, its value in :mod:`verdict` (with what it is judged by) and its limit in the settings.
"""

from collections.abc import Callable, Mapping
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.gates import Bound

NextLine = Literal["Fly", "Record", "Check"]
WHOLE, TAXI_ALONE, STANDSTILL_SPEED = "whole_half_width", "half_width", "standstill_speed_of_mean"
UNPROVEN, UNPROVEN_OPEN = "unproven_ground", "unproven_ground_open"
STATE_THE_KIND = (
    'the kind of vehicle: state vehicle = "rolls" in the aircraft file (--aircraft) if it never flies, all its '
    "straight epochs then count"
)
LONGER = "taxi straight for longer"  # told with how long, or what limits instead
REFLECTIONS = "the taxiway for reflections and gusts"
HELD_MAX_S = 1.0  # a receiver is late by less


@dataclass(frozen=True)
class GateKind:
    """One gate as it is on every flight; value, limit and state come with a flight.

    Parameters
    ----------
    title, unit : str
        {geometry} in a title: the quantity that the log has for it.
    limit : (low, high), optional
        Bound that no setting states.
    setting, sense : str
        Setting that states the bound otherwise; a range has both ends and no sense.
    chooses_data : bool
        That setting also chooses samples: a change of it needs the log again.
    required : str
        Gates that are not required never decide; ``if_measured``: required of a log that shows it.
    decided_by : str
        Setting that says whether it is required.
    failed, not_measured : str
        Words for a crew. {value}: what was found; {limit}: what is needed; {reason}: that of the gate.
    line, advice : str
        What helps against it, and under which heading it is told. {standstill}: the longest that is assessed.
    cured_by_more_data : bool
        Its failure asks for more data where that of another required gate rejects.
    from_data_alone : str
        Part of the log that shows it before any estimate.
    in_interval : bool
        What it finds widens the interval; else the heading error is not to be used where it failed.
    still_teaches : bool
        Its failure leaves the interval by this taxi as honest as it was: wide, or with a noisy standstill.
    leaves_open : bool
        Where it failed, the verdict decides nothing about the flight.
    """

    name: str
    title: str
    unit: str = ""
    limit: Bound | None = None
    setting: str = ""
    sense: Literal["at_least", "at_most"] = "at_most"
    chooses_data: bool = False
    required: Literal["always", "if_measured", "never"] = "always"
    decided_by: str = ""
    failed: str = ""
    not_measured: str = ""
    line: NextLine = "Check"
    advice: str = ""
    is_share: bool = False
    cured_by_more_data: bool = False
    from_data_alone: Literal["", "standstill", "taxi"] = ""
    in_interval: bool = True
    still_teaches: bool = False
    leaves_open: bool = False


GATES: Mapping[str, GateKind] = {  # in the order in which a crew is told of them: what people can see for themselves
    one.name: one
    for one in (
        GateKind(
            "taxi_seconds",
            "straight taxi",
            "s",
            setting="taxi_min_s",
            sense="at_least",
            chooses_data=True,
            failed="{value} of straight taxi, {limit} needed",
            line="Fly",
            advice="taxi straight for {limit} or more before take-off",
            cured_by_more_data=True,
            from_data_alone="taxi",
            still_teaches=True,
            leaves_open=True,
        ),
        GateKind(
            "before_take_off",
            "share of used samples before take-off",
            limit=(1.0, None),
            failed="only {value} of the straight taxi used lies before take-off",
            line="Fly",
            advice="taxi straight before take-off: taxi after landing does not count",
            is_share=True,
            from_data_alone="taxi",
            leaves_open=True,
        ),
        GateKind(
            "standstill_duration",
            "standstill assessed",
            "s",
            setting="standstill_min_s",
            sense="at_least",
            chooses_data=True,
            failed="stood still for {value}, {limit} needed",
            not_measured="standstill",
            line="Fly",
            advice="stand still for {standstill} before taxi",
            cured_by_more_data=True,
            from_data_alone="standstill",
            still_teaches=True,
        ),
        GateKind(
            STANDSTILL_SPEED,
            "length of the mean GNSS velocity at standstill",
            "m/s",
            setting="speed_of_mean_max_mps",
            failed="GNSS shows {value} at standstill, at most {limit}",
            not_measured="GNSS velocity at standstill",
            line="Fly",
            advice="stand still for {standstill} before taxi, with an open sky",
            from_data_alone="standstill",
            still_teaches=True,
        ),
        GateKind(
            "geometry",
            "share of straight taxi with {geometry}",
            setting="geometry_share_min",
            sense="at_least",
            failed="satellite geometry good for {value} of the taxi, {limit} needed",
            not_measured="satellite geometry",
            line="Record",
            advice="GDOP, PDOP or HDOP",
            is_share=True,
            from_data_alone="taxi",
        ),
        GateKind(
            "integrity",
            "share of straight taxi with integrity good",
            setting="integrity_share_min",
            sense="at_least",
            required="if_measured",
            failed="GNSS integrity good for {value} of the taxi, {limit} needed",
            not_measured="GNSS integrity",
            line="Record",
            advice="the integrity flag of GNSS",
            is_share=True,
            from_data_alone="taxi",
        ),
        GateKind(
            "ground",
            "share of used samples with ground contact proven",
            limit=(1.0, None),
            failed="ground contact proven for {value} of the samples, {limit} needed",
            not_measured="ground contact",
            line="Record",
            advice="weight on wheels",
            is_share=True,
            from_data_alone="taxi",
            in_interval=False,
        ),
        GateKind(
            UNPROVEN,
            "gates that fail only with the straight epochs of unproven ground",
            limit=(None, 0.0),
            required="if_measured",
            failed="{reason}",
            advice=STATE_THE_KIND,
            in_interval=False,
        ),
        GateKind(
            UNPROVEN_OPEN,
            "gates that ask for more data only with the straight epochs of unproven ground",
            limit=(None, 0.0),
            required="if_measured",
            failed="{reason}",
            advice=STATE_THE_KIND,
            cured_by_more_data=True,
            in_interval=False,
        ),
        GateKind(
            "ins_mode",
            "changes of INS mode from the end of standstill to the end of taxi",
            limit=(None, 0.0),
            required="if_measured",
            failed="{value} changes of the INS mode during the taxi",
            advice="the alignment of the INS: it changed its mode",
            in_interval=False,
        ),
        GateKind(
            "outliers",
            "share of outliers among straight samples",
            setting="outlier_share_max",
            failed="{value} of the samples are outliers, at most {limit}",
            advice=REFLECTIONS,
            is_share=True,
            from_data_alone="taxi",
        ),
        GateKind(
            "held_velocity",
            "turns of the INS that the GNSS velocity does not show",
            "s",
            limit=(None, HELD_MAX_S),
            required="if_measured",
            failed="GNSS velocity held for {value} while the INS turned, at most {limit}",
            advice="the receiver: it holds its velocity in turns (static hold, dynamic model)",
            in_interval=False,
        ),
        GateKind(
            "steps",
            "steps of the INS heading",
            limit=(None, 0.0),
            failed="{value} steps of the INS heading during the taxi ({reason})",
            advice="the alignment of the INS: its heading stepped",
            in_interval=False,
        ),
        GateKind(
            "segments",
            "disagreement of segments and minutes, chi-square per degree of freedom",
            limit=(None, 1.0),  # where there is one part; else by their number
            required="if_measured",
            failed="parts of the taxi disagree: chi-square {value} per part, at most {limit} ({reason})",
            advice=REFLECTIONS,
            in_interval=False,
        ),
        GateKind(
            TAXI_ALONE,
            "half width of the 95 % interval from this taxi alone",
            "deg",
            setting="half_width_max_deg",
            decided_by="half_width_decides",
            failed="heading error known to +- {value} only, +- {limit} needed",
            line="Fly",
            advice=LONGER,
            cured_by_more_data=True,
            still_teaches=True,
        ),
        GateKind(
            WHOLE,
            "half width of the 95 % interval: this taxi, wind and installation together",
            "deg",
            setting="whole_half_width_max_deg",
            decided_by="whole_decides",
            failed="heading error with wind and installation known to +- {value} only, +- {limit} needed ({reason})",
            line="Fly",
            advice="taxi the other way too, state the wind (--weather) and aircraft_class, or let the tool learn the "
            "installation",
            cured_by_more_data=True,
            still_teaches=True,
        ),
        GateKind(
            "precision",
            "precision e of Markelov 2015",
            "deg",
            setting="precision_max_deg",
            decided_by="precision_decides",
            failed="precision e {value}, at most {limit}",
            line="Fly",
            advice=LONGER,
            cured_by_more_data=True,
            still_teaches=True,
        ),
        GateKind(
            "quality",
            "spread of the running mean",
            "deg",
            setting="quality_max_deg",
            failed="running mean not settled: spread {value}, at most {limit}",
            advice=REFLECTIONS,
        ),
        GateKind(
            "drift",
            "azimuth drift over its standard deviation",
            setting="drift_sigmas_max",
            failed="heading error drifts: {value} sigma, at most {limit}",
            not_measured="drift of the heading error",
            advice="the alignment of the INS: let it settle before taxi",
            in_interval=False,
        ),
        GateKind(
            "variance_ratio",
            "variance of the differences over that of track and sway",
            setting="variance_ratio_range",
            failed="scatter {value} times what track and sway explain, {limit} expected",
            not_measured="scatter against what track and sway explain",
            advice=REFLECTIONS,
            still_teaches=True,
        ),
        GateKind(
            "normal_distance",
            "distance to the fitted normal distribution",
            setting="normal_distance_max",
            failed="errors not normal: distance {value}, at most {limit}",
            advice=REFLECTIONS,
            still_teaches=True,
        ),
        GateKind(
            "skewness",
            "skewness of the differences, absolute",
            setting="skewness_max",
            failed="errors lean to one side: skewness {value}, at most {limit}",
            advice=REFLECTIONS,
            still_teaches=True,
        ),
        GateKind(
            "kurtosis",
            "excess kurtosis of the differences",
            setting="excess_kurtosis_range",
            failed="errors with heavy tails or none: excess kurtosis {value}, {limit} expected",
            advice=REFLECTIONS,
            still_teaches=True,
        ),
        GateKind(
            "standstill_bound97",
            "0.97 bound of the mean speed at standstill",
            "m/s",
            setting="speed_of_mean_max_mps",
            required="never",
        ),
        GateKind(
            "not_taxi", "share of straight epochs in take-off run and landing roll", limit=(None, 1.0), required="never"
        ),
        GateKind(
            "gnss_rate",
            "GNSS rate (10 Hz in Markelov 2015)",
            "Hz",
            limit=(9.0, None),
            required="never",
            line="Record",
            advice="GNSS velocity at 10 Hz (now {value})",
        ),
    )
}


def _named(is_meant: Callable[[GateKind], bool]) -> frozenset[str]:
    return frozenset(name for name, kind in GATES.items() if is_meant(kind))


CURED_BY_MORE_DATA = _named(lambda kind: kind.cured_by_more_data)
NOT_IN_INTERVAL = _named(lambda kind: not kind.in_interval)
STILL_TEACHES = _named(lambda kind: kind.still_teaches)
LEAVES_OPEN = _named(lambda kind: kind.leaves_open)
# Settings that bound a gate and choose no data: a change of them needs no log.
LIMITS = frozenset(
    setting
    for kind in GATES.values()
    for setting in ("" if kind.chooses_data else kind.setting, kind.decided_by)
    if setting
)
