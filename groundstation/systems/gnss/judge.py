"""Grade of the reception, its reasons, and the findings."""

from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding, Severity
from groundstation.base.words import counted
from groundstation.systems.gnss.answer import (
    WITHOUT_FIX,
    WITHOUT_RECORD,
    FixLoss,
    GnssReceiver,
    Grade,
    ReceiverPair,
    StandstillScatter,
)
from groundstation.systems.gnss.series import ReceiverRows
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.systems.gnss.wording_answer import (
    LATE_S,
    gaps_text,
    length_text,
    memory_of,
    name_of,
    never_had,
    same_claims,
    seconds_text,
    share_text,
)

GRADES: tuple[Grade, ...] = ("unknown", "good", "warn", "bad")
APART_SIGMAS = 3.0  # times the claimed sigma that the distance of two antennas may scatter


@dataclass(frozen=True)
class Judged:
    """Reason with its grade and the finding it becomes; grade ``good`` is worth a line alone."""

    grade: Grade
    text: str
    code: str
    topic: str
    place: str = ""
    count: int | None = None

    @property
    def finding(self) -> Finding:
        """The finding."""
        severity: Severity = "info" if self.grade == "good" else "warn"
        return Finding(severity, f"gnss.{self.code}", self.text, self.topic, self.place, self.count)


def judge(one: GnssReceiver, rows: ReceiverRows, settings: GnssSettings, is_main: bool) -> list[Judged]:
    """Judge one receiver; what another one lacks is at most a warning."""
    if one.first_fix_s is None:
        return [Judged("bad" if is_main else "warn", never_had(one), "never_a_fix", one.topic)]
    found = [*_fix(one, settings), *_geometry(one, rows, settings), *_claims(one, settings), *_motion(one, settings)]
    return found if is_main else [replace(judged, grade=_at_most_warn(judged.grade)) for judged in found]


def _at_most_warn(grade: Grade) -> Grade:
    return "warn" if grade == "bad" else grade


def _fix(one: GnssReceiver, settings: GnssSettings) -> list[Judged]:
    found = []
    assert one.first_fix_s is not None
    waited_s = one.first_fix_s - one.start_s
    if waited_s > settings.first_fix_warn_s:
        found.append(Judged("warn", f"first fix after {seconds_text(waited_s)}", "late_first_fix", one.topic))
    found += [*_lost(one, settings), *_silent(one, settings)]
    if one.placeless_rows:
        count = counted(one.placeless_rows, "row claims", "rows claim")
        text = f"{count} a fix without a place and a velocity: counted as no fix"
        found.append(Judged("warn", text, "no_place", one.topic, count=one.placeless_rows))
    doubted = one.share("integrity_lost")
    if doubted > settings.geometry_share_warn:
        text = f"the receiver does not vouch for its fix {share_text(doubted)} of the time"
        found.append(Judged("warn", text, "integrity", one.topic))
    flat = one.share("2d")
    if flat > settings.geometry_share_warn:
        found.append(Judged("warn", f"only 2D {share_text(flat)} of the time: no height", "two_dimensions", one.topic))
    fixed = one.share("rtk_fixed")
    short = 1.0 - one.share_after_first_fix("rtk_fixed")
    if fixed > 0.0 and short > settings.rtk_lost_share_warn:
        float_share = one.share_after_first_fix("rtk_float")
        text = f"RTK not fixed {share_text(short)} of the time" + (
            f", of which float {share_text(float_share)}" if 0.0 < float_share < short - 0.005 else ""
        )
        found.append(Judged("warn", text, "rtk_not_fixed", one.topic))
    if one.age_of_corrections_high_s is not None and one.age_of_corrections_high_s > settings.age_warn_s:
        text = f"corrections up to {one.age_of_corrections_high_s:.0f} s old"
        found.append(Judged("warn", text, "old_corrections", one.topic))
    return found


