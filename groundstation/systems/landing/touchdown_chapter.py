"""Touchdown of an approach as a page tells it: time by its witnesses, place, manner."""

from groundstation.base.quantiles import NORMAL_95
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.base.words import capitalised
from groundstation.chapters.parts import Cell, Facts, Grid, Head, Mark, Part, Tone
from groundstation.chapters.wording import ABSENT, clock, number, sentence, typeset, with_feet
from groundstation.systems.landing.answer import Approach
from groundstation.systems.landing.criteria_chapter import value_text
from groundstation.systems.landing.touchdown_answer import (
    LAST_SINK_S,
    PEAK_S,
    SINK_S,
    SecondContact,
    Touchdown,
    TouchdownByStates,
    Witness,
)

SINK_TIME = f"over the last {SINK_S:g} s"
PEAK_TIME = f"within {PEAK_S:g} s, spikes of single samples left out"
STATES: dict[str, tuple[Tone, str]] = {
    "agrees": ("good", "agrees"),
    "disagrees": ("warn", "disagrees"),
    "not used": ("unknown", "not used"),
}
SLOPE_REMARK = "by the altitude on the roll-out; ±: 95 % of its noise alone, an altitude that drifts adds to it"


def touchdown_parts(one: Approach, start_utc_ns: int | None) -> list[Part | None]:
    """Return facts and witnesses of the touchdown of an approach, or why none is claimed."""
    down = one.touchdown
    if down is None:
        return [_not_claimed(one)]
    return [_facts(one, down, start_utc_ns), _witnesses(one, down)]


def _not_claimed(one: Approach) -> Facts | None:
    if not one.touchdown_reason:
        return None
    return Facts(f"Approach {one.number}: touchdown", (("Touchdown", "not claimed", typeset(one.touchdown_reason)),))


def _facts(one: Approach, down: Touchdown, start_utc_ns: int | None) -> Facts:
    by = f"{number(down.time_s, 1, 's')} of flight" + (f", by {typeset(down.found_by)}" if down.found_by else "")
    pairs = [
        ("Time", f"{clock(down.time_s)} {_interval(down)}", f"95 %; {by}"),
        *([] if start_utc_ns is None else [("UTC", _utc(start_utc_ns, down.time_s), "")]),
        ("Place", f"{number(down.latitude_deg, 5, '°')}, {number(down.longitude_deg, 5, '°')}", _along(down)),
        _beyond(one, down),
        ("Ground speed", number(down.ground_speed_mps, 1, "m/s"), ""),
        ("Sink rate", with_interval(down.sink_rate_mps, down.sink_rate_sigma_mps), _sink_remark(down)),
        ("Peak normal acceleration", number(down.peak_load_g, 2, "g"), PEAK_TIME),
        *(
            (f"Contact {count}", f"{clock(second.time_s)}, {number(second.load_g, 2, 'g')}", _second(second, down))
            for count, second in enumerate(down.second_contacts, 2)
        ),
        ("Slope of the runway", _slope(down), SLOPE_REMARK if down.runway_slope else ""),
        ("Course of the roll-out", number(down.rollout_course_deg, 1, "°"), "line through its positions, true"),
        *_by_states(down.by_states),
    ]
    return Facts(f"Approach {one.number}: touchdown", tuple(pairs))


def _utc(start_utc_ns: int, time_s: float) -> str:
    """Return the date and time of day of a flight second, to a tenth."""
    return utc_ns_to_iso(start_utc_ns + round(time_s * NS_PER_S), 1).replace("T", " ").removesuffix("Z")


def _interval(down: Touchdown) -> str:
    if down.confidence95_s is None:
        return f"± {number(NORMAL_95 * down.time_sigma_s, 1, 's')}"
    early, late = down.time_s - down.confidence95_s[0], down.confidence95_s[1] - down.time_s
    return f"({number(-early, 1, signed=True)} … {number(late, 1, 's', signed=True)})"


