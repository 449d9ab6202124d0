"""Chapter: INS errors (system 2): what the INS is like, its states with sigma, and how consistent the filter is."""

from collections.abc import Mapping, Sequence
from typing import Any

from groundstation.chapters.parts import Cell, Facts, Grid, Head, Mark, Note, Part, Section, Tone
from groundstation.chapters.wording import (
    ABSENT,
    any_value,
    clock,
    is_number,
    named_quantity,
    number,
    typeset,
    unit_sign,
)
from groundstation.reports.figures import inertial as inertial_figures
from groundstation.reports.sections.saved import mapping, not_assessable_reason, objects
from groundstation.results.files import SavedFlight
from groundstation.results.inertial import MISSING, is_left_alone

CHANNELS = ("north", "east")
PLACES = {"m": 1, "mps": 3, "arcsec": 1, "dph": 4, "dphph": 4}
CONSISTENT = (0.93, 0.97)  # shares of innovations inside their 95 % band that pass for it
LEAD = (
    "While GNSS is there a Kalman filter finds the errors of the INS, north and east apart: position, velocity, "
    "platform tilt, gyro drift. Error = INS − truth."
)


def build(saved: SavedFlight) -> Section | None:
    """Build the chapter; None when the flight was not assessed and no reason is known."""
    inertial = mapping(saved.summary, "results", "inertial")
    if not inertial:
        reason = not_assessable_reason(saved, "inertial")
        note = Note(f"Not assessable: {reason}", "unknown")
        return Section("inertial", "INS errors", LEAD, (note,)) if reason else None
    parts: tuple[Part | None, ...] = (
        *_conclusions(inertial),
        _figures_of_merit(inertial),
        _states(inertial),
        inertial_figures.state(saved, "position"),
        inertial_figures.state(saved, "velocity"),
        inertial_figures.tilt_and_drift(saved),
        inertial_figures.radial(saved),
        _outages(inertial),
        _consistency(inertial),
        inertial_figures.innovations(saved),
        inertial_figures.observability(saved),
        _azimuth(inertial),
        _settings(inertial),
    )
    return Section("inertial", "INS errors", LEAD, tuple(part for part in parts if part is not None))


def _conclusions(inertial: Mapping[str, Any]) -> list[Note]:
    """The chapter in a few sentences: what the INS is like, and whether the filter can be trusted."""
    reason = typeset(str(inertial.get("kind_reason") or "")).strip().rstrip(".")
    reopened = inertial.get("reopened")
    if inertial.get("kind") == "gnss_aided":
        return [Note(f"This INS is aided by GNSS, and a forecast from it means nothing: {reason}.", "warn")]
    notes = []
    if inertial.get("kind") == "unknown":
        text = f"Whether GNSS corrects this INS already cannot be told: {reason or 'the log does not show it'}."
        notes.append(Note(f"{text} If it does, its errors and any forecast mean nothing.", "unknown"))
    notes.append(_quality(inertial))
    if is_number(reopened) and reopened > 0:
        times = "once" if reopened == 1 else f"{number(reopened, 0)} times"
        text = (
            f"GNSS was rejected for so long that the filter was opened to it again, {times}: the noise of INS class "
            f"{inertial.get('ins_class') or ABSENT} does not fit this INS or this receiver."
        )
        notes.append(Note(text, "warn"))
    return notes


def _quality(inertial: Mapping[str, Any]) -> Note:
    rates = [number(inertial.get(f"radial_error_rate_{share}_nmiph"), 2, "nmi/h") for share in (50, 95)]
    rate = "" if ABSENT in rates else f" of {rates[0]} (median; 95 % of the time below {rates[1]})"
    velocity = number(inertial.get("velocity_error_rms_mps"), 2, "m/s")
    largest = number(inertial.get("largest_radial_error_m"), 0, "m")
    name = f"An INS{rate}, taken as unaided" if inertial.get("kind") == "unknown" else f"An unaided INS{rate}"
    text = f"{name}: velocity error {velocity} RMS, position error up to {largest}. {_in_words(inertial)}"
    tone: Tone = "plain" if _is_inflated(inertial) else "good"  # raised noise proves nothing
    return Note(text.strip(), tone if _is_consistent(inertial) else "warn")


