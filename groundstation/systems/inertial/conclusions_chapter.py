"""Conclusions of the chapter on the forecast: skill, honesty of the sigma, windows."""

from collections.abc import Mapping, Sequence

from groundstation.base.words import listed
from groundstation.chapters.parts import Note
from groundstation.chapters.wording import clock, is_number, number, percent, plural, typeset
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.systems.inertial.forecast_answer import FEWEST_STARTS, ForecastResult, SkillRow

HONEST = (0.90, 0.98)  # shares inside the 95 % band that pass for it
SAME = 0.03  # two RMS values closer than this are not told apart
HEADLINE_MIN = 60.0  # the horizon the conclusion quotes, or the longest there is


def conclusions(answer: ForecastResult) -> list[Note]:
    """Return a sentence or two for skill, honesty and windows."""
    return [note for note in (_gain(answer), _honesty(answer), _windows(answer)) if note is not None]


def rows_of(answer: ForecastResult, method: str) -> dict[float, SkillRow]:
    """Return skill rows of a method by horizon, those that have an error."""
    return {
        float(row.horizon_min): row
        for row in answer.skill
        if row.method == method and is_number(row.horizon_min) and is_number(row.rms_m)
    }


def title_of(method: str) -> str:
    """Return the title of a method for people."""
    return FORECAST_METHODS.get(method, method)


def _gain(answer: ForecastResult) -> Note | None:
    default = answer.default_method
    shipped, raw = rows_of(answer, default), rows_of(answer, "raw_ins")
    shared = sorted(set(shipped) & set(raw))
    if not shared:
        return None
    horizon = HEADLINE_MIN if HEADLINE_MIN in shared else shared[-1]
    ours, theirs = shipped[horizon], raw[horizon]
    better = [lead for lead in shared if shipped[lead].rms_m < raw[lead].rms_m]
    text = (
        f"After {horizon:g} min without GNSS 95 % of the errors are below {number(ours.p95_m, 0, 'm')} by the shipped "
        f"method ({title_of(default)}) and below {number(theirs.p95_m, 0, 'm')} by the raw INS (RMS "
        f"{number(ours.rms_m, 0, 'm')} and {number(theirs.rms_m, 0, 'm')}), over {plural(ours.starts, 'start')}; it "
        f"beats the raw INS {_where(better, shared)}.{_early(answer, 60.0 * horizon)}"
    )
    return Note(text, "good" if len(better) == len(shared) else "warn")


def _early(answer: ForecastResult, length_s: float) -> str:
    """Return the error of such outages that begin earlier; empty without any."""
    early = [row for row in answer.phases if row.is_early and row.length_s == length_s]
    if not early:
        return ""
    row = max(early, key=lambda one: one.starts)
    return (
        f" Outages that begin before {clock(answer.first_start_s)} ({row.phase}): {number(row.rms_m, 0, 'm')} RMS, the "
        f"raw INS {number(row.raw_rms_m, 0, 'm')}."
    )


def _honesty(answer: ForecastResult) -> Note | None:
    few = _too_few(answer)
    known = {
        lead: row.coverage95
        for lead, row in rows_of(answer, answer.default_method).items()
        if is_number(row.coverage95)
    }
    shares = {lead: share for lead, share in known.items() if lead not in few}
    start = _uncalibrated(answer)
    unjudged = [lead for lead in known if lead in few]
    why = f"fewer than {FEWEST_STARTS} independent starts"
    if not shares:
        text = f"{start}Its σ cannot be judged: {why}." if unjudged else start.strip()
        return Note(text, "warn" if start else "unknown") if text else None
    left = f" {_where(unjudged, list(known)).capitalize()} not judged: {why}." if unjudged else ""
    low, high = percent(min(shares.values())), percent(max(shares.values()))
    held = low if low == high else f"{low} to {high} (by horizon)"
    text = f"{start}The 95 % band of the forecast held {held} of the errors: "
    misfit = _misfit(shares, list(known))
    if not misfit:
        return Note(f"{text}the σ it claims is honest on this flight.{left}", "warn" if start else "good")
    is_narrow = any(share < HONEST[0] for share in shares.values())
    return Note(f"{text}{misfit}.{left}", "warn" if start or is_narrow else "plain")  # too wide misleads nobody


def _uncalibrated(answer: ForecastResult) -> str:
    """Return the sentence that opens the judgement of a forecast that is not calibrated."""
    if answer.is_calibrated:
        return ""
    reason = typeset(answer.calibration_reason).strip().rstrip(".")
    return f"Not calibrated: {reason or 'too little data before the outage'}. "


def _misfit(shares: Mapping[float, float], every: Sequence[float]) -> str:
    """Return at which horizons the band is too narrow or too wide; empty where it fits."""
    narrow = [lead for lead, share in shares.items() if share < HONEST[0]]
    wide = [lead for lead, share in shares.items() if share > HONEST[1]]
    told = [
        f"too narrow {_where(narrow, every)}" if narrow else "",
        f"wider than needed {_where(wide, every)}" if wide else "",
    ]
    return " and ".join(filter(None, told))


def _too_few(answer: ForecastResult) -> set[float]:
    """Return the horizons at which the shipped method has too few independent starts."""
    return {
        float(row.horizon_min)
        for row in answer.calibration
        if row.method == answer.default_method and row.independent_starts < FEWEST_STARTS
    }


def _windows(answer: ForecastResult) -> Note | None:
    """Return whether the windows of Neusypin 2003 help on this flight.

    They are compared with the last estimate of their own model.
    """
    windows, last = rows_of(answer, "windows"), _separate_last(answer)
    shared = sorted(set(windows) & set(last))
    if not shared:
        return None
    pairs = {lead: (windows[lead].rms_m, last[lead]) for lead in shared}
    helped = [lead for lead, (ours, theirs) in pairs.items() if ours < (1.0 - SAME) * theirs]
    hurt = [lead for lead, (ours, theirs) in pairs.items() if ours > (1.0 + SAME) * theirs]
    told = [_at(verb, leads, pairs) for verb, leads in (("help", helped), ("hurt", hurt)) if leads]
    sentence = "The long-period windows of Neusypin 2003 " + (
        " and ".join(told) if told else "change nothing on this flight"
    )
    return Note(f"{sentence}. One flight decides nothing: starts overlap.", "plain")


def _separate_last(answer: ForecastResult) -> dict[float, float]:
    """Return the RMS of the last estimate of two separate channels, by horizon.

    The same whichever model the settings forecast by.
    """
    found = {float(row.horizon_min): row.rms_m / (1.0 - row.gain) for row in answer.coupled if row.gain < 1.0}
    return found or {lead: row.rms_m for lead, row in rows_of(answer, "last_estimate").items()}


def _at(verb: str, leads: Sequence[float], pairs: Mapping[float, tuple[float, float]]) -> str:
    windows, last = pairs[leads[-1]]
    sizes = f"{number(windows, 0, 'm')} against {number(last, 0, 'm')}"
    example = f"at {leads[-1]:g} min {sizes} of the separate model's last estimate"
    return f"{verb} {_where(leads, list(pairs))} ({example})"


def _where(some: Sequence[float], every: Sequence[float]) -> str:
    if not some:
        return "at no horizon"
    return (
        "at every horizon" if len(some) == len(every) else f"at {listed([f'{value:g}' for value in sorted(some)])} min"
    )
