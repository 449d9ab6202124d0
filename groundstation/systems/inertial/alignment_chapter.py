"""Chapter on alignment and shutdown: one table, and one of alignments between."""

from groundstation.chapters.assessed import without_answer
from groundstation.chapters.parts import Cell, Claim, Grid, Head, Mark, Note, Part, Rank, Section, kept
from groundstation.chapters.wording import ABSENT, clock, number, typeset
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.alignment_answer import (
    ErrorsAtStart,
    GroundResult,
    InsAlignment,
    InsRealignment,
    StandingDrift,
)
from groundstation.systems.inertial.claim_chapter import lead_of
from groundstation.systems.inertial.units_answer import Measured

TITLE = "Alignment and shutdown"
LEAD = (
    "The INS on the ground: how it was aligned, how it drifts while the aircraft stands, and what is left at the end."
)
KINDS = {
    "gyrocompass": "Gyrocompass",
    "stored_heading": "Stored heading",
    "in_motion": "In motion",
    "gnss_aided": "GNSS-aided",
    "unknown": "Not known",
}
BASES = {
    "stated": "to the start of navigation as stated",
    "mode": "by the logged mode",
    "still_output": "by velocities of exactly zero",
    "standstill": "",
    "none": "",
}
PLACES = {"standing": "on the ground, standing", "moving": "in motion", "unknown": "not known"}
Line = tuple[Cell, Cell, Cell]


