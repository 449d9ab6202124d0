"""Texts of the receiver in a log, and whether anything but it tells a heading."""

from fnmatch import fnmatchcase

from groundstation.base.findings import Finding
from groundstation.base.signals import is_canonical, kind_of
from groundstation.systems.gnss.answer import ReceiverTexts
from groundstation.systems.gnss.wording_answer import texts_text
from groundstation.tables.table import Flight

TEXT_FIELDS = (("raw.[GB]?TXT", "text"), ("raw.INF-*", "message"))  # NMEA, UBX
HEADINGS = ("*HDT", "*HDG", "*HDM", "*THS", "*RELPOSNED*", "*HEADING*", "raw.NAV-ATT", "raw.PASHR*", "raw.PTNL.AVR")


def texts_of(flight: Flight) -> tuple[ReceiverTexts, ...]:
    """Return the texts of the receiver by topic, without empty ones."""
    found = []
    for topic in sorted(flight.topics()):
        field = next((name for pattern, name in TEXT_FIELDS if fnmatchcase(topic, pattern)), None)
        if field is None:
            continue
        texts = [text for text in flight[topic].text(field).tolist() if text.strip()]
        if texts:
            found.append(ReceiverTexts(topic, len(texts), len(set(texts)), texts[0].strip()))
    return tuple(found)


def finding_of(one: ReceiverTexts) -> Finding:
    """Return the finding on the texts of one topic."""
    return Finding("info", "gnss.texts", texts_text(one), one.topic, "", one.count)


def has_heading_source(flight: Flight) -> bool:
    """Tell whether a log has more than one receiver alone, which tells no heading."""
    topics = flight.topics()
    own = [topic for topic in topics if is_canonical(topic) and kind_of(topic) != "event"]
    if len(own) != 1 or kind_of(own[0]) != "gnss":
        return True
    return any(fnmatchcase(topic, pattern) for topic in topics for pattern in HEADINGS)
