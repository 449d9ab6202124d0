"""GPX 1.1 (Topografix, 2004): one track each, further data of a position as extensions."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from groundstation.base.printable import printable
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.exports.tracks import MSL, Track, coordinates, number

GPX, OWN = "http://www.topografix.com/GPX/1/1", "https://groundstation.invalid/gpx/1"
OF_GPX = (MSL, "satellites_used", "hdop")


def write_gpx(path: Path, title: str, tracks: Sequence[Track]) -> None:
    """Write the tracks, each crossing of the date line between two segments.

    ``ele`` is height above sea level in GPX: an altitude above anything else is an extension.
    """
    ET.register_namespace("", GPX)
    ET.register_namespace("gs", OWN)
    root = ET.Element(f"{{{GPX}}}gpx", {"version": "1.1", "creator": "groundstation"})
    _sub(_sub(root, "metadata"), "name", title)
    for track in tracks:
        part = _sub(root, "trk")
        _sub(part, "name", track.name)
        _sub(part, "desc", track.title)
        _segments(part, track)
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _segments(part: ET.Element, track: Track) -> None:
    own = {name: values.tolist() for name, values in track.columns.items() if name not in OF_GPX}
    if not track.has_utc:
        own["flight_time_s"] = track.time_s.tolist()
    altitude, satellites, hdop = (track.column(name).tolist() for name in OF_GPX)
    starts, segment = {piece.start for piece in track.pieces()}, part
    places = zip(coordinates(track.latitude_deg), coordinates(track.longitude_deg), strict=True)
    for row, (latitude, longitude) in enumerate(places):
        if row in starts:
            segment = _sub(part, "trkseg")
        point = ET.SubElement(segment, f"{{{GPX}}}trkpt", {"lat": latitude, "lon": longitude})
        _known(point, "ele", number(altitude[row], 3))
        if track.has_utc:
            _sub(point, "time", utc_ns_to_iso(int(track.time_ns[row])))
        _known(point, "sat", number(satellites[row], 0))
        _known(point, "hdop", number(hdop[row], 2))
        texts = {name: number(values[row], 4) for name, values in own.items()}
        if any(texts.values()):
            extensions = _sub(point, "extensions")
            for name, text in texts.items():
                if text:
                    ET.SubElement(extensions, f"{{{OWN}}}{name}").text = text


def _known(parent: ET.Element, tag: str, text: str) -> None:
    if text:
        _sub(parent, tag, text)


def _sub(parent: ET.Element, tag: str, text: str | None = None) -> ET.Element:
    element = ET.SubElement(parent, f"{{{GPX}}}{tag}")
    element.text = None if text is None else printable(text)  # XML knows no other characters
    return element
