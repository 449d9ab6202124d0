"""The flight in one sentence, as a person would say it.

GNSS good, filter healthy, vibration high 12:03-12:39.
"""

import re
from collections.abc import Mapping, Sequence

from groundstation.base.words import capitalised, clock_text, listed, tenths_text
from groundstation.systems.health.answer import (
    FIRST,
    IN_TENTHS_S,
    LOST,
    AttitudeLoss,
    Check,
    gravity,
    span_words,
)

MOST_BAD = 4
BEGINS = "first: "
MORE = re.compile(r"(?: \(\d+ times\))?(?: and \d+ more)?$")  # behind the first text of a reason
APART_S = 0.05  # failures that begin nearer have no order
THROUGHOUT, OF_THE_TIME = " throughout", " % of the time"
MOSTLY = 0.8  # of the time: a longer span needs no times
CAUTION, BLANK = "caution", "logged without values"
WHOLE = 0.995  # of the time: "throughout", which a share told as 99 % is not
QUOTED = ("faults", "battery", "gnss", "link")  # checks of which what was said is quoted
LONGEST = 50  # characters of a message that the sentence quotes
NAMES: Mapping[str, str] = {"gnss": "GNSS", "innovations": "filter", "vibration": "vibration"}
GOOD: Mapping[str, str] = {"gnss": "GNSS good", "innovations": "filter healthy", "vibration": "vibration low"}
WARN: Mapping[str, str] = {
    "gnss": "GNSS weak",
    "interference": "GNSS disturbed",
    "innovations": "filter doubts its sensors",
    "resets": "filter reset",
    "switches": "sensor or estimator switched",
    "vibration": "vibration raised",
    "clipping": "accelerometer clipped",
    "imu": "IMU doubtful",
    "magnetometer": "magnetic field changes",
    "yaw": "yaw off the compass",
    "faults": "warnings logged",
    "timing": "timing or log with losses",
    "battery": "battery low",
    "link": "link lost",
    "tracking": "setpoints followed poorly",
    "saturation": "actuators at their limit",
    "settings": "settings differ from what was found",
}
OF_QUANTITY: Mapping[str, str] = {  # what a person says where this quantity decided
    LOST: "control of attitude lost",
    "attitude_difference_deg": "estimators disagree",
    "position_difference_m": "estimators disagree",
    "output_angle_rad": "output predictor off",
    "output_velocity_mps": "output predictor off",
    "output_position_m": "output predictor off",
    "dropouts_ms": "log with gaps",
    "cpu_load": "CPU overloaded",
    "slow_loops": "loops too slow",
    "not_the_one_set": "another estimator in use than the one set",
    "radio_margin_db": "radio weak",
    "packets_lost": "telemetry with losses",
    "time_slip_s": "filter's clock slipped",
    "supply_v": "supply of the board off",
    "supply_swing_v": "supply of the board swings",
    "compass_offset": "compass offsets too large",
    "rc_lost": "remote control lost",
    "data_link_lost": "data link lost",
    "gyro_bias_radps": "gyro bias large",
    "accel_bias_mps2": "accelerometer bias large",
    "gyro_difference_radps": "gyros disagree",
    "accel_difference_mps2": "accelerometers disagree",
    "sensor_errors": "sensor errors counted",
}
FAIL: Mapping[str, str] = {
    **WARN,
    "gnss": "GNSS bad",
    "interference": "GNSS jammed or spoofed",
    "innovations": "filter rejects its sensors",
    "vibration": "vibration high",
    "imu": "IMU bad",
    "magnetometer": "magnetic field wrong",
    "faults": "faults logged",
    "battery": "battery critical",
    "tracking": "setpoints not followed",
}


def told(checks: Sequence[Check], loss: AttitudeLoss | None = None, not_flown: str = "") -> str:
    """Return the sentence.

    That it did not fly, where a flag says so; what fails, in order of time where it has times; what warns; then what
    of GNSS, filter and vibration is good, and what is not logged.
    """
    bad = sorted((one for one in checks if one.is_bad), key=gravity)
    parts = _by_time(bad[:MOST_BAD], loss)
    if len(bad) > MOST_BAD:
        parts.append(f"and {len(bad) - MOST_BAD} more")
    groups = (["did not fly"] if not_flown else [], parts, _of_the_first(checks))
    shown = "; ".join(", ".join(filter(None, group)) for group in groups if any(group))
    return capitalised(shown)


