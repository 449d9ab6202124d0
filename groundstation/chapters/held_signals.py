"""Signals that advice asks to record, held against what the log has already."""

from collections.abc import Mapping

from groundstation.base.signals import is_canonical, kind_of
from groundstation.chapters.chapter import Advice
from groundstation.results.flight import FlightResults

Signals = tuple[str, ...]  # each "kind of topic.field"; together they are one way to have what is asked for
_GNSS_PLACE: Signals = ("gnss.latitude_deg", "gnss.longitude_deg")
_INS_PLACE: Signals = ("ins.latitude_deg", "ins.longitude_deg")
_GNSS_MOTION: tuple[Signals, ...] = (
    ("gnss.velocity_north_mps", "gnss.velocity_east_mps"),
    ("gnss.track_deg", "gnss.ground_speed_mps"),
)
# By the text of the advice: any of the ways to have it.
ASKED: Mapping[str, tuple[Signals, ...]] = {
    "weight on wheels": (("discrete.weight_on_wheels",),),
    "GNSS velocity": _GNSS_MOTION,
    "GNSS position": (_GNSS_PLACE,),
    "INS position": (_INS_PLACE,),
    "positions": (_GNSS_PLACE, _INS_PLACE),
    "INS heading": (("ins.true_heading_deg",), ("ins.magnetic_heading_deg",)),
    "GDOP, PDOP or HDOP": (("gnss.gdop",), ("gnss.pdop",), ("gnss.hdop",)),
    "the integrity flag of GNSS": (("gnss.integrity_ok",),),
    "a three-axis magnetometer": (
        ("magnetometer.field_forward_nt", "magnetometer.field_right_nt", "magnetometer.field_down_nt"),
    ),
    "a true heading with no compass in it, or true airspeed beside GNSS velocity": tuple(
        ("air.true_airspeed_mps", *motion) for motion in _GNSS_MOTION
    ),
}
LEFT = "logged, but with no usable value where it is needed"


def is_held(results: FlightResults, text: str) -> bool:
    """Tell whether the log has what advice asks for; False for what no rule names."""
    held = {
        f"{kind_of(topic)}.{name}"
        for topic, one in results.ledger.topics.items()
        if is_canonical(topic)
        for name, field in one.fields.items()
        if field.present
    }
    return any(held.issuperset(way) for way in ASKED.get(text, ()))


def without_held(advice: Advice, results: FlightResults) -> Advice:
    """Return advice to record; to check, where the log has the signal already."""
    if advice.line != "Record" or not is_held(results, advice.text):
        return advice
    return advice._replace(line="Check", text=f"{advice.text} ({LEFT})")
