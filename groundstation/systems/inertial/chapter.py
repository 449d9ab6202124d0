"""Chapter on INS errors (system 2).

The quality of the INS, the error states with sigma, and the consistency of the filter.
"""

from collections.abc import Mapping
from dataclasses import replace

from groundstation.base.words import capitalised
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.gates import setting_facts
from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Head, Mark, Note, Part, Section, Tone, kept
from groundstation.chapters.wording import (
    ABSENT,
    any_value,
    clock,
    is_number,
    number,
    percent,
    typeset,
    unit_sign,
)
from groundstation.results.flight import FlightResults
from groundstation.results.roles import AzimuthEstimate
from groundstation.systems.inertial.aided_chapter import aided
from groundstation.systems.inertial.answer import (
    MISSING,
    ChannelResult,
    InertialResult,
    RealOutage,
    StateEstimate,
    is_left_alone,
)
from groundstation.systems.inertial.claim_chapter import (
    drift_of,
    growth,
    growth_headline,
    inertial_claim,
    largest_of,
    lead_of,
    why_no_rate,
)
from groundstation.systems.inertial.drift_answer import is_start_unknown

NOISE = "noise."  # what begins the names of those settings that the class gives
PLACES = {"m": 1, "mps": 3, "arcsec": 1, "dph": 4, "dphph": 4}
CONSISTENT = (0.93, 0.97)  # shares of innovations inside their 95 % band that pass for it
SOURCES = (("Neusypin 2003", "Neusypin, Smolkin, Kharin, Kopelovich, Staroverov: Herald of BMSTU, 2003"),)
TITLE = "INS errors"
LEAD = "A Kalman filter estimates the errors of the INS against GNSS, north and east separately. Error = INS − truth."


