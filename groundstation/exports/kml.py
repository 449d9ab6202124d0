"""KML 2.2 with Google's tracks, for Google Earth and QGIS.

The formats are OGC 12-007r2, 2015, and the Google KML extension ``gx:Track``.
"""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import continuous_longitude_deg
from groundstation.base.printable import printable
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.exports.tracks import ELLIPSOID, MSL, PRESSURE, Track, coordinates, number

KML, GX = "http://www.opengis.net/kml/2.2", "http://www.google.com/kml/ext/2.2"
COLOURS = ("ffd18802", "ff3c8f00", "ff1f6fd8", "ff8f3f97", "ff5a5a5a")  # alpha, blue, green, red
ALTITUDES = {MSL: "above sea level", ELLIPSOID: "above the ellipsoid", PRESSURE: "by pressure"}  # the best first
SCHEMA = "values"
Spot = tuple[str, str, str]  # longitude, latitude, altitude


def write_kml(path: Path, title: str, tracks: Sequence[Track]) -> None:
    """Write a folder with a placemark for each track, and all that is known of each position.

    With UTC a track moves with the time slider; without, it is a line. KML knows altitudes above sea level alone; where
    it is known of fewer positions another is written, and the description says which. KML has no mark for an altitude
    that is missing: between two that are known it is interpolated, before and behind them they are held.

    A track that crosses the date line is one of several parts, as RFC 7946 asks (3.1.9): programs that draw on a flat
    map would draw a line round the globe. A line ends at the date line and begins there again.
    """
    ET.register_namespace("", KML)
    ET.register_namespace("gx", GX)
    root = ET.Element(f"{{{KML}}}kml")
    document = _sub(root, "Document")
    _sub(document, "name", title)
    for number_of in range(len(tracks)):
        style = _sub(document, "Style", id=f"track{number_of}")
        line = _sub(style, "LineStyle")
        _sub(line, "color", COLOURS[number_of % len(COLOURS)])
        _sub(line, "width", "3")
    names = sorted({name for track in tracks for name in track.columns})
    schema = _sub(document, "Schema", id=SCHEMA)
    for name in names:
        field = _sub(schema, f"{{{GX}}}SimpleArrayField", name=name, type="float")
        _sub(field, "displayName", name)
    for number_of, track in enumerate(tracks):
        place = _sub(document, "Placemark")
        _sub(place, "name", track.name)
        altitude = _altitude(track)
        told = f", altitude {ALTITUDES[altitude]}" if altitude else ""
        _sub(place, "description", f"{track.title}{told}")
        _sub(place, "styleUrl", f"#track{number_of}")
        _timed(place, track) if track.has_utc else _line(place, track)
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _timed(place: ET.Element, track: Track) -> None:
    pieces, spots = track.pieces(), _spots(track)
    whole = place
    if len(pieces) > 1:
        whole = _sub(place, f"{{{GX}}}MultiTrack")
        _sub(whole, "altitudeMode", _altitude_mode(track))
        _sub(whole, f"{{{GX}}}interpolate", "1")  # a globe joins the parts
    for piece in pieces:
        shape = _sub(whole, f"{{{GX}}}Track")
        _sub(shape, "altitudeMode", _altitude_mode(track))
        for time_ns in track.time_ns[piece].tolist():
            _sub(shape, "when", utc_ns_to_iso(time_ns))
        for spot in spots[piece]:
            _sub(shape, f"{{{GX}}}coord", " ".join(spot))
        data = _sub(_sub(shape, "ExtendedData"), "SchemaData", schemaUrl=f"#{SCHEMA}")
        for name, values in track.columns.items():
            array = _sub(data, f"{{{GX}}}SimpleArrayData", name=name)
            for value in values[piece].tolist():
                _sub(array, f"{{{GX}}}value", number(value, 4))


def _line(place: ET.Element, track: Track) -> None:
    pieces, spots = track.pieces(), _spots(track)
    joints = [_joint(track, piece.start) for piece in pieces[1:]]
    parts = [spots[piece] for piece in pieces]
    for number_of, (before, after) in enumerate(joints):
        parts[number_of].append(before)
        parts[number_of + 1].insert(0, after)
    whole = place if len(parts) == 1 else _sub(place, "MultiGeometry")
    for part in parts:
        shape = _sub(whole, "LineString")
        _sub(shape, "tessellate", "1")  # on the ground it follows the terrain
        _sub(shape, "altitudeMode", _altitude_mode(track))
        _sub(shape, "coordinates", " ".join(",".join(spot) for spot in part))


def _joint(track: Track, row: int) -> tuple[Spot, Spot]:
    """Return the ends of two parts of a line that crosses the date line before a row."""
    longitude = continuous_longitude_deg(track.longitude_deg[row - 1 : row + 1])
    side = 180.0 if track.longitude_deg[row - 1] > 0.0 else -180.0
    share = (180.0 * np.sign(longitude[0]) - longitude[0]) / (longitude[1] - longitude[0])
    ends = track.latitude_deg[row - 1 : row + 1], _altitudes(track)[row - 1 : row + 1]
    latitude, height = (float(before + share * (after - before)) for before, after in ends)
    before, after = ((f"{one:.0f}", coordinates(np.array([latitude]))[0], number(height, 3)) for one in (side, -side))
    return before, after


def _altitude_mode(track: Track) -> str:
    return "absolute" if _altitude(track) else "clampToGround"


def _altitude(track: Track) -> str:
    """Return the column of the altitude that most positions have; empty where there is none.

    Among columns that are known equally often, it is the best one.
    """
    known = {name: np.count_nonzero(np.isfinite(track.column(name))) for name in ALTITUDES}
    best = max(ALTITUDES, key=lambda name: known[name])  # the first of equals
    return best if known[best] else ""


def _spots(track: Track) -> list[Spot]:
    altitude = _altitudes(track).tolist()
    both = zip(coordinates(track.longitude_deg), coordinates(track.latitude_deg), altitude, strict=True)
    return [(longitude, latitude, number(height, 3)) for longitude, latitude, height in both]


def _altitudes(track: Track) -> FloatArray:
    """Altitude of every position, gaps filled from those around."""
    altitude, time_s = track.column(_altitude(track)), track.time_s
    known = np.isfinite(altitude)
    return np.interp(time_s, time_s[known], altitude[known]) if known.any() else np.zeros(len(track))


def _sub(parent: ET.Element, tag: str, text: str | None = None, **attributes: str) -> ET.Element:
    element = ET.SubElement(parent, tag if tag.startswith("{") else f"{{{KML}}}{tag}", attributes)
    element.text = None if text is None else printable(text)  # XML knows no other characters
    return element
