"""Verdict on a reference: whether it may judge at all, and what a user must know of it.

It may stand at another place, use another datum or clock, or be too coarse.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.signals import kind_of
from groundstation.systems.reference.answer import ErrorRow, ReferenceResult, title_of
from groundstation.systems.reference.errors import Errors
from groundstation.systems.reference.settings import ReferenceSettings

CONSTANT = 0.1  # spread over length of an offset that passes for another datum
DATUM_M = {"horizontal": 30.0, "vertical": 5.0}  # a shorter constant offset is an arm, or ionosphere
SAME_M, SAME_SHARE = 0.005, 0.2  # of its sigma: a reference so near to the receiver is its own solution
INS_FARTHER = 50.0  # an INS that drifts may be so many times farther off than GNSS
LEAP_SECONDS = range(13, 20)


@dataclass(frozen=True)
class Standing:
    """Decision whether the reference may judge, with the reason when not."""

    is_judge: bool
    reason: str = ""


def standing_of(
    listed: Sequence[Errors], rows: Sequence[ErrorRow], gross_s: float, settings: ReferenceSettings
) -> Standing:
    """Decide whether a reference may judge, and why not."""
    subjects = [errors.subject for errors in listed]
    first = [next((one for one in subjects if kind_of(one) == kind), "") for kind in ("gnss", "ins")]
    for errors in listed:
        distance = errors.horizontal_m[np.isfinite(errors.horizontal_m)]
        farthest = settings.far_m * (1.0 if kind_of(errors.subject) == "gnss" else INS_FARTHER)
        if distance.size and float(np.median(distance)) > farthest and errors.subject in first:
            return Standing(False, f"it is {np.median(distance) / 1000.0:.1f} km away: another vehicle or place")
    if gross_s:
        return Standing(False, f"its clock is {abs(gross_s):.1f} s {'fast' if gross_s < 0 else 'slow'} by motion")
    twin = next((row for row in rows if _is_own_solution(row)), None)
    if twin is not None:
        away = f"{1000.0 * twin.spread.rmse:.1f} mm RMS from it"
        return Standing(False, f"it is the solution of {twin.subject} itself ({away}), not an independent one")
    if rows and all(row.is_coarse for row in rows):
        return Standing(False, "its own sigmas are as large as the errors found: the log is no worse than it")
    return Standing(True)


def _is_own_solution(row: ErrorRow) -> bool:
    """Tell whether the reference repeats what a receiver logged.

    It does when it is nearer to the receiver than its own sigma allows.
    """
    if (kind_of(row.subject), row.quantity, row.axis) != ("gnss", "position", "horizontal"):
        return False
    return row.spread.rmse < max(SAME_M, SAME_SHARE * (row.reference_sigma or 0.0))


def findings_of(answer: ReferenceResult, gross_s: float, interval_s: float) -> tuple[Finding, ...]:
    """Return what a user must know of the reference and of the claims that it contradicts."""
    return (*_of_reference(answer, gross_s, interval_s), *_of_claims(answer))


def _of_reference(answer: ReferenceResult, gross_s: float, interval_s: float) -> Iterator[Finding]:
    if not answer.is_judge:
        yield Finding(
            "warn", "reference.judges_nothing", f"{answer.reference} judges nothing: {answer.reason}", "truth"
        )
    if gross_s:
        guess = " (leap seconds: GPS time taken for UTC?)" if round(abs(gross_s)) in LEAP_SECONDS else ""
        text = (
            f"the log shows the motion {abs(gross_s):.2f} s {_sense(gross_s)} than the reference{guess}; "
            f"[reference] clock_offset_s = {gross_s:.2f} corrects it"
        )
        yield Finding("warn", "reference.clock", text, "truth")
        return
    for row in answer.placed:
        if row.clock_offset95_s is not None and row.clock_offset_s is not None:
            low, high = row.clock_offset95_s
            if low > interval_s or high < -interval_s:
                text = (
                    f"{row.subject} shows its positions {abs(row.clock_offset_s):.3f} s {_sense(row.clock_offset_s)} "
                    "than the reference "
                    f"(95 %: {low:+.3f} to {high:+.3f} s), which has a sample every {interval_s:.3g} s: a latency, or "
                    "a clock that is off; the errors include it"
                )
                yield Finding("warn", "reference.clock", text, row.subject)
    yield from _datum(answer)


def _sense(offset_s: float) -> str:
    return "later" if offset_s > 0.0 else "earlier"


def _datum(answer: ReferenceResult) -> Iterator[Finding]:
    gnss = [row for row in answer.errors if row.quantity == "position" and kind_of(row.subject) == "gnss"]
    for row in gnss:
        size = abs(row.spread.mean)
        if size > DATUM_M.get(row.axis, np.inf) and row.spread.std < CONSTANT * size:
            hint = (
                "another datum? SK-42 lies some 100 m from WGS-84"
                if row.axis == "horizontal"
                else "height above sea level taken for one above the ellipsoid?"
            )
            text = f"{row.subject} is {size:.0f} m from the reference all the time, {row.axis}: {hint}"
            yield Finding("warn", "reference.constant_offset", text, row.subject)


def _of_claims(answer: ReferenceResult) -> Iterator[Finding]:
    if not answer.is_judge:
        return
    for row in answer.claims:
        if row.state == "too_sure":
            text = (
                f"{title_of(row.subject)}, {row.quantity} {row.axis}: {row.share_inside95:.0%} of the errors inside "
                "the 95 % claimed"
            )
            yield Finding("warn", "reference.too_sure", text, row.subject)
    for check in answer.headings:
        if not check.is_inside:
            text = (
                f"heading error found {check.claimed_deg:+.2f} deg, by the reference {check.seen_deg:+.2f} deg: not "
                "within the intervals of both"
            )
            yield Finding("warn", "reference.heading", text, check.ins_topic)