def _channels(inertial: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    found = [(name, mapping(inertial, name)) for name in CHANNELS]
    return [(name, channel) for name, channel in found if channel]


def _shares(inertial: Mapping[str, Any]) -> dict[str, float]:
    found = {name: channel.get("share_inside95") for name, channel in _channels(inertial)}
    return {name: float(share) for name, share in found.items() if is_number(share)}


def _is_inflated(inertial: Mapping[str, Any]) -> bool:
    return any(not is_number(channel.get("nis_low")) for _, channel in _channels(inertial))


def _is_consistent(inertial: Mapping[str, Any]) -> bool:
    shares = _shares(inertial)
    highest = 1.0 if _is_inflated(inertial) else CONSISTENT[1]
    return bool(shares) and all(CONSISTENT[0] <= share <= highest for share in shares.values())


def _in_words(inertial: Mapping[str, Any]) -> str:
    shares = _shares(inertial)
    if not shares:
        return ""
    told = " and ".join(f"{number(100.0 * share, 1, '%')} ({name})" for name, share in shares.items())
    text = f"{told} of the innovations lie inside their 95 % band"
    if min(shares.values()) < CONSISTENT[0]:
        return f"{text}: the filter is surer than it should be."
    if _is_inflated(inertial):
        return (
            "The GNSS noise was raised to cover slow errors, so innovations cannot show whether the filter is "
            "consistent."
        )
    return f"{text}: " + (
        "the filter is consistent."
        if max(shares.values()) <= CONSISTENT[1]
        else "the filter claims less than it knows."
    )


def _figures_of_merit(inertial: Mapping[str, Any]) -> Facts:
    origin = str(inertial.get("ins_class_origin") or "")
    transition = "exact exponential" if inertial.get("transition") == "exact" else "first order, I + A T"
    pairs = (
        (
            "Radial error rate, median / 95 %",
            " / ".join(number(inertial.get(f"radial_error_rate_{share}_nmiph"), 2, "nmi/h") for share in (50, 95)),
            "position error over time since the first epoch, epochs later than ten minutes",
        ),
        ("Velocity error, RMS", number(inertial.get("velocity_error_rms_mps"), 3, "m/s"), "both channels together"),
        ("Largest radial error", number(inertial.get("largest_radial_error_m"), 0, "m"), "against GNSS"),
        (
            "Kind",
            str(inertial.get("kind") or ABSENT).replace("_", "-"),
            typeset(str(inertial.get("kind_reason") or "")),
        ),
        ("INS class", str(inertial.get("ins_class") or ABSENT), f"noise parameters: {origin}" if origin else ""),
        ("Pair used", f"{inertial.get('ins_topic')} against {inertial.get('gnss_topic')}", _others(inertial)),
        (
            "Epochs compared",
            number(inertial.get("epochs"), 0),
            f"{clock(inertial.get('gnss_seconds'))} of the flight with GNSS",
        ),
        ("Transition matrix", transition, ""),
        ("Filter opened again", number(inertial.get("reopened"), 0, "times"), "after GNSS had been rejected for long"),
    )
    return Facts("The INS in figures", pairs)


def _others(inertial: Mapping[str, Any]) -> str:
    topics = inertial.get("other_ins")
    return f"not used: {any_value(topics)}" if isinstance(topics, list) and topics else ""


def _states(inertial: Mapping[str, Any]) -> Grid | None:
    channels, used = _channels(inertial), mapping(inertial, "settings")
    by_name = [{str(state.get("name")): state for state in objects(channel, "states")} for _, channel in channels]
    names = list(dict.fromkeys(name for states in by_name for name in states))
    if not names:
        return None
    rows: list[tuple[Cell, ...]] = []
    for name in names:
        known = next(states[name] for states in by_name if name in states)
        unit = str(known.get("unit") or "")
        title = str(known.get("title") or name)
        title = f"{title[:1].upper()}{title[1:]}, {unit_sign(unit)}"
        alone = [
            channel
            for (channel, _), states in zip(channels, by_name, strict=True)
            if is_left_alone(name, states.get(name, {}).get("sigma"), states.get(name, {}).get("observability"), used)
        ]
        if alone:
            where = "" if len(alone) == len(channels) else f"{alone[0]} "
            title += f" ({where}not estimated in this class)"
        cells: list[Cell] = []
        for (channel, _), states in zip(channels, by_name, strict=True):
            places = PLACES.get(unit, 3)
            cells += [ABSENT] * 4 if channel in alone else _state_cells(states.get(name, {}), places)
        rows.append((title, *cells))
    heads = [Head("State")]
    for channel, _ in channels:
        heads += [Head(f"{channel.capitalize()}", True), Head("± σ", True), Head("Seen", True), Head("From", True)]
    caption = (
        "At the last time GNSS was there. Seen: observability, 1 − σ/σ without GNSS; near 0 the data say nothing of "
        "the state. From: flight time since when it stays above one half. Not estimated: the class holds the state at "
        "zero, and its σ never moved."
    )
    return Grid("States", heads, rows, caption, ("inertial_states",))


def _state_cells(state: Mapping[str, Any], places: int) -> tuple[str, ...]:
    since = state.get("observable_from_s")
    return (
        number(state.get("value"), places, signed=True),
        number(state.get("sigma"), places),
        number(state.get("observability"), 2),
        clock(since) if is_number(since) else "never",
    )


def _consistency(inertial: Mapping[str, Any]) -> Grid | None:
    rows = []
    for name, channel in _channels(inertial):
        low, high = channel.get("nis_low"), channel.get("nis_high")
        limits = f"{number(low, 2)} … {number(high, 2)}" if is_number(low) and is_number(high) else "noise raised"
        rows.append(
            (
                name.capitalize(),
                number(channel.get("nis"), 3),
                limits,
                percent(channel.get("share_inside95"), 1),
                number(channel.get("innovations"), 0),
                number(channel.get("rejected"), 0),
                number(channel.get("velocity_error_rms_mps"), 3, "m/s"),
                number(channel.get("position_error_rms_m"), 0, "m"),
            )
        )
    titles = ("NIS", "95 % limits", "Inside 95 %", "Innovations", "Rejected", "Velocity RMS", "Position RMS")
    caption = (
        "NIS: mean normalised innovation squared, 1 where the noise model is right. Noise raised: slow GNSS errors are "
        "covered by a larger white noise; then NIS stays below 1, has no limits, and neither it nor the share inside "
        "says anything of consistency."
    )
    heads = (Head("Channel"), *(Head(title, True) for title in titles))
    return Grid("Consistency of the filter", heads, rows, caption) if rows else None


def percent(share: Any, places: int = 0) -> str:
    """A share as per cent.

    Examples
    --------
    >>> percent(0.953), percent(None)
    ('95%', '—')
    """
    return number(100.0 * share, places, "%") if is_number(share) else ABSENT


def _outages(inertial: Mapping[str, Any]) -> Grid | None:
    rows: list[Sequence[Cell]] = []
    for outage in objects(inertial, "outages"):
        jump, sigma = outage.get("jump_m"), outage.get("sigma_m")
        missing = MISSING.get(str(outage.get("missing") or "gnss"), ABSENT)
        state: Cell = Mark("unknown", "neither returned" if missing == "both" else f"{missing} did not return")
        if is_number(jump) and is_number(sigma):
            state = Mark("good", "within 2 σ") if jump <= 2.0 * sigma else Mark("warn", "beyond 2 σ")
        span = f"{clock(outage.get('start_s'))} – {clock(outage.get('end_s'))}"
        cells = (clock(outage.get("length_s")), number(jump, 0, "m"), number(sigma, 0, "m"))
        rows.append((span, missing, *cells, state))
    numeric = (Head(title, True) for title in ("Length", "Off on return", "σ claimed"))
    heads = (Head("Flight time"), Head("Without"), *numeric, Head(""))
    caption = (
        "The filter went over to the forecast by itself; off on return: forecast against the first position difference "
        "seen again."
    )
    return Grid("Outages in the log", heads, rows, caption) if rows else None


def _azimuth(inertial: Mapping[str, Any]) -> Note | None:
    azimuth = mapping(inertial, "azimuth")
    if not azimuth:
        return None
    reason = typeset(str(azimuth.get("reason") or ""))
    if not azimuth.get("observable"):
        return Note(f"Azimuth error: not observable on this flight: {reason}.", "unknown")
    error, sigma = number(azimuth.get("error_deg"), 3, "°", signed=True), number(azimuth.get("sigma_deg"), 3, "°")
    return Note(f"Azimuth error from the turns: {error} (σ {sigma}): {reason}.")


def _settings(inertial: Mapping[str, Any]) -> Facts | None:
    pairs = []
    for name, value in sorted(mapping(inertial, "settings").items()):
        title, unit = named_quantity(str(name))
        pairs.append((title, any_value(value, unit), ""))
    return Facts("Model, noise and gates as used", pairs, compact=True) if pairs else None