def _lost(one: GnssReceiver, settings: GnssSettings) -> list[Judged]:
    losses = [loss for loss in one.losses if loss.state in WITHOUT_FIX]
    share = one.share_after_first_fix(*WITHOUT_FIX) if one.lost_s > 0.0 else 0.0
    share = min(share, one.lost_s / max(one.end_s - (one.first_fix_s or 0.0) - one.not_logged_s, 1e-9))
    if not losses and share <= settings.lost_share_warn:
        return []
    grade: Grade = "bad" if share > settings.lost_share_bad else "warn" if share > settings.lost_share_warn else "good"
    times = f"{len(losses)} times" if losses else f"for no longer than {seconds_text(settings.loss_min_s)} each time"
    text = f"fix lost {times}, {seconds_text(one.lost_s)} in all ({share_text(share)} of the time)"
    if len(losses) == 1:
        text = f"{name_of(losses[0].state)} for {seconds_text(losses[0].seconds)}{_speed(losses[0])}"
    place = f"at {losses[0].start_s:.1f} s" if losses else ""
    return [Judged(grade, text, "lost", one.topic, place, len(losses))]


def _silent(one: GnssReceiver, settings: GnssSettings) -> list[Judged]:
    """Judge gaps of the receiver's rows.

    Where the whole log is silent they are not the receiver's, and are told as the others of all its gaps.
    """
    every = [loss for loss in one.losses if loss.state in WITHOUT_RECORD]
    gaps = [loss for loss in every if loss.state == "no_record"]
    if not gaps:
        return []
    seconds = sum(loss.seconds for loss in gaps)
    share = seconds / max(one.end_s - one.start_s - one.not_logged_s, 1e-9)
    longest = max(gaps, key=lambda loss: loss.seconds)
    text = gaps_text([loss.seconds for loss in gaps]) + (_speed(longest) if len(gaps) == 1 else "")
    if len(gaps) < len(every):
        text = f"{len(gaps)} of {len(every)} gaps while other sensors have rows, {seconds_text(seconds)} together"
    grade: Grade = "warn" if share > settings.lost_share_warn else "good"
    return [Judged(grade, text, "silent", one.topic, f"at {longest.start_s:.1f} s", len(gaps))]


def _speed(loss: FixLoss) -> str:
    return "" if loss.speed_before_mps is None else f", at {loss.speed_before_mps:.1f} m/s before"


def _geometry(one: GnssReceiver, rows: ReceiverRows, settings: GnssSettings) -> list[Judged]:
    found = []
    limits = (
        ("satellites_used", "satellites", -1.0, settings.satellites_warn, settings.satellites_bad),
        ("hdop", "HDOP", 1.0, settings.hdop_warn, settings.hdop_bad),
    )
    for name, word, sign, warn, bad in limits:
        if getattr(one, name) is None:
            continue
        values = rows.values(name)
        known = np.isfinite(values)
        whole_s = float(rows.held_s[known].sum())
        when = "of the time" if rows.has_fix.all() else "of the time with a fix"
        for grade, limit, most in _limits(settings, warn, bad):
            beyond = known & (sign * values > sign * limit)
            share = float(rows.held_s[beyond].sum()) / whole_s if whole_s > 0.0 else float(beyond.any())
            if share > most:
                side = "fewer than" if sign < 0.0 else "above"
                text = (
                    f"{side} {limit:g} {word} {share_text(share)} {when}"
                    if sign < 0.0
                    else f"{word} {side} {limit:g} {share_text(share)} {when}"
                )
                at_s = float(rows.time_s[np.argmax(beyond)])
                found.append(Judged(grade, text, f"{name}_beyond", one.topic, f"at {at_s:.1f} s"))
                break
    return found


def _limits(settings: GnssSettings, warn: float, bad: float) -> tuple[tuple[Grade, float, float], ...]:
    """Return grades with their limits, and the shares of time beyond them that they take."""
    return (
        ("bad", bad, settings.geometry_share_bad),
        ("warn", bad, settings.geometry_share_warn),
        ("warn", warn, settings.geometry_share_warn),
    )


def _claims(one: GnssReceiver, settings: GnssSettings) -> list[Judged]:
    found = []
    for stood in one.standstills:
        kind = f"while {name_of(stood.state)}, " if len(one.standstills) > 1 else ""
        found += [replace(judged, text=kind + judged.text) for judged in _claims_at(stood, one.topic, settings)]
    same = same_claims(one)
    return [*found, *([Judged("good", same, "same_claim", one.topic)] if same else [])]


