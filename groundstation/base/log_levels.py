"""Grade of logged text: by its level where it has one, else by its words.

Levels are those of syslog, as MAVLink (MAV_SEVERITY) and ULog have them: 0 emergency to 7 debug.
"""

import re

from groundstation.base.findings import Severity

NAMES = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")
ERROR, WARNING = 3, 4
_IS_OVER = re.compile(
    r"\b(?:cleared?|off|over|recovered|resolved|regained|restored|ended|deactivated|disabled|reset ok)\b", re.I
)
_BEFORE_FLIGHT = re.compile(r"^\s*(?:pre-?arm|arm(?:ing)?)\b", re.I)
_GRAVE = re.compile(
    r"fail-?\s?safe|\bcrash|emergency|terminat|\blost\b|\bloss\b|internal error|brown-?out|parachute\W+released|"
    r"ekf variance|watchdog|motor fail|engine fail",
    re.I,
)
_LIGHT = re.compile(
    r"\berr(?:or)?s?\b|fail|\bbad\b|unhealthy|not healthy|glitch|variance|lane switch|stopped aiding|time-?out|"
    r"\blow\b.*\b(?:battery|voltage)|battery\b.*\b(?:low|critical)|denied|reject|refus|invalid|inconsistent|warning|"
    r"\bneeds? (?:accel|compass|rc|3d)|not (?:available|ready|found|calibrated|responding)|"
    r"switch(?:ed|ing) to (?:lane|imu|gps|primary)|"
    r"\bno (?:gps|rc|ekf|sd|compass|ahrs|gyro|accel)\b|disconnect|yaw re-?(?:set|align)|exceed|dangerous",
    re.I,
)


def severity_of_text(text: str) -> Severity:
    """Grade a text without a level by its words.

    A failsafe is never information, unless the text says that it is over. A refusal to arm is a warning at most.

    Examples
    --------
    >>> severity_of_text("Throttle failsafe on"), severity_of_text("Throttle failsafe off")
    ('fail', 'info')
    >>> severity_of_text("PreArm: Failsafe on"), severity_of_text("ArduPlane V4.2.3")
    ('warn', 'info')
    """
    if _BEFORE_FLIGHT.match(text):
        return "info" if text.rstrip(" .!").lower().endswith(("good", "passed")) else "warn"
    if _IS_OVER.search(text):
        return "info"
    if _GRAVE.search(text):
        return "fail"
    return "warn" if _LIGHT.search(text) else "info"


def severity_of_level(level: int | str, text: str = "") -> Severity:
    """Grade a text by its level, 0 to 7 or its name: error and worse fail, warning warns.

    A text that speaks of a failsafe in a lower level is a warning still; a refusal to arm is never more.

    Examples
    --------
    >>> severity_of_level(2, "Crash"), severity_of_level("warning"), severity_of_level(6, "Failsafe activated")
    ('fail', 'warn', 'warn')
    """
    number = level if isinstance(level, int) else _number(level)
    if number is None:
        return severity_of_text(text)
    if number <= ERROR:
        return "warn" if _BEFORE_FLIGHT.match(text) else "fail"
    if number == WARNING:
        return "warn"
    return "warn" if _GRAVE.search(text) and not _IS_OVER.search(text) else "info"


def _number(name: str) -> int | None:
    word = name.strip().lower()
    return NAMES.index(word) if word in NAMES else None