def _along(down: Touchdown) -> str:
    told = "as recorded"
    if down.place_sigma_m is None:
        return told
    return f"{told}; ± {number(NORMAL_95 * down.place_sigma_m, 0, 'm')} along the runway by the time (95 %)"


def _beyond(one: Approach, down: Touchdown) -> tuple[str, str, str]:
    """Return the distance beyond the threshold, corrected where the criterion is."""
    name = "Beyond the threshold"
    if down.past_threshold_m is None:
        return name, ABSENT, typeset(one.runway.place_reason)
    judged = next((row for row in one.criteria if row.name == "touchdown" and row.value is not None), None)
    if judged is None:
        return name, with_feet(down.past_threshold_m), "as recorded"
    return name, value_text(judged), typeset(judged.reason)


def with_interval(value: float | None, sigma: float | None, digits: int = 2, unit: str = "m/s") -> str:
    """Return a value with its 95 % interval, where it has a sigma."""
    if value is None or sigma is None:
        return number(value, digits, unit)
    return f"{number(value, digits)} ± {number(NORMAL_95 * sigma, digits, unit)}"


def _sink_remark(down: Touchdown) -> str:
    by = f", by {typeset(down.sink_rate_by)}" if down.sink_rate_by else ""
    return f"onto the runway, {SINK_TIME}{by}{'; ±: 95 %' if down.sink_rate_sigma_mps is not None else ''}"


def _second(second: SecondContact, down: Touchdown) -> str:
    return f"bounce or rebound, {number(second.time_s - down.time_s, 1, 's')} later, by {typeset(second.found_by)}"


def _slope(down: Touchdown) -> str:
    if down.runway_slope is None or down.runway_slope_sigma is None:
        return ABSENT
    return with_interval(100.0 * down.runway_slope, 100.0 * down.runway_slope_sigma, 2, "%")


def _witnesses(one: Approach, down: Touchdown) -> Grid | None:
    if not down.witnesses:
        return None
    heads = (
        *(Head(title) for title in ("Witness", "State")),
        *(Head(title, True) for title in ("Rate, Hz", "Against the touchdown, s", "σ, s")),
        Head("Reason"),
    )
    caption = (
        "Each witness alone: median of its likelihood, and σ as half of the interval that holds 68 % of it. One that "
        "excludes the common time disagrees."
    )
    rows = [_row(witness, down) for witness in down.witnesses]
    return Grid(f"Approach {one.number}: witnesses of the touchdown", heads, rows, caption)


def _row(witness: Witness, down: Touchdown) -> tuple[Cell, ...]:
    tone, text = STATES[witness.state]
    off_s = None if witness.time_s is None else witness.time_s - down.time_s
    name = capitalised(witness.name)
    return (
        f"{name}, {typeset(witness.topic)}" if witness.topic else name,
        Mark(tone, text),
        number(witness.rate_hz, 1),
        number(off_s, 2, signed=True),
        number(witness.sigma_s, 2),
        sentence(typeset(witness.reason)) if witness.reason else "",
    )


def _by_states(down: TouchdownByStates | None) -> tuple[tuple[str, str, str], ...]:
    """Return the touchdown by the best trajectory, set beside what is recorded."""
    if down is None:
        return ()
    sink = with_interval(down.sink_rate_mps, down.sink_rate_sigma_mps)
    told = [
        ("Sink rate of the trajectory", sink, f"{SINK_TIME}, {down.words}; ±: 95 %"),
        ("Sink rate behind the flare", number(down.last_sink_rate_mps, 2, "m/s"), f"over the last {LAST_SINK_S:g} s"),
    ]
    if down.past_threshold_m is not None:
        place = with_interval(down.past_threshold_m, down.past_threshold_sigma_m, 1, "m")
        told.append(("Antenna beyond the threshold", place, f"{down.words}; ±: 95 %, the time taken as exact"))
    return tuple(told)
