"""Chapter on autopilot health.

The flight in a sentence, a table of checks, lanes, panels, what was logged.
"""

from collections.abc import Mapping, Sequence

from groundstation.base.words import capitalised, tenths_text
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.parts import Cell, Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, Section, Tone
from groundstation.chapters.wording import (
    ABSENT,
    clean,
    clock,
    number,
    percent,
    plural,
    significant,
    typeset,
    with_full_stop,
)
from groundstation.results.flight import FlightResults
from groundstation.systems.health.answer import (
    FIRST,
    HEADLINES,
    AutopilotHealth,
    Check,
    Happening,
    Measure,
    Verdict,
    gravity,
    span_words,
)
from groundstation.systems.health.plots import SIGNS, sign_of
from groundstation.systems.health.sentence_answer import told_apart

TITLE = "Autopilot health"
LEAD = "Was GNSS good, was the filter healthy, and what went wrong when."
TONES: Mapping[Verdict, Tone] = {"pass": "good", "warn": "warn", "fail": "bad", "not_logged": "unknown"}
WORDS: Mapping[Verdict, str] = {"pass": "pass", "warn": "warn", "fail": "fail", "not_logged": "not logged"}
GRADES: Mapping[str, Mark] = {"info": Mark("plain", "info"), "warn": Mark("warn", "warn"), "fail": Mark("bad", "fail")}
MOST_LISTED = 40
LONGEST_WHOLE = 1e10  # a parameter of 32 bits has ten digits


