"""TMATS, the text that describes a recording: channels, buses, the aircraft, a date."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import field
from datetime import date

from groundstation.base.dataclasses import dataclass

YEARS = range(1970, 2200)  # years of recordings; others are damage
MOST_CHARACTERS = 4 << 20  # characters of all attributes; real ones have some 100 thousand
_VALUE_CHARACTERS = 200
_ATTRIBUTE = re.compile(r"([A-Za-z]{1,4}(?:-\d+)?\\[^:;\r\n]{1,60}):([^;]*);")
_YEAR_FIRST, _YEAR_LAST = (
    re.compile(pattern)
    for pattern in (r"(?<![-\d])(\d{4})[-/.](\d\d)[-/.](\d\d)", r"(?<![-\d])(\d\d)[-/.](\d\d)[-/.](\d{4})")
)
_OF_FRAMES = re.compile(r"D\d|F\d|MF\\N|MF\d|SYNC\d")
_DATES = (r"R-\d+\\RI4", r"G\\OD", r"G\\COM")


@dataclass(frozen=True)
class Channel:
    """A channel as TMATS describes it.

    Parameters
    ----------
    kind : str
        ``1553IN``, ``429IN``, ``PCMIN`` ...; empty when not said.
    source : str
        Name of the data source.
    bus : str
        Name of a 1553 bus; empty when there is none.
    sub_channels : mapping of int to str
        Names of the buses of an ARINC-429 channel, by sub-channel number.
    pcm : mapping of str to str
        Attributes of its PCM stream: bits of a word, words and bits of a frame, synchronisation (P-d group).
    """

    kind: str = ""
    source: str = ""
    bus: str = ""
    sub_channels: Mapping[int, str] = field(default_factory=dict)
    pcm: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Tmats:
    """Used part of a recording's TMATS; empty where it has none."""

    attributes: Mapping[str, str] = field(default_factory=dict)
    channels: Mapping[int, Channel] = field(default_factory=dict)

    def get(self, pattern: str) -> str:
        """Value of the first attribute whose whole code fits a pattern; empty when there is none."""
        fits = re.compile(pattern)
        return next((value for code, value in self.attributes.items() if fits.fullmatch(code) and value), "")

    @property
    def day(self) -> tuple[date, str] | None:
        """Date that TMATS states, and the attribute that has it.

        It may be the date on which TMATS was generated.
        """
        for pattern in _DATES:
            found = _date_of(self.get(pattern))
            if found:
                return found, pattern.replace(r"R-\d+\\", "R-x\\").replace("\\\\", "\\")
        return None

    def bus_name(self, channel: int, sub_channel: int | None = None) -> str:
        """Name of a 1553 bus, or of a sub-channel's 429 bus; empty where TMATS does not say."""
        found = self.channels.get(channel, Channel())
        return found.bus if sub_channel is None else found.sub_channels.get(sub_channel, "")


def parse(text: bytes) -> Tmats:
    """Parse TMATS; text that is no attribute is passed over.

    Examples
    --------
    >>> found = parse(b"G\\\\PN:Test;R-1\\\\TK1-3:7;\\r\\nR-1\\\\CDT-3:429IN;R-1\\\\ASN-3-1:1;R-1\\\\ANM-3-1:IRS-1;")
    >>> found.get(r"G\\\\PN"), found.channels[7].kind, found.bus_name(7, 1)
    ('Test', '429IN', 'IRS-1')
    """
    pairs = _ATTRIBUTE.findall(text[:MOST_CHARACTERS].decode("utf-8", "replace"))
    attributes = {code.strip().upper(): value.strip()[:_VALUE_CHARACTERS] for code, value in pairs}
    return Tmats(attributes, dict(_channels(attributes)))


def _channels(attributes: Mapping[str, str]) -> Iterator[tuple[int, Channel]]:
    """Number and description of each channel that TMATS gives a number."""
    buses = _buses(attributes)
    sub_channels, streams = _sub_channels(attributes), _pcm_streams(attributes)
    for code, value in attributes.items():
        found = re.fullmatch(r"(R-\d+)\\TK1-(\d+)", code)
        if found and value.isdecimal():
            recorder, place = found.groups()
            get = {
                key: attributes.get(f"{recorder}\\{key}-{place}", "") for key in ("CDT", "DSI", "BDLN", "PDLN", "CDLN")
            }
            links = [get[key] for key in ("BDLN", "PDLN", "CDLN", "DSI") if get[key]]
            bus = next((buses[link] for link in links if link in buses), "")
            pcm = next((streams[link] for link in links if link in streams), {})
            yield int(value), Channel(get["CDT"], get["DSI"], bus, sub_channels.get((recorder, place), {}), pcm)


def _buses(attributes: Mapping[str, str]) -> dict[str, str]:
    """Names of 1553 buses by the data link that they are recorded from."""
    buses: dict[str, str] = {}
    for code, link in attributes.items():
        found = re.fullmatch(r"(B-\d+)\\DLN", code)
        name = attributes.get(f"{found.group(1)}\\BNA-1", "") if found else ""
        if link and name:
            buses.setdefault(link, name)
    return buses


def _pcm_streams(attributes: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Attributes of PCM streams by the data link that they are recorded from."""
    streams: dict[str, dict[str, str]] = {}
    for code, link in attributes.items():
        found = re.fullmatch(r"(P-\d+)\\DLN", code)
        if found and link:
            group = found.group(1) + "\\"
            streams.setdefault(
                link,
                {
                    name.removeprefix(group): value
                    for name, value in attributes.items()
                    if value and name.startswith(group) and _OF_FRAMES.fullmatch(name.removeprefix(group))
                },
            )
    return streams


def _sub_channels(attributes: Mapping[str, str]) -> dict[tuple[str, str], dict[int, str]]:
    """Return the names of ARINC-429 buses by recorder, place, and sub-channel number from 1.

    The place is that of the channel.
    """
    names: dict[tuple[str, str], dict[int, str]] = {}
    for code, value in attributes.items():
        found = re.fullmatch(r"(R-\d+)\\ASN-(\d+)-(\d+)", code)
        if found and value.isdecimal():
            recorder, place, number = found.groups()
            name = attributes.get(f"{recorder}\\ANM-{place}-{number}", "")
            if name:
                names.setdefault((recorder, place), {})[int(value)] = name
    for key, numbered in names.items():
        if 0 in numbered:  # some recorders count from 0, as the words' headers do
            names[key] = {number + 1: name for number, name in numbered.items()}
    return names


def _date_of(text: str) -> date | None:
    year_first, year_last = _YEAR_FIRST.search(text), _YEAR_LAST.search(text)
    if year_first:
        year, month, day = (int(part) for part in year_first.groups())
    elif year_last:
        month, day, year = (int(part) for part in year_last.groups())
    else:
        return None
    try:
        return date(year, month, day) if year in YEARS else None
    except ValueError:
        return None