def inertial(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(InertialResult)
    if answer is None:
        return without_answer(results, "inertial", TITLE, LEAD)
    section = aided(answer, results.answers) if answer.kind != "unaided" else _unaided(answer)
    return replace(section, lead=lead_of(section.lead, answer.ins_topic, results))


def _unaided(answer: InertialResult) -> Section:
    parts: tuple[Part | None, ...] = (
        *_conclusions(answer),
        Figure("inertial.state", of="position"),
        Figure("inertial.state", of="velocity"),
        Figure("inertial.radial"),
        _states(answer),
        _outages(answer.outages),
        _azimuth(answer.azimuth),
    )
    workings: tuple[Part | None, ...] = (
        _figures_of_merit(answer),
        Figure("inertial.tilt_and_drift"),
        _consistency(answer.channels),
        Figure("inertial.innovations"),
        Figure("inertial.observability"),
        *_settings(answer.settings),
    )
    is_doubtful = bool(_shares(answer.channels)) and min(_shares(answer.channels).values()) < CONSISTENT[0]
    told = inertial_claim(answer, _in_words(answer), is_doubtful=is_doubtful)
    return Section("inertial", TITLE, LEAD, kept(parts), _headline(answer), claim=told, appendix=kept(workings))


def _headline(answer: InertialResult) -> str:
    rate = number(drift_of(answer)[0], 2, "nmi/h")
    return "Unaided INS" if rate == ABSENT else f"Unaided INS, {rate}"


def _conclusions(answer: InertialResult) -> list[Note]:
    """Return the chapter in a few sentences: quality of the INS, trust in the filter."""
    notes = [_quality(answer)]
    if answer.reopened > 0:
        times = "once" if answer.reopened == 1 else f"{number(answer.reopened, 0)} times"
        text = (
            f"The filter rejected GNSS for so long that it was opened again, {times}: the noise of INS class "
            f"{answer.ins_class or ABSENT} does not fit this INS or this receiver."
        )
        notes.append(Note(text, "warn"))
    return notes


def _rates(answer: InertialResult) -> tuple[str, str]:
    """Return the radial error over time, median and 95 %."""
    median, p95 = answer.radial_error_rate_50_nmiph, answer.radial_error_rate_95_nmiph
    return number(median, 2, "nmi/h"), number(p95, 2, "nmi/h")


def _quality(answer: InertialResult) -> Note:
    drift, measure = drift_of(answer)
    rate = f" of {number(drift, 2, 'nmi/h')} ({measure})" if is_number(drift) else ""
    velocity = number(answer.velocity_error_rms_mps, 2, "m/s")
    largest = number(answer.largest_radial_error_m, 0, "m")
    text = f"An unaided INS{rate}: velocity error {velocity} RMS, position error up to {largest}. {_in_words(answer)}"
    if is_start_unknown(answer):
        text += f" {growth_headline(answer)}. {why_no_rate(answer)}"
    is_proven = is_number(drift) and not _is_inflated(answer.channels)  # raised noise proves nothing
    tone: Tone = "good" if is_proven else "plain"
    return Note(text.strip(), tone if _is_consistent(answer.channels) else "warn")


Channels = tuple[ChannelResult, ...]


def _shares(channels: Channels) -> dict[str, float]:
    return {channel.name: channel.share_inside95 for channel in channels if is_number(channel.share_inside95)}


def _is_inflated(channels: Channels) -> bool:
    return any(not is_number(channel.nis_low) for channel in channels)


def _is_consistent(channels: Channels) -> bool:
    shares = _shares(channels)
    highest = 1.0 if _is_inflated(channels) else CONSISTENT[1]
    return bool(shares) and all(CONSISTENT[0] <= share <= highest for share in shares.values())


def _in_words(answer: InertialResult) -> str:
    """Return whether the sigmas of the filter can be trusted."""
    shares = _shares(answer.channels)
    if not shares:
        return ""
    told = " and ".join(f"{number(100.0 * share, 1, '%')} ({name})" for name, share in shares.items())
    text = f"{told} of the innovations lie inside their 95 % band"
    if min(shares.values()) < CONSISTENT[0]:
        return f"{text}: the filter is overconfident, its sigmas are too small."
    if _is_inflated(answer.channels):
        return _on_raised_noise(answer)
    is_close = max(shares.values()) <= CONSISTENT[1]
    return f"{text}: " + (
        "the filter is consistent." if is_close else "the filter is too careful, its sigmas are too large."
    )


def _on_raised_noise(answer: InertialResult) -> str:
    """Return what it means that the filter takes GNSS for less certain than its noise."""
    size, time = (answer.settings.get(f"noise.gnss.position_{name}") for name in ("correlated_m", "correlation_s"))
    by = (
        f" (by {number(size, 1, 'm')}, over some {number(time, 0, 's')})" if is_number(size) and is_number(time) else ""
    )
    return (
        f"Assumed: GNSS is wrong slowly too{by}, so the filter trusts each fix less. Seen: innovations inside their "
        "95 % band, as follows from that whatever the σ. So this log does not test the σ of the filter; INS − GNSS "
        "itself does not rest on it."
    )


def _figures_of_merit(answer: InertialResult) -> Facts:
    origin, others = answer.ins_class_origin, answer.other_ins
    pairs = (
        (
            "Radial error rate, time-position fit",
            number(answer.radial_error_rate_fit_nmiph, 2, "nmi/h"),
            "slope through the origin, least squares, over all epochs since navigation began: as in the acceptance",
        ),
        (
            "Error over time, median / 95 % of the epochs",
            " / ".join(_rates(answer)),
            "position error over time since navigation began, without the first ten minutes; the 95 % is mostly the "
            "Schuler wave of the first half hour",
        ),
        *_start(answer),
        ("Velocity error, RMS", number(answer.velocity_error_rms_mps, 3, "m/s"), "both channels together"),
        ("Largest radial error", *largest_of(answer)),
        ("Kind", (answer.kind or ABSENT).replace("_", "-"), typeset(answer.kind_reason)),
        ("INS class", answer.ins_class or ABSENT, f"noise parameters: {origin}" if origin else ""),
        (
            "Pair used",
            f"{answer.ins_topic} against {answer.gnss_topic}",
            f"not used: {any_value(others)}" if others else "",
        ),
        ("Epochs compared", number(answer.epochs, 0), f"{clock(answer.gnss_seconds)} of the flight with GNSS"),
        ("Transition matrix", "exact exponential" if answer.transition == "exact" else "first order, I + A T", ""),
        ("Filter opened again", number(answer.reopened, 0, "times"), "after GNSS had been rejected for long"),
    )
    return Facts("The INS in figures", pairs)


def _start(answer: InertialResult) -> list[tuple[str, str, str]]:
    """Return when navigation began, as a row of the figures; no row for an older answer."""
    start = answer.navigation_start
    if start is None:
        return []
    if start.time_s is None:
        return [("Start of navigation", "not known", f"{start.reason}; position error {growth(answer)}")]
    told = clock(start.time_s) if start.time_s >= 0.0 else f"{clock(-start.time_s)} before the log"
    return [("Start of navigation", told, "stated: " * (start.basis == "stated") + start.reason)]


def _states(answer: InertialResult) -> Grid | None:
    by_name = [{state.name: state for state in channel.states} for channel in answer.channels]
    names = dict.fromkeys(name for states in by_name for name in states)
    if not names:
        return None
    rows = [_state_row(answer, [states.get(name) for states in by_name]) for name in names]
    heads = [Head("State")]
    for channel in answer.channels:
        heads += [Head(channel.name.capitalize(), True), *(Head(title, True) for title in ("± σ", "Seen", "From"))]
    caption = (
        "At the last GNSS epoch. Seen: observability, 1 − σ/σ without GNSS; near 0 the data do not show the state. "
        "From: flight time from which it stays above one half. Not estimated: the class holds the state at zero and "
        "its σ constant."
    )
    return Grid("States", heads, rows, caption, ("inertial_states",))


def _state_row(answer: InertialResult, states: list[StateEstimate | None]) -> tuple[str, ...]:
    """Return one state of both channels, None in a channel that lacks it."""
    known = next(state for state in states if state is not None)
    title = known.title or known.name
    title = f"{capitalised(title)}, {unit_sign(known.unit)}"
    is_alone = [
        state is not None and is_left_alone(state.name, state.sigma, state.observability, answer.settings)
        for state in states
    ]
    if any(is_alone):
        where = "" if all(is_alone) else f"{answer.channels[is_alone.index(True)].name} "
        title += f" ({where}not estimated in this class)"
    cells = [
        cell
        for state, alone in zip(states, is_alone, strict=True)
        for cell in _state_cells(None if alone else state, PLACES.get(known.unit, 3))
    ]
    return (title, *cells)


def _state_cells(state: StateEstimate | None, places: int) -> tuple[str, ...]:
    if state is None:
        return (ABSENT,) * 4
    since = state.observable_from_s
    return (
        number(state.value, places, signed=True),
        number(state.sigma, places),
        number(state.observability, 2),
        clock(since) if is_number(since) else "never",
    )


def _consistency(channels: Channels) -> Grid:
    titles = ("NIS", "95 % limits", "Inside 95 %", "Innovations", "Rejected", "Velocity RMS", "Position RMS")
    caption = (
        "NIS: mean normalised innovation squared, 1 where the noise model is right. Noise raised: slow GNSS errors "
        "are covered by a larger white noise; NIS then stays below 1 and has no limits, and neither NIS nor the share "
        "inside shows consistency."
    )
    heads = (Head("Channel"), *(Head(title, True) for title in titles))
    return Grid("Consistency of the filter", heads, [_consistency_row(channel) for channel in channels], caption)


def _consistency_row(channel: ChannelResult) -> tuple[str, ...]:
    low, high = channel.nis_low, channel.nis_high
    return (
        channel.name.capitalize(),
        number(channel.nis, 3),
        f"{number(low, 2)} … {number(high, 2)}" if is_number(low) and is_number(high) else "noise raised",
        percent(channel.share_inside95, 1),
        number(channel.innovations, 0),
        number(channel.rejected, 0),
        number(channel.velocity_error_rms_mps, 3, "m/s"),
        number(channel.position_error_rms_m, 0, "m"),
    )


def _outages(outages: tuple[RealOutage, ...]) -> Grid | None:
    numeric = (Head(title, True) for title in ("Length", "Error on return", "σ claimed"))
    heads = (Head("Flight time"), Head("Missing"), *numeric, Head(""))
    caption = (
        "The filter changed to the forecast by itself. Error on return: forecast against the first position "
        "difference afterwards."
    )
    return Grid("Outages in the log", heads, [_outage_row(one) for one in outages], caption) if outages else None


def _outage_row(outage: RealOutage) -> tuple[Cell, ...]:
    jump, sigma = outage.jump_m, outage.sigma_m
    missing = MISSING.get(outage.missing, ABSENT)
    state = Mark("unknown", "neither returned" if missing == "both" else f"{missing} did not return")
    if is_number(jump) and is_number(sigma):
        state = Mark("good", "within 2 σ") if jump <= 2.0 * sigma else Mark("warn", "beyond 2 σ")
    span = f"{clock(outage.start_s)} – {clock(outage.end_s)}"
    return (span, missing, clock(outage.length_s), number(jump, 0, "m"), number(sigma, 0, "m"), state)


def _azimuth(azimuth: AzimuthEstimate | None) -> Note | None:
    if azimuth is None:
        return None
    reason = typeset(azimuth.reason)
    if not azimuth.observable:
        return Note(f"Azimuth error: not observable on this flight: {reason}.", "unknown")
    error, sigma = number(azimuth.error_deg, 3, "°", signed=True), number(azimuth.sigma_deg, 3, "°")
    return Note(f"Azimuth error from the turns: {error} (σ {sigma}): {reason}.")


def _settings(settings: Mapping[str, float | str | bool]) -> tuple[Facts | None, ...]:
    """Return the keys of the settings file, and the noise that follows from the INS class."""
    own = {name: value for name, value in settings.items() if not name.startswith(NOISE)}
    noise = {name.removeprefix(NOISE): value for name, value in settings.items() if name.startswith(NOISE)}
    facts = setting_facts(noise)
    return setting_facts(own, "inertial"), None if facts is None else replace(facts, title="Noise of the INS class")
