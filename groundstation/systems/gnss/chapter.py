"""Chapter on the GNSS reception of a flight."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from groundstation.base.records import AT_ODDS
from groundstation.base.words import capitalised
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.parts import Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, Section, Tone, kept
from groundstation.chapters.wording import clock, number, typeset, with_full_stop
from groundstation.results.flight import FlightResults
from groundstation.systems.gnss.answer import NOT_LOGGED as UNLOGGED
from groundstation.systems.gnss.answer import (
    WITHOUT_RECORD,
    FixLoss,
    GnssReceiver,
    GnssReception,
    Grade,
    PositionJump,
    ReceiverPair,
    StandstillScatter,
)
from groundstation.systems.gnss.arrays import GnssMissing
from groundstation.systems.gnss.wording_answer import (
    length_text,
    meaning_of,
    memory_of,
    missing_of,
    name_of,
    same_claims,
    seconds_text,
    share_text,
    texts_text,
)

TITLE = "GNSS reception"
LEAD = "What the receiver had over time, how good it was, and where it was lost."
MARKS: dict[Grade, Mark] = {
    "good": Mark("good", "Good"),
    "warn": Mark("warn", "Warnings"),
    "bad": Mark("bad", "Bad"),
    "unknown": Mark("unknown", "Not judged"),
}
ABSENT = "—"
NOT_LOGGED = "not logged"
MOST_ROWS = 20
NO_HEADING = "No heading source in the log: track only."
OF_SIGNALS = (
    "C/N0 is the mean of all signals, faint second frequencies too, and has no part in the grade: limits in use are of "
    "the strongest signals (u-blox, RF design for GPS receivers, 7.4: 50 dB-Hz under open sky, below 40 degraded)."
)
NOT_JUDGED = (
    "The log has neither the kind of fix nor satellites, dilution or claimed accuracy: only losses and jumps show."
)


def gnss(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(GnssReception)
    if answer is None:
        return without_answer(results, "gnss", TITLE, LEAD)
    tone: Tone = "bad" if answer.grade == "bad" else "warn"
    notes = [Note(with_full_stop(typeset(reason)), tone) for reason in answer.reasons]
    if answer.grade == "unknown":
        notes.append(Note(NOT_JUDGED, "unknown"))
    if not answer.has_heading_source:
        notes.append(Note(NO_HEADING))
    notes += [Note(with_full_stop(typeset(same))) for same in _same_claims(answer)]
    notes += [
        Note(with_full_stop(typeset(capitalised(one.text))), "warn")
        for one in results.ledger.remarks
        if one.code in AT_ODDS and one.topic in {receiver.topic for receiver in answer.receivers}
    ]
    parts: list[Part | None] = [*notes, Figure("gnss.states"), _states(answer), _quality(answer)]
    for one in answer.receivers:
        parts += [Figure("gnss.quality", of=one.topic), *_standstill(one, answer), *_motion(one, answer)]
    parts += [
        _losses(answer),
        _missing(answer, results.rows_of(GnssMissing)),
        _jumps(answer),
        *(Note(with_full_stop(typeset(texts_text(one)))) for one in answer.texts),
    ]
    for pair in answer.pairs:
        parts += [_pair(pair), Figure("gnss.pair", of=f"{pair.second} from {pair.first}")]
    return Section("gnss", TITLE, LEAD, kept(parts), typeset(answer.sentence), claim=_claim(answer))


def _claim(answer: GnssReception) -> Claim:
    main = answer.receiver
    best = max(main.fixes, key=lambda one: one.share, default=None)
    value = share_text(0.0 if best is None else main.share(best.state))  # of all its time, as in the table
    remark = "" if best is None else name_of(best.state)
    told = [
        ("Satellites", number(main.satellites_used, 0), "median"),
        ("HDOP", number(main.hdop, 1), "median") if main.hdop is not None else ("PDOP", number(main.pdop, 1), "median"),
        ("C/N0", number(main.cn0_dbhz, 0, "dB-Hz"), "mean of all signals, not judged"),
    ]
    stood = main.told_standstill
    if stood is not None and not stood.is_held and not stood.is_coarse:
        kind = name_of(stood.state) if len(main.fixes) > 1 else ""
        claimed = "" if stood.claimed_m is None else f"{length_text(stood.claimed_m)} claimed"
        told.append(("Scatter", length_text(stood.scatter_m), ", ".join(filter(None, ("horizontal σ", kind, claimed)))))
    figures = tuple(one for one in told if one[1] != "—")
    above = answer.against
    reasons = [reason for reason in answer.reasons if reason != above]
    sentences = [with_full_stop(typeset(reason)) for reason in (*reasons, *_same_claims(answer))]
    if not answer.has_heading_source:
        sentences.append(NO_HEADING)
    return Claim(Rank.GNSS, MARKS[answer.grade], _headline(answer), value, remark, tuple(sentences), figures)


def _same_claims(answer: GnssReception) -> list[str]:
    """Return which receivers claim as much of a worse kind of fix as of a better one."""
    told = [(one, same_claims(one)) for one in answer.receivers]
    return [f"{one.topic}: {same}" if len(answer.receivers) > 1 else same for one, same in told if same]


def _headline(answer: GnssReception) -> str:
    """Return the sentence, behind what is against the reception, with a capital."""
    told = answer.line
    return typeset(capitalised(told))


def _states(answer: GnssReception) -> Grid:
    heads = (
        *(Head("Receiver"), Head("State"), Head("Time", True), Head("Share", True)),
        *(Head("Spells", True), Head("Longest", True)),
    )
    rows = [
        (
            *(one.topic, name_of(state.state), seconds_text(state.seconds)),
            ABSENT if state.state == UNLOGGED else share_text(state.share),
            *(number(state.spells, 0), seconds_text(state.longest_s)),
        )
        for one in answer.receivers
        for state in one.states
    ]
    is_paused = any(one.not_logged_s for one in answer.receivers)
    what = "the logged time" if is_paused else "time"
    caption = f"Shares are of {what}, from the first row to the last."
    if any(state.state in WITHOUT_RECORD for one in answer.receivers for state in one.states):
        caption += " As a state a gap begins one usual step behind its row; elsewhere it is from row to row."
    return Grid("States of the fix", heads, rows, caption, ("gnss_states",))


def _quality(answer: GnssReception) -> Grid:
    heads = (Head("Quantity"), *(Head(one.topic, True) for one in answer.receivers))
    rows = [(title, *(told(one) for one in answer.receivers)) for title, told in QUALITY]
    caption = "Medians over the time with a fix; in brackets what one twentieth of the time is beyond."
    if any(one.cn0_dbhz is not None for one in answer.receivers):
        caption += f" {OF_SIGNALS}"
    return Grid("Quality", heads, rows, caption, ("gnss_quality",))


def _with_tail(name: str, tail: str, places: int, unit: str = "") -> Callable[[GnssReceiver], str]:
    def told(one: GnssReceiver) -> str:
        value, beyond = getattr(one, name), getattr(one, tail)
        if value is None:
            return NOT_LOGGED
        return number(value, places, unit) + ("" if beyond is None else f" ({number(beyond, places, unit)})")

    return told


_hdop = _with_tail("hdop", "hdop_high", 2)


def _vdop(one: GnssReceiver) -> float | None:
    """Return the vertical dilution by PDOP² = HDOP² + VDOP², of medians; None without both."""
    if one.pdop is None or one.hdop is None or one.pdop <= one.hdop:
        return None
    return float(np.sqrt(one.pdop**2 - one.hdop**2))


def _length(value: float | None) -> str:
    return NOT_LOGGED if value is None else length_text(value)


def _behind_ins(one: GnssReceiver) -> str:
    if one.behind_ins_s is None:
        return "not observed"
    return f"{number(one.behind_ins_s, 3, 's', signed=True)} (σ {number(one.behind_ins_sigma_s, 3, 's')})"


QUALITY: tuple[tuple[str, Callable[[GnssReceiver], str]], ...] = (
    ("Rows", lambda one: number(one.rows, 0)),
    ("Repeated times", lambda one: number(one.repeated_rows, 0)),
    ("Rate", lambda one: number(one.rate_hz, 2, "Hz")),
    (
        "Epochs missing",
        lambda one: "rate not regular" if one.missed_epochs is None else number(one.missed_epochs, 0),
    ),
    (
        "First fix after",
        lambda one: "never" if one.first_fix_s is None else seconds_text(one.first_fix_s - one.start_s),
    ),
    ("Satellites used", _with_tail("satellites_used", "satellites_used_low", 0)),
    ("Satellites tracked", _with_tail("satellites_tracked", "satellites_tracked", 0)),
    ("C/N0", _with_tail("cn0_dbhz", "cn0_low_dbhz", 1, "dB-Hz")),
    ("HDOP", lambda one: _hdop(one) + (f", from {one.hdop_of.removeprefix('raw.')}" if one.hdop_of else "")),
    ("PDOP", _with_tail("pdop", "pdop_high", 2)),
    ("VDOP, of the two", lambda one: number(_vdop(one), 2)),
    ("Claimed horizontal σ", lambda one: _length(one.horizontal_sigma_m)),
    ("Claimed vertical σ", lambda one: _length(one.vertical_sigma_m)),
    (
        "Claimed σ of velocity",
        lambda one: NOT_LOGGED if one.velocity_sigma_mps is None else number(one.velocity_sigma_mps, 3, "m/s"),
    ),
    ("Age of corrections", _with_tail("age_of_corrections_s", "age_of_corrections_high_s", 1, "s")),
    ("Velocity later than the INS by", _behind_ins),
)


def _of(one: GnssReceiver, answer: GnssReception) -> str:
    return f" of {one.topic}" if len(answer.receivers) > 1 else ""


def _standstill(one: GnssReceiver, answer: GnssReception) -> list[Part | None]:
    """Return scatter beside the claim, a row for each kind of fix, and the figure."""
    every = one.standstills or ((one.standstill,) if one.standstill is not None else ())
    if not every:
        return []
    heads = (
        *(Head("Kind of fix"), Head("Judged"), Head("Rows", True), Head("Span", True)),
        *(Head("Horizontal scatter (σ claimed)", True), Head("Vertical scatter (σ claimed)", True)),
        Head("Speed shown, RMS (σ claimed)", True),
    )
    rows = [
        (
            *(name_of(stood.state), f"{clock(stood.start_s)} to {clock(stood.end_s)}", number(stood.samples, 0)),
            seconds_text(stood.end_s - stood.start_s),
            _beside(_horizontal(stood), None if stood.claimed_m is None else length_text(stood.claimed_m)),
            _beside(
                ABSENT if stood.is_held or stood.up_scatter_m is None else length_text(stood.up_scatter_m),
                None if stood.up_claimed_m is None else length_text(stood.up_claimed_m),
            ),
            _beside(
                number(stood.speed_rms_mps, 3, "m/s"),
                None if stood.claimed_mps is None else number(stood.claimed_mps, 3, "m/s"),
            ),
        )
        for stood in every
    ]
    told = [f"{name_of(stood.state)}: {memory_of(stood)}" if len(every) > 1 else memory_of(stood) for stood in every]
    caption = " ".join(with_full_stop(capitalised(text)) for text in (*told, *_edges(one, every, answer)))
    return [
        Grid(f"Scatter at standstill by kind of fix{_of(one, answer)}", heads, rows, caption, ("gnss_standstill",)),
        Figure("gnss.standstill", of=one.topic),
    ]


def _horizontal(stood: StandstillScatter) -> str:
    if stood.is_held:
        return ABSENT
    return f"below {length_text(stood.resolution_m)}" if stood.is_coarse else length_text(stood.scatter_m)


def _beside(value: str, claimed: str | None) -> str:
    return f"{value} ({NOT_LOGGED if claimed is None else claimed})" if value != ABSENT else value


def _edges(one: GnssReceiver, every: tuple[StandstillScatter, ...], answer: GnssReception) -> list[str]:
    """Return why a standstill is shorter than in the overview, and kinds without one."""
    told = []
    spans = [(stood.phase_start_s, stood.phase_end_s) for stood in every]
    shown = dict.fromkeys(f"{clock(start)} to {clock(end)}" for start, end in spans if start is not None)
    if shown:
        window_s, guard_s = (float(answer.settings.get(name, 0.0)) for name in ("still_window_s", "standstill_guard_s"))
        told.append(
            f"the overview shows standstill from {', '.join(shown)}; left out here: where the mean velocity over "
            f"{window_s:g} s still shows motion, {guard_s:g} s at either end, and another kind of fix"
        )
    without = [name_of(state.state) for state in one.fixes if state.state not in {stood.state for stood in every}]
    if without:
        least_s = float(answer.settings.get("standstill_min_s", 0.0))
        told.append(f"{', '.join(without)}: no standstill of {least_s:g} s, so no scatter")
    return told


def _position_behind_ins(one: GnssReceiver) -> str:
    """Return the delay of the position behind the INS, by both delays of the velocity.

    Empty where one of them is not known.
    """
    lag_s = None if one.motion is None else one.motion.lag_s
    if one.motion is None or lag_s is None or one.behind_ins_s is None:
        return ""
    behind_s = one.behind_ins_s - lag_s
    sigma_s = math.hypot(one.behind_ins_sigma_s or 0.0, one.motion.lag_sigma_s or 0.0)
    velocity = number(one.behind_ins_s, 3, "s", signed=True)
    return (
        f"The velocity is later than the INS by {velocity}, so the position is later than the INS by "
        f"{number(behind_s, 3, 's', signed=True)} (σ {number(sigma_s, 3, 's')})."
    )


def _motion(one: GnssReceiver, answer: GnssReception) -> list[Part | None]:
    motion = one.motion
    if motion is None:
        return [Figure("gnss.steps", of=one.topic)]
    claimed = NOT_LOGGED if motion.claimed_mps is None else number(motion.claimed_mps, 3, "m/s")
    pairs = [
        (
            "Velocity against position, RMS",
            number(motion.difference_rms_mps, 3, "m/s"),
            f"claimed σ: {claimed}; over {seconds_text(motion.seconds)}",
        )
    ]
    if motion.lag_s is not None:
        spread = number(motion.lag_sigma_s, 3, "s")
        pairs.append(("Velocity later than position by", number(motion.lag_s, 3, "s", signed=True), f"σ {spread}"))
        pairs.append(("Left without that delay, RMS", number(motion.left_rms_mps, 3, "m/s"), ""))
    if motion.lasting_rms_mps is not None:
        pairs.append(
            ("As means over 10 s, RMS", number(motion.lasting_rms_mps, 3, "m/s"), "without noise of the fixes")
        )
    too_sure = float(answer.settings.get("too_sure", 2.0))
    meaning = meaning_of(motion, too_sure)
    text = " ".join(filter(None, (with_full_stop(capitalised(meaning)), _position_behind_ins(one))))
    return [Facts(f"Velocity against position{_of(one, answer)}", pairs, text), Figure("gnss.steps", of=one.topic)]


def _losses(answer: GnssReception) -> Part | None:
    rows: list[tuple[str, FixLoss]] = [(one.topic, loss) for one in answer.receivers for loss in one.losses]
    if not rows:
        return None
    longest = sorted(sorted(rows, key=lambda row: -row[1].seconds)[:MOST_ROWS], key=lambda row: row[1].start_s)
    heads = (
        *(Head("Receiver"), Head("State"), Head("From"), Head("For", True)),
        *(Head("Speed before", True), Head("Speed after", True), Head("Moved", True)),
    )
    told = [
        (
            *(topic, name_of(loss.state), clock(loss.start_s), seconds_text(loss.seconds)),
            *(number(loss.speed_before_mps, 1, "m/s"), number(loss.speed_after_mps, 1, "m/s")),
            "—" if loss.moved_m is None else length_text(loss.moved_m),
        )
        for topic, loss in longest
    ]
    return Grid("Losses and gaps", heads, told, _most(len(rows), "longest"))


def _missing(answer: GnssReception, places: GnssMissing | None) -> Part | None:
    """Return the places of missing epochs, the longest of many; None without any."""
    if places is None:
        return None
    longest = np.sort(np.argsort(-places.epochs, kind="stable")[:MOST_ROWS]).tolist()
    told = [
        (
            *(str(places.topic[at]), clock(float(places.after_s[at])), clock(float(places.next_s[at]))),
            number(float(places.epochs[at]), 0),
        )
        for at in longest
    ]
    heads = (Head("Receiver"), Head("Last row before"), Head("Next row"), Head("Epochs", True))
    counts = "; ".join(f"{missing_of(one)} ({one.topic})" for one in answer.receivers if one.missed_epochs)
    caption = f"{with_full_stop(counts)} {_most(len(places.epochs), 'longest')}".strip()
    return Grid("Missing epochs", heads, told, caption, ("gnss_missing",))


def _jumps(answer: GnssReception) -> Part | None:
    rows: list[tuple[str, PositionJump]] = [(one.topic, jump) for one in answer.receivers for jump in one.jumps]
    if not rows:
        return None
    largest = sorted(sorted(rows, key=lambda row: -row[1].size_m)[:MOST_ROWS], key=lambda row: row[1].time_s)
    heads = (
        *(Head("Receiver"), Head("At"), Head("Size", True), Head("Along the motion", True)),
        *(Head("Up", True), Head("Fix"), Head("Time stamp off by", True)),
    )
    told = [
        (
            *(topic, clock(jump.time_s), length_text(jump.size_m)),
            *(_signed(jump.along_m), _signed(jump.up_m)),
            " → ".join(dict.fromkeys((name_of(jump.state_before), name_of(jump.state_after)))),
            number(jump.time_shift_s, 2, "s", signed=True),
        )
        for topic, jump in largest
    ]
    found = sum(one.jumps_found for one in answer.receivers)
    return Grid("Jumps of the position", heads, told, _most(found, "largest"))


def _signed(value: float | None) -> str:
    return number(value, 2, "m", signed=True)


def _most(count: int, which: str) -> str:
    return f"The {which} {MOST_ROWS} of {count}." if count > MOST_ROWS else ""


def _pair(pair: ReceiverPair) -> Facts:
    claimed = NOT_LOGGED if pair.claimed_m is None else length_text(pair.claimed_m)
    pairs: list[tuple[str, str, str]] = [
        (
            "Distance in the plane",
            length_text(pair.distance_m),
            f"scatter {length_text(pair.distance_scatter_m)}; claimed by both: {claimed}",
        )
    ]

    def add(label: str, value: Any, text: str, remark: str = "") -> None:
        if value is not None:
            pairs.append((label, text, remark))

    scatter = "" if pair.up_scatter_m is None else f"scatter {length_text(pair.up_scatter_m)}"
    add("Up", pair.up_m, number(pair.up_m, 2, "m", signed=True), scatter)
    difference = pair.velocity_difference_rms_mps
    add("Velocity difference, RMS", difference, number(difference, 3, "m/s"))
    add("Antenna forward", pair.forward_m, number(pair.forward_m, 2, "m", signed=True), "by the track")
    add("Antenna right", pair.right_m, number(pair.right_m, 2, "m", signed=True), "by the track")
    lag_text = number(pair.lag_s, 3, "s", signed=True)
    add("Later by", pair.lag_s, lag_text, f"σ {number(pair.lag_sigma_s, 3, 's')}")
    text = f"Both with a fix for {seconds_text(pair.seconds)}."
    return Facts(f"{pair.second} from {pair.first}", pairs, text)