def _claims_at(stood: StandstillScatter, topic: str, settings: GnssSettings) -> list[Judged]:
    place = f"at {stood.start_s:.1f} s"
    if stood.is_held or stood.is_coarse:
        return [Judged("good", memory_of(stood), "held", topic, place)]
    found = []
    for scatter, claimed, what in (
        (stood.scatter_m, stood.claimed_m, "position"),
        (stood.up_scatter_m, stood.up_claimed_m, "height"),
    ):
        if scatter is not None and claimed is not None and claimed > 0.0 and scatter > settings.too_sure * claimed:
            text = f"{what} scatters by {length_text(scatter)} at standstill where {length_text(claimed)} is claimed"
            found.append(Judged("warn", text, "too_sure", topic, place))
    speed, claimed = stood.speed_rms_mps, stood.claimed_mps
    if speed is not None and claimed is not None and claimed > 0.0 and speed > settings.too_sure * claimed:
        text = f"shows {speed:.2f} m/s RMS at standstill where {claimed:.2f} m/s is claimed"
        found.append(Judged("warn", text, "too_sure", topic, place))
    return found


def _motion(one: GnssReceiver, settings: GnssSettings) -> list[Judged]:
    found = []
    apart_mps = None if one.motion is None else one.motion.lasting_rms_mps
    if apart_mps is not None and apart_mps > settings.velocity_apart_mps:
        text = f"velocity and position tell different motions: they differ by {apart_mps:.1f} m/s RMS over 10 s"
        found.append(Judged("warn", text, "velocity_apart", one.topic))
    if one.jumps_found:
        largest = max(one.jumps, key=lambda jump: jump.size_m)
        times = "once" if one.jumps_found == 1 else f"{one.jumps_found} times"
        text = f"position jumps {times}, by up to {length_text(largest.size_m)}"
        if largest.time_shift_s is not None:
            text += f" along the motion: as a time stamp off by {abs(largest.time_shift_s):.2f} s would"
        elif largest.state_before != largest.state_after:
            text += f" as {name_of(largest.state_before)} becomes {name_of(largest.state_after)}"
        # a solution that becomes a better one may step
        grade: Grade = "good" if all(jump.state_before != jump.state_after for jump in one.jumps) else "warn"
        found.append(Judged(grade, text, "jump", one.topic, f"at {largest.time_s:.1f} s", one.jumps_found))
    lag_s = None if one.motion is None else one.motion.lag_s
    if lag_s is not None and abs(lag_s) > LATE_S:
        sense = "later" if lag_s > 0.0 else "earlier"
        found.append(Judged("good", f"velocity {abs(lag_s):.2f} s {sense} than position", "velocity_lag", one.topic))
    return found


def judge_pair(pair: ReceiverPair) -> list[Judged]:
    """Judge two receivers against each other: the distance of two antennas is constant."""
    told = f"{pair.second} from {pair.first}: {length_text(pair.distance_m)}"
    claimed = pair.claimed_m
    if claimed is not None and claimed > 0.0 and pair.distance_scatter_m > APART_SIGMAS * claimed:
        text = f"{told}, scattering by {length_text(pair.distance_scatter_m)} where {length_text(claimed)} is claimed"
        return [Judged("warn", text, "receivers_differ", pair.second)]
    return [Judged("good", f"{told} apart, ± {length_text(pair.distance_scatter_m)}", "second_receiver", pair.second)]


def worst_of(judged: list[Judged], main: GnssReceiver) -> Grade:
    """Return the worst grade.

    Unknown where nothing is wrong and nothing that would tell is logged.
    """
    grades: list[Grade] = ["good", *(one.grade for one in judged)]
    worst = max(grades, key=GRADES.index)
    told = (main.satellites_used, main.hdop, main.pdop, main.horizontal_sigma_m, main.velocity_sigma_mps)
    return (
        "unknown" if worst == "good" and not main.is_kind_logged and not any(one is not None for one in told) else worst
    )