def ground(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(GroundResult)
    if answer is None:
        return without_answer(results, "ins_ground", TITLE, LEAD)
    parts: tuple[Part | None, ...] = (*_remarks(answer), _table(answer), _realigned(answer.realignments))
    lead = lead_of(LEAD, answer.ins_topic, results)
    return Section("ins_ground", TITLE, lead, kept(parts), _headline(answer), claim=_claim(answer))


def _headline(answer: GroundResult) -> str:
    before, left = answer.alignment, answer.shutdown.residual_speed_mps
    kind = "Alignment not in the log" if before.kind == "unknown" and before.length_s is None else KINDS[before.kind]
    length = "" if before.length_s is None else f", {_length(before)}"
    end = "" if left is None else f"; {number(left.value, 2, 'm/s')} at shutdown"
    return f"{kind}{length}{end}"


def _claim(answer: GroundResult) -> Claim | None:
    """Return a tile where there is something to warn of."""
    moved = answer.alignment.is_moved and answer.alignment.kind != "in_motion"
    above = answer.standing is not None and answer.standing.is_above
    if not moved and not above:
        return None
    mark = Mark("warn", "Moved while aligning" if moved else "Drifts while standing")
    return Claim(Rank.OTHER, mark, _headline(answer), "", "", ())


def _length(before: InsAlignment) -> str:
    least = "at least " if before.is_cut else ""
    return f"{least}{clock(before.length_s)}"


def _remarks(answer: GroundResult) -> list[Note]:
    notes = []
    before, standing = answer.alignment, answer.standing
    if before.is_moved and before.kind != "in_motion":
        far = "" if before.moved_m is None else f" by up to {number(before.moved_m, 1, 'm')}"
        text = f"The aircraft moved{far} while the INS aligned, first at {clock(before.moved_at_s)}: tilt and azimuth "
        notes.append(Note(text + "at the start are doubtful.", "warn"))
    if standing is not None and standing.is_above:
        size, limit = standing.size_mps_per_min, standing.limit_mps_per_min
        text = (
            f"While the aircraft stands the ground speed drifts by {_measured(size, 3, 'm/s')} per minute; an honest "
        )
        notes.append(Note(f"{text}unit of the class {answer.ins_class} stays below {number(limit, 3)}.", "warn"))
    if answer.kind == "gnss_aided":
        text = (
            "GNSS corrects this INS: tilt, azimuth, drift while standing and a rate are not its own. Kind and length "
            "of the alignment, motion during it, and the ground speed shown while parked keep their meaning."
        )
        notes.append(Note(text, "unknown"))
    return notes


def _measured(value: Measured | None, places: int, unit: str = "") -> str:
    if value is None:
        return ABSENT
    tail = f" {unit}" if unit and unit != "°" else unit
    return f"{number(value.value, places)} ± {number(value.half95, places)}{tail}"


def _signed(value: Measured, places: int) -> str:
    return f"{number(value.value, places, signed=True)} ± {number(value.half95, places)}"


def _table(answer: GroundResult) -> Grid:
    lines: list[Line] = [
        *_alignment(answer.alignment),
        *_start(answer.at_start),
        _standing(answer.standing, answer.standing_reason),
        *_shutdown(answer),
    ]
    caption = (
        "± is half of the 95 % interval. Tilt: positive where the velocity error falls. Lengths of two axes (drift, "
        "speed, distance) carry the radius that holds 95 % of both."
    )
    return Grid("On the ground", (Head(""), Head("Found"), Head("How it is known")), lines, caption)


def _alignment(before: InsAlignment) -> list[Line]:
    length = ABSENT if before.length_s is None else _length(before)
    moved: Cell = Mark("unknown", "Not known")
    how = "no GNSS during the alignment" if before.length_s is not None else "the alignment is not in the log"
    if before.is_moved is not None:
        moved = Mark("good", "No") if not before.is_moved else Mark("warn", "Yes")
        how = "by GNSS"
        if before.is_moved:
            far = "" if before.moved_m is None else f", up to {number(before.moved_m, 1, 'm')}"
            how = f"by GNSS, from {clock(before.moved_at_s)}{far}"
    lines: list[Line] = [("Alignment", KINDS[before.kind], typeset(before.reason))]
    if before.length_s is not None:
        lines += [("Length", length, BASES[before.basis]), ("Moved during it", moved, how)]
    return lines


def _start(at_start: ErrorsAtStart | None) -> list[Line]:
    if at_start is None:
        return []
    north, east, azimuth = at_start.tilt_north_arcsec, at_start.tilt_east_arcsec, at_start.azimuth_deg
    tilt = ABSENT if north is None or east is None else f"{_signed(north, 1)} / {_signed(east, 1)} arcsec"
    turned = ABSENT if azimuth is None else f"{_signed(azimuth, 3)}°"
    return [
        ("Tilt at the start, north / east", tilt, typeset(at_start.tilt_reason)),
        ("Azimuth error at the start", turned, typeset(at_start.azimuth_reason)),
    ]


def _standing(standing: StandingDrift | None, why_not: str) -> Line:
    title = "Drift of ground speed while standing"
    if standing is None:
        return (title, ABSENT, why_not)
    text = _measured(standing.size_mps_per_min, 3, "m/s per min")
    how = f"from {clock(standing.start_s)} to {clock(standing.end_s)}"
    limit = standing.limit_mps_per_min
    if limit is None:
        return (title, text, f"{how}; not judged: nothing shows when navigation began")
    how = f"{how}; class stays below {number(limit, 3)}"
    return (title, Mark("warn", text) if standing.is_above else text, how)


def _shutdown(answer: GroundResult) -> list[Line]:
    end = answer.shutdown
    parked = "" if end.start_s is None else f"parked from {clock(end.start_s)}"
    how = "; ".join(filter(None, (parked, end.reason)))
    lines: list[Line] = [("Ground speed at shutdown", _measured(end.residual_speed_mps, 3, "m/s"), how)]
    if end.position_error_m is not None:
        what = "Distance from GNSS at the end" if answer.kind == "gnss_aided" else "Position error at the end"
        since = "after the last of the lines below" if answer.realignments else "after the start"
        hours = "" if end.hours is None else f", {number(end.hours, 2, 'h')} {since}"
        at = f"at {clock(end.position_at_s)}{hours}"
        lines.append((what, _measured(end.position_error_m, 1, "m"), at))
    if end.terminal_rate_nmiph is not None:
        rate = _measured(end.terminal_rate_nmiph, 2, "nmi/h")
        lines.append(("Terminal error rate", rate, "position error at the end over the hours"))
    return lines


def _realigned(realignments: tuple[InsRealignment, ...]) -> Grid | None:
    if not realignments:
        return None
    heads = (
        *(Head("Flight time"), Head(""), Head("Where")),
        *(Head(title, True) for title in ("Position step, m", "Velocity step, m/s", "Heading step, °")),
        *(Head(title, True) for title in ("Rate before, nmi/h", "after")),
    )
    caption = "After less before, of position and velocity the length. Rates by fit over ten minutes or more."
    return Grid("Aligned or set again", heads, [_row(one) for one in realignments], caption)


def _row(one: InsRealignment) -> tuple[Cell, ...]:
    span = clock(one.start_s) if one.end_s <= one.start_s else f"{clock(one.start_s)} – {clock(one.end_s)}"
    return (
        span,
        "aligned" if one.is_aligned else "position set",
        PLACES[one.place],
        _measured(one.position_step_m, 1),
        _measured(one.velocity_step_mps, 3),
        ABSENT if one.heading_step_deg is None else _signed(one.heading_step_deg, 2),
        number(one.rate_before_nmiph, 2),
        number(one.rate_after_nmiph, 2),
    )