def health(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(AutopilotHealth)
    if answer is None:
        return without_answer(results, "health", TITLE, LEAD)
    told = [one for one in answer.checks if one.is_told]
    blank = [one for one in answer.checks if one.is_blank]
    missing = [one.title for one in answer.checks if not one.is_told and not one.is_blank]
    shown = [one.key for one in told if one.is_bad or one.key in FIRST]
    parts: list[Part] = [
        _checks(told, answer.judged_over),
        *(Note(f"{capitalised(one.title)}: {one.reason}.", "unknown") for one in blank),
        *([Note(f"Not logged: {', '.join(missing)}.", "unknown")] if missing else []),
        *([Figure("health.motors")] if answer.loss is not None and answer.loss.motors else []),
        Figure("health.lanes"),
        *(Figure("health.panels", key) for key in shown),
    ]
    listed = _happenings(
        [one for one in answer.happenings if one.grade != "info"], "Warnings and errors logged", answer
    )
    parts += [] if listed is None else [listed]
    others = [Figure("health.panels", one.key) for one in told if one.key not in shown]
    rest = _happenings([one for one in answer.happenings if one.grade == "info"], "Modes and remarks logged", answer)
    settings = [part for part in (_found(answer), _differing(answer)) if part is not None]
    appendix = (*others, *([] if rest is None else [rest]), _measures(answer), *settings, _basis(answer))
    claim = _claim(answer)
    return Section("health", TITLE, LEAD, tuple(parts), claim.headline, claim=claim, appendix=appendix)


def _claim(answer: AutopilotHealth) -> Claim:
    bad = sorted((one for one in answer.checks if one.is_bad), key=gravity)
    figures = tuple((one.title, WORDS[one.verdict], with_signs(one.reason)) for one in bad[:4])
    mark = Mark(TONES[answer.verdict], HEADLINES[answer.verdict])
    passed = sum(one.verdict == "pass" for one in answer.checks)
    logged = sum(one.verdict != "not_logged" for one in answer.checks)
    first, rest = told_apart(answer.checks, answer.loss)
    sentences = [with_full_stop(typeset(one)) for one in rest]
    sentences.append(f"{number(passed, 0)} of {plural(logged, 'check')} pass {answer.judged_over}.")
    if answer.not_flown:
        sentences.append(f"It did not fly ({typeset(answer.not_flown)}).")
    is_danger = answer.verdict == "fail" and answer.is_flown
    return Claim(Rank.HEALTH, mark, typeset(first), "", "", sentences, figures, is_danger=is_danger)


def _checks(checks: Sequence[Check], over: str) -> Grid:
    heads = (
        *(Head("Check"), Head("Verdict"), Head("What decided"), Head("Amber", True), Head("Red", True)),
        *(Head("Longest span, or when"), Head("Limits"), Head("Source of the limits")),
    )
    caption = f"Amber and red: share of the time {over} in which the quantity is logged; amber includes red. "
    caption += "The longest span need not hold the worst value: Every quantity has its time."
    return Grid("Checks", heads, [_check(one) for one in checks], caption, ("health_lanes",))


def _check(check: Check) -> tuple[Cell, ...]:
    measure = check.decisive
    mark = Mark(TONES[check.verdict], "not judged" if check.verdict == "not_logged" else WORDS[check.verdict])
    what = with_signs(check.reason or ("" if measure is None else measure.told)) or ABSENT
    if measure is None:
        when = ABSENT if check.first_event_s is None else clock(check.first_event_s)
        source = "what the flight shows" if check.key == "settings" else "level of the message"
        return (check.title, mark, what, ABSENT, ABSENT, when, ABSENT, source)
    return (
        check.title,
        mark,
        what,
        _share(measure, measure.amber_share),
        _share(measure, measure.red_share),
        _when(check, measure),
        _limits(measure),
        measure.threshold_source,
    )


def with_signs(text: str) -> str:
    """Return text of the terminal with the signs of a page.

    Examples
    --------
    >>> with_signs("vibration up to 42 m/s2")
    'vibration up to 42 m/s²'
    """
    told = typeset(text)
    for unit, sign in SIGNS.items():
        told = told.replace(f" {unit}", f" {sign}")
    return told


def _share(measure: Measure, share: float | None) -> str:
    return percent(share, 1) if measure.rule == "share" else ABSENT


def _when(check: Check, measure: Measure) -> str:
    if measure.span_start_s is not None and measure.span_end_s is not None:
        return " … ".join(span_words(measure.span_start_s, measure.span_end_s))
    return ABSENT if check.first_event_s is None else clock(check.first_event_s)


def _limits(measure: Measure) -> str:
    if measure.is_flag:
        return "set"
    sign = "<" if measure.is_below else ">"
    unit = sign_of(measure.unit)
    levels = [significant(level) for level in (measure.amber, measure.red) if level is not None]
    return f"{sign} {' / '.join(levels)} {unit}".strip() if levels else ABSENT


def _happenings(happenings: Sequence[Happening], title: str, answer: AutopilotHealth) -> Grid | None:
    if not happenings:
        return None
    rows = [
        (clock(one.time_s), GRADES[one.grade], clean(one.text), "yes" if one.in_the_air else "no")
        for one in sorted(happenings, key=lambda one: one.time_s)[:MOST_LISTED]
    ]
    more = f"The first {MOST_LISTED} of {number(len(happenings), 0)}." if len(happenings) > MOST_LISTED else ""
    heads = (Head("Time"), Head("Grade"), Head("What"), Head(capitalised(answer.judged_over)))
    return Grid(title, heads, rows, more)


def _found(answer: AutopilotHealth) -> Grid | None:
    """Return the settings beside what the flight shows."""
    if not answer.settings_found:
        return None
    heads = (
        *(Head("Setting"), Head("Parameter"), Head("Set", True), Head("Found", True), Head("Sigma", True)),
        *(Head("Verdict"), Head("Basis, or why not")),
    )
    rows = [
        (
            one.what,
            one.name,
            f"{significant(one.stated)} {sign_of(one.unit)}".strip(),
            ABSENT if one.found is None else f"{significant(one.found)} {sign_of(one.unit)}".strip(),
            ABSENT if one.sigma is None else significant(one.sigma),
            Mark(TONES[one.verdict], WORDS[one.verdict]),
            typeset(one.reason),
        )
        for one in answer.settings_found
    ]
    return Grid("Settings against what was found", heads, rows)


def _as_set(value: float) -> str:
    """Return a parameter as it is set: single precision, whole numbers in full."""
    return f"{value:.0f}" if value == round(value) and abs(value) < LONGEST_WHOLE else f"{value:.7g}"


def _differing(answer: AutopilotHealth) -> Grid | Note | None:
    """Return the parameters off their defaults; a note where the log tells no defaults."""
    if not answer.parameters_logged:
        return None
    if not answer.has_defaults:
        text = (
            f"Parameters off their defaults: not logged. The log has {number(answer.parameters_logged, 0)} parameters"
        )
        return Note(f"{text} and none of their defaults.", "unknown")
    rows = [(one.name, _as_set(one.value), _as_set(one.default)) for one in answer.differing]
    caption = f"{number(len(rows), 0)} of {number(answer.parameters_logged, 0)} parameters, by the log's own defaults."
    heads = (Head("Parameter"), Head("Value", True), Head("Default", True))
    return Grid("Parameters off their defaults", heads, rows, caption)


def _measures(answer: AutopilotHealth) -> Grid:
    heads = (
        *(Head("Quantity"), Head("Verdict"), Head("Worst", True), Head("At", True), Head("Median", True)),
        *(Head("Amber, judged / log", True), Head("Red, judged / log", True), Head("Logged", True), Head("Field")),
    )
    rows = [
        (
            one.name,
            Mark(TONES[one.verdict], "no limit" if one.is_unjudged else WORDS[one.verdict]),
            _worst(one),
            tenths_text(one.worst_at_s),
            significant(one.median),
            f"{percent(one.amber_share, 1)} / {percent(one.amber_share_log, 1)}",
            f"{percent(one.red_share, 1)} / {percent(one.red_share_log, 1)}",
            percent(one.logged_share),
            one.source,
        )
        for one in answer.measures
    ]
    return Grid("Every quantity", heads, rows, f"Logged: share of the time {answer.judged_over}.")


def _worst(measure: Measure) -> str:
    """Return the worst value, of a counter how far it rose."""
    if measure.rule == "rise":
        return f"rose by {significant(measure.figure)}" if measure.figure is not None else ABSENT
    return f"{significant(measure.worst)} {sign_of(measure.unit)}".strip()


def _estimator(answer: AutopilotHealth) -> list[tuple[str, str, str]]:
    if not answer.estimator:
        return []
    told = "none: the simulator's truth" if answer.estimator == "simulator" else answer.estimator
    return [("Estimator that flew it", told, typeset(answer.estimator_source))]


def _basis(answer: AutopilotHealth) -> Facts:
    pairs: list[tuple[str, str, str]] = [
        ("Autopilot", answer.autopilot, ""),
        *_estimator(answer),
        ("Judged", answer.judged_over, typeset(answer.judged_by)),
        ("Time judged", clock(answer.judged_s), "min:s"),
    ]
    if answer.happenings_left_out:
        pairs.append(("Messages not listed", number(answer.happenings_left_out, 0), ""))
    return Facts("What it rests on", pairs)
