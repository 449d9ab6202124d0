"""Advice on what to inspect before the next flight.

It follows a lost attitude, a fall, or a check that failed.
"""

from collections.abc import Iterator

from groundstation.chapters.chapter import Advice
from groundstation.results.flight import FlightResults
from groundstation.systems.health.answer import FALL, AttitudeLoss, AutopilotHealth, Check
from groundstation.systems.health.chapter import with_signs

LOSS, FELL = "lost attitude", "fall"
SENSORS = {  # checks that, failed before the loss, are inspected too
    "magnetometer": "the compass and its wiring",
    "yaw": "the calibration of the compass, and what is magnetic near it",
    "imu": "the IMU and its mount",
    "vibration": "what shakes the IMU",
    "clipping": "what shakes the IMU",
    "gnss": "the GNSS antenna and receiver",
    "battery": "the battery and its connector",
    "link": "the remote control",
}


def advise(results: FlightResults) -> Iterator[Advice]:
    """Yield what to inspect; nothing where control was kept to the end of the log."""
    answer = results.answer(AutopilotHealth)
    if answer is None:
        return
    loss = answer.loss
    if loss is not None:
        yield Advice("Check", _driving(loss, is_rotorcraft=answer.cannot_taxi), LOSS, is_pressing=True, is_danger=True)
        for text in dict.fromkeys(_failed_before(answer, loss.start_s)):
            yield Advice("Check", text, LOSS, is_pressing=True, is_danger=True)
    elif any(one.grade == "fail" and one.text.startswith(FALL) for one in answer.happenings):
        text = "the battery, the power supply, motors and propellers"
        yield Advice("Check", text, FELL, is_pressing=True, is_danger=True)
    for setting in answer.settings_found:
        if setting.verdict == "warn" and setting.found is not None:
            told = f"{setting.stated:.3g} {setting.unit} set, {setting.found:.3g} {setting.unit} found"
            yield Advice("Check", f"the setting {setting.name} ({with_signs(told)})", "", is_pressing=True)
    if loss is None:
        failed = [one.key for one in answer.checks if one.key in SENSORS and _is_inspected(one)]
        for text in dict.fromkeys(SENSORS[key] for key in failed):
            yield Advice("Check", text, "", is_pressing=True)


def _is_inspected(check: Check) -> bool:
    """Tell whether a check asks for a look.

    It failed, or the yaw warns, which no pilot sees.
    """
    return check.verdict == "fail" or (check.key == "yaw" and check.is_bad)


def _driving(loss: AttitudeLoss, *, is_rotorcraft: bool) -> str:
    if loss.suspect is not None:
        return f"motor, ESC, propeller and connector of output {loss.suspect}"
    if loss.all_full:
        return "the take-off mass, the battery, and the thrust of all motors"
    if is_rotorcraft or loss.motors:
        return "motors, ESCs, propellers and connectors of all outputs"
    return "servos, linkages and control surfaces"


def _failed_before(answer: AutopilotHealth, lost_s: float) -> Iterator[str]:
    for one in answer.checks:
        begins_s = one.begins_s
        if one.verdict == "fail" and one.key in SENSORS and begins_s is not None and begins_s < lost_s:
            yield SENSORS[one.key]


def withheld(results: FlightResults) -> tuple[str, ...]:
    """Return the words of advice that this aircraft cannot follow: a multirotor does not taxi."""
    answer = results.answer(AutopilotHealth)
    return ("taxi",) if answer is not None and answer.cannot_taxi else ()