def told_apart(checks: Sequence[Check], loss: AttitudeLoss | None = None) -> tuple[str, tuple[str, ...]]:
    """Return what failed first, and when, and the rest of the sentence in parts.

    Before the first stands one that lasted throughout. The rest is all else that is bad, then what is good. Without a
    failure the first is what warns, else what is good.
    """
    bad = sorted((one for one in checks if one.is_bad), key=gravity)
    parts = [part for part in _by_time(bad, loss) if part]
    good = ", ".join(_of_the_first(checks))
    failed = [one for one in bad if one.verdict == "fail"]
    timed = [one for one in failed if _is_timed(one)]
    first_s = min((one.begins_s or 0.0 for one in timed), default=0.0)
    first = [_part(one, loss) for one in timed if (one.begins_s or 0.0) - first_s < APART_S][:1]
    first = [part for part in parts if part.startswith(BEGINS)] or first
    lasting = [_part(one) for one in failed if one not in timed][:1]
    head = [part for part in (*lasting, *first) if part] or parts[:1]
    rest = [part for part in parts if part not in head] + ([good] if good and head else [])
    return capitalised("; ".join(head) or good), tuple(map(capitalised, rest))


def _of_the_first(checks: Sequence[Check]) -> list[str]:
    """Return what is good of GNSS, filter and vibration, and what of them is not logged."""
    known = {one.key: one for one in checks}
    first = [known[key] for key in FIRST if key in known]
    good = [_part(one) for one in first if one.verdict == "pass"]
    unlogged = [one for one in first if one.verdict == "not_logged"]
    blank = [NAMES[one.key] for one in unlogged if one.is_blank]
    absent = [NAMES[one.key] for one in unlogged if not one.is_blank]
    missing = [f"{listed(names)} {what}" for names, what in ((blank, BLANK), (absent, "not logged")) if names]
    return [*filter(None, good), *missing]


def _by_time(bad: Sequence[Check], loss: AttitudeLoss | None) -> list[str]:
    """Return what is told of the bad checks.

    The first of several failures is named as first, the others as later; those throughout the flight have no order.
    """
    failed = [one for one in bad if one.verdict == "fail" and _is_timed(one)]
    failed.sort(key=lambda one: one.begins_s or 0.0)
    begins = [one.begins_s or 0.0 for one in failed]
    if len(failed) < 2 or begins[1] - begins[0] < APART_S:
        return [_part(one, loss) for one in bad]
    timed = [_part(one, loss, in_tenths=begins[-1] - begins[0] < IN_TENTHS_S) for one in failed]
    others = [one for one in bad if one not in failed]
    before = [_part(one) for one in others if one.verdict == "fail"]
    after = [_part(one) for one in others if one.verdict != "fail"]
    return [*before, f"{BEGINS}{timed[0]}", f"then {timed[1]}", *timed[2:], *after]


def _part(check: Check, loss: AttitudeLoss | None = None, *, in_tenths: bool = False) -> str:
    if check.verdict == "pass":
        return GOOD.get(check.key, "")
    if not check.is_bad:
        return ""
    special = _special(check)
    if special.endswith("fix"):
        return special
    words = f"{special or (FAIL if check.verdict == 'fail' else WARN)[check.key]}{when(check, in_tenths=in_tenths)}"
    is_lost = check.decisive is not None and check.decisive.quantity == LOST
    if is_lost and loss is not None and loss.suspect is not None:
        return f"{words} with output {loss.suspect} suspect (motor, ESC or propeller)"
    return words


def _special(check: Check) -> str:
    """Return what a person would say of this one, where it is more than the general word."""
    if check.key == "gnss":
        fix = next((one for one in check.measures if one.quantity == "fix_type"), None)
        if fix is not None and fix.red_share == 1.0:
            return "GNSS never had a fix"
    if check.key in QUOTED and check.first_event_s is not None:
        first = MORE.sub("", check.reason.partition("; ")[0])
        if len(first) <= LONGEST:
            return f"“{first}”"
    measure = check.decisive
    if measure is not None and measure.quantity in OF_QUANTITY:
        return OF_QUANTITY[measure.quantity]
    if measure is not None and measure.quantity == CAUTION:
        return measure.sensor  # "gyro unhealthy"
    if measure is not None and measure.quantity.endswith("_unused"):
        beside = {"innovations": "doubts its sensors", "resets": "went its own way"}.get(check.key, "is in doubt")
        return f"a filter not in use {beside}"
    return ""


def _is_timed(check: Check) -> bool:
    """Tell whether a check has an order in time: not where it is bad all of the time, or most."""
    told_when = when(check)
    return bool(told_when) and not told_when.endswith((THROUGHOUT, OF_THE_TIME))


def when(check: Check, *, in_tenths: bool = False) -> str:
    """Return the worst span or the first event of a check: `` 12:03-12:39``.

    A span shorter than ten seconds is told in tenths. What is bad most of the time is told by its share.
    """
    measure = check.decisive
    if check.first_event_s is not None:
        return f" at {(tenths_text if in_tenths else clock_text)(check.first_event_s)}"
    if measure is None or measure.span_start_s is None or measure.span_end_s is None:
        return ""
    share = measure.red_share if check.verdict == "fail" and measure.red_share else measure.amber_share
    if share is not None and share > MOSTLY:
        return THROUGHOUT if share >= WHOLE else f" {100.0 * share:.0f}{OF_THE_TIME}"
    start, end = span_words(measure.span_start_s, measure.span_end_s)
    return f" at {start}" if start == end else f" {start}-{end}"
