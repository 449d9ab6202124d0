"""Advice for the next flight with a compass: heading alone, or a magnetometer."""

from collections.abc import Iterator

from groundstation.base.signals import is_canonical, kind_of
from groundstation.chapters.assessed import reason_of
from groundstation.chapters.chapter import Advice, Remedies
from groundstation.results.flight import FlightResults
from groundstation.systems.magnetic.flux_answer import FluxDeviation

DEVIATION, COMPASS = "magnetic deviation", "compass"
EIGHT_LEGS = "straight legs of half a minute on eight headings round the circle"
NO_SENSOR = "no three-axis magnetometer"
# By a part of the reason for which the compass could not be judged.
REMEDIES: Remedies = (
    ("no straight leg in flight", ("Fly", EIGHT_LEGS)),
    ("deg, do not show", ("Fly", EIGHT_LEGS)),
    (
        "no true heading to compare with",
        ("Record", "a true heading with no compass in it, or true airspeed beside GNSS velocity"),
    ),
)
BY_GATE = {
    "turns": Advice("Fly", "a turn of more than 3° of bank between straight legs", COMPASS),
    "gap": Advice("Fly", EIGHT_LEGS, COMPASS),
    "curve": Advice("Fly", "every heading twice, a minute each", COMPASS),
    "left": Advice("Check", "what changes the compass from leg to leg: loads, currents", COMPASS),
}
BY_WIND = Advice("Record", "a true heading with no compass in it", COMPASS)
BY_HEADING = Advice("Check", "true heading and declination", COMPASS)


def has_compass(results: FlightResults) -> bool:
    """Tell whether the log holds values of a compass: a field, or a magnetic heading."""
    return any(
        one.fields[name].present
        for topic, one in results.ledger.topics.items()
        for name in one.fields
        if kind_of(topic) == "magnetometer" or (is_canonical(topic) and name == "magnetic_heading_deg")
    )


def advise(results: FlightResults) -> Iterator[Advice]:
    """Yield what would better the answer on the compass, or give the one of a magnetometer.

    A log with a compass that gives heading alone needs no magnetometer: its legs are judged. Nor does one without any
    compass: there is no deviation to find.
    """
    answer = results.answer(FluxDeviation)
    if answer is None:
        is_asked = NO_SENSOR in reason_of(results, "magnetic") and not reason_of(results, FluxDeviation.analysis)
        if is_asked and has_compass(results):
            yield Advice("Record", "a three-axis magnetometer", DEVIATION)
        return
    for gate in answer.gates:
        if not gate.required or gate.state == "passed":
            continue
        if gate.name == "level":
            yield BY_WIND if answer.reference.name == "wind" else BY_HEADING
        elif gate.name in BY_GATE:
            yield BY_GATE[gate.name]
