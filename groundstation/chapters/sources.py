"""Chapter on the sources of the methods, once, by the names used in the other chapters."""

from groundstation.chapters.parts import Facts, Section
from groundstation.results.flight import FlightResults

TITLE = "Sources"
LEAD = ""
MARKELOV = (
    "Markelov 2015",
    "Markelov, Kostishin, Shukalov: Heading correction of an INS before take-off by satellite navigation, Information "
    "and Control Systems 2015 No 6",
)
NEUSYPIN = ("Neusypin 2003", "Neusypin, Smolkin, Kharin, Kopelovich, Staroverov: Herald of BMSTU, 2003")
PATENT = ("RU 2550774", "2015, prior art of the Russian patent on the deviation of magnetometric sensors in flight")
SOURCES: dict[str, tuple[tuple[str, str], ...]] = {
    "heading": (MARKELOV,),
    "inertial": (NEUSYPIN,),
    "forecast": (NEUSYPIN,),
    "magnetic": (PATENT,),
    "landing": (
        ("FSF ALAR", "Flight Safety Foundation, ALAR Briefing Note 7.1: deviations, sink rate, speed"),
        ("Airbus FOBN", "Airbus Flight Operations Briefing Notes: bank"),
        ("ICAO Annex 10", "Volume I, table 3.7.2.4-1: alarm limits; Satellite Navigation 1, 2020: accuracy"),
    ),
}


def sources(results: FlightResults) -> Section | None:
    """Return the chapter; None where no answer rests on a source."""
    named = dict.fromkeys(source for name in results.answers for source in SOURCES.get(name, ()))
    if not named:
        return None
    return Section("sources", TITLE, LEAD, (Facts("", [(name, text, "") for name, text in named]),))
