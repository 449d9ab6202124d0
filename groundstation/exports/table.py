"""All tracks as one table: CSV or Parquet, a row for every position."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from groundstation.base.printable import spreadsheet_text
from groundstation.exports.tracks import Track

if TYPE_CHECKING:
    import pandas as pd

DECIMALS = 9  # 0.1 mm in degrees; a CSV ends no number earlier


def frame_of(tracks: Sequence[Track]) -> "pd.DataFrame":
    """Return the rows of all tracks one behind the other, named by ``track``.

    A column that a track lacks is NaN there.
    """
    import pandas as pd

    parts = []
    for track in tracks:
        columns = {
            "track": track.name,
            "time_s": track.time_s,
            "latitude_deg": track.latitude_deg,
            "longitude_deg": track.longitude_deg,
            **track.columns,
        }
        part = pd.DataFrame(columns)
        if track.has_utc:
            part.insert(1, "time_utc", pd.to_datetime(track.time_ns, utc=True))
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def write_csv(path: Path, tracks: Sequence[Track]) -> None:
    """Write the table as CSV, UTC as ISO 8601."""
    frame = frame_of(tracks)
    numbers = frame.select_dtypes("number").columns
    frame[numbers] = frame[numbers].round(DECIMALS)
    if "time_utc" in frame:
        frame["time_utc"] = frame["time_utc"].dt.strftime("%Y-%m-%dT%H:%M:%S.%fZ")
    frame["track"] = frame["track"].map(spreadsheet_text)
    frame.columns = frame.columns.map(spreadsheet_text)
    frame.to_csv(path, index=False, lineterminator="\n")


def write_parquet(path: Path, tracks: Sequence[Track]) -> None:
    """Write the table as Parquet, UTC as timestamps."""
    frame_of(tracks).to_parquet(path, index=False)
