"""Part of the chapter on the runway of an approach, and on errors along the course."""

from groundstation.chapters.parts import Facts
from groundstation.chapters.wording import ABSENT, interval, is_number, number, percent, typeset, with_feet
from groundstation.systems.landing.answer import AlongError, Approach
from groundstation.systems.landing.runway_answer import RunwayChoice, RunwayUsed

TABLE_REMARK = "unofficial"
STATES = {"decided": "", "not decided": "not decided: ", "none": "none: "}


def runway_facts(one: Approach) -> Facts | None:
    """Return what is known of the runway; None where no table was asked and no file names one."""
    runway, choice = one.runway, one.runway.choice
    if not runway.is_surveyed and choice is None:
        return None
    pairs = [("Runway", typeset(runway.name) or ABSENT, _source(runway)), *_candidates(choice)]
    if runway.is_surveyed:
        pairs += _measures(runway)
    return Facts(f"Approach {one.number}: runway", tuple(pairs))


def _source(runway: RunwayUsed) -> str:
    if runway.choice is None:
        return "by the site file"
    table = f"table of runways {typeset(runway.choice.table)}, {TABLE_REMARK}"
    if runway.choice.state == "decided":
        return f"by the {table}{'; closed in it' if runway.is_closed else ''}"
    return f"{STATES[runway.choice.state]}{typeset(runway.choice.reason)}; {table}"


def _candidates(choice: RunwayChoice | None) -> list[tuple[str, str, str]]:
    """Return each runway that the approach may have led to."""
    if choice is None:
        return []
    return [
        (
            f"Probability of {typeset(one.name)}",
            percent(one.probability, 1),
            f"ended {_aside(one.across_m)} of its centre line, {_behind(one.past_threshold_m)} its threshold, as "
            f"recorded; course flown {number(one.course_difference_deg, 1, '°', signed=True)} from its own"
            f"{'; closed' if one.is_closed else ''}",
        )
        for one in choice.candidates
    ]


def _aside(across_m: float) -> str:
    return f"{number(abs(across_m), 0, 'm')} {'right' if across_m >= 0.0 else 'left'}"


def _behind(past_m: float) -> str:
    return f"{number(abs(past_m), 0, 'm')} {'beyond' if past_m >= 0.0 else 'before'}"


def _measures(runway: RunwayUsed) -> list[tuple[str, str, str]]:
    sigmas = ""
    if is_number(runway.along_sigma_m) and is_number(runway.across_sigma_m):
        sigmas = f"σ {number(runway.along_sigma_m, 0)} along, {number(runway.across_sigma_m, 0, 'm')} across"
    displaced = f"displaced by {with_feet(runway.displaced_m)}" if runway.displaced_m else ""
    pairs = [
        (
            "Threshold",
            f"{number(runway.latitude_deg, 5, '°')}, {number(runway.longitude_deg, 5, '°')}",
            "; ".join(filter(None, (displaced, sigmas))),
        ),
    ]
    if is_number(runway.length_m):
        width = f", {with_feet(runway.width_m)} wide" if is_number(runway.width_m) else ""
        pairs.append(("Length", f"{with_feet(runway.length_m)}{width}", typeset(runway.surface)))
    if runway.displaced_m and is_number(runway.landing_length_m):
        pairs.append(("From the threshold to the end", with_feet(runway.landing_length_m), ""))
    if is_number(runway.elevation_m):
        pairs.append(("Elevation of the threshold", with_feet(runway.elevation_m), "above mean sea level"))
    if is_number(runway.slope):
        slope = f"{number(100.0 * runway.slope, 2, signed=True)} %"
        pairs.append(("Slope", slope, "along the landing, by the elevations of its ends; up positive"))
    return pairs


def along_told(error: AlongError) -> str:
    """Return the error along the course in a sentence; empty where it is not measured."""
    if error.state != "measured":
        return ""
    told = (
        f"With the glide path as reference, {error.topic} is {number(error.error_m, 0, 'm', signed=True)} along the "
        f"course at the threshold (95 % {interval(error.confidence95_m, 0, 'm')}), forward positive."
    )
    if not is_number(error.error_from_end_m) or not _fits_the_end_better(error):
        return told
    shown = number(error.error_from_end_m, 0, "m", signed=True)
    return f"{told} It is {shown} if the threshold was not displaced yet when this was flown."


def path_told(one: Approach) -> str:
    """Return a sentence where height and satellite guidance disagree; empty elsewhere."""
    found = one.path_offset
    if found is None or found.error_m is None or found.sigma_m is None or found.confidence95_m is None:
        return ""
    if abs(found.error_m) <= 2.0 * found.sigma_m:
        return ""
    low_m, high_m = sorted(abs(end) for end in found.confidence95_m)
    end = number(one.runway.displaced_m, 0, "m") if _fits_the_end_better(found) else ""
    return (
        f"Height and guidance disagree: the guided path ends {number(abs(found.error_m), 0, 'm')} "
        f"{'before' if found.error_m < 0.0 else 'beyond'} the touchdown zone assumed "
        f"(95 % {number(low_m, 0)} … {number(high_m, 0, 'm')}): the guidance has another one"
        f"{end and f', or the threshold was not displaced yet (by {end})'}."
    )


def _fits_the_end_better(error: AlongError) -> bool:
    """Tell whether an undisplaced threshold would explain an error beyond its sigmas."""
    if error.error_from_end_m is None or error.error_m is None or error.sigma_m is None:
        return False
    return abs(error.error_m) > 2.0 * error.sigma_m and abs(error.error_from_end_m) < abs(error.error_m)


def with_sigma(value: float | None, sigma: float | None, places: int = 1, unit: str = "m") -> str:
    """Return a signed value with its sigma; ± stands for 95 % elsewhere in this chapter."""
    if not is_number(value):
        return ABSENT
    return f"{number(value, places, unit, signed=True)}, σ {number(sigma, places, unit)}"


def along_facts(one: Approach, error: AlongError) -> Facts | None:
    """Return the error along the course; None where it is not measured."""
    if error.state != "measured":
        return None
    pairs = [
        (
            "At the threshold",
            with_sigma(error.error_m, error.sigma_m),
            f"95 % {interval(error.confidence95_m, 0, 'm')}",
        ),
    ]
    if is_number(error.error_from_end_m):
        shown = number(error.error_from_end_m, 1, "m", signed=True)
        pairs.append(("If the threshold was not displaced", shown, "when the log was recorded"))
    pairs += [
        ("Distance by path / by positions", number(error.scale, 3), "1 if angle and scale of the height are right"),
        ("Samples", number(error.samples, 0), "below 300 m"),
        *((f"σ by {part.name}", number(part.sigma_m, 1, "m"), "") for part in error.parts),
    ]
    return Facts(f"Approach {one.number}: {error.topic} along the course, by the glide path", tuple(pairs))
