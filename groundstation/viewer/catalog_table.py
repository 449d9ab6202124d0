"""Views of a catalog: a sortable table of results, and cards with a small plot per flight.

Rerun's table blueprints are unstable: all that knows them is here.
"""

from collections.abc import Sequence
from pathlib import Path

import rerun.blueprint as rrb
from rerun.blueprint.table import CardLayout, Column, PreviewCell, PreviewsConfig, TableLayout

from groundstation.viewer.inner import OF_THE_CATALOG, SEGMENT
from groundstation.viewer.properties import FLIGHT
from groundstation.viewer.recorder import FLIGHT_TIME
from groundstation.viewer.views import plot

LINK = "recording link"
APPLICATION = "groundstation table"
# Property and its title, in the order of the columns; those that no recording has are left out.
COLUMNS = (
    (f"{FLIGHT}:aircraft", "aircraft"),
    (f"{FLIGHT}:flight", "flight"),
    ("RecordingInfo:start_time", "start"),
    ("heading:verdict", "heading verdict"),
    ("heading:error_deg", "heading error, deg"),
    ("heading:confidence95_low_deg", "95 % from, deg"),
    ("heading:confidence95_high_deg", "95 % to, deg"),
    ("heading:correction_deg", "correction to type, deg"),
    ("inertial:radial_error_rate_fit_nmiph", "INS radial error rate, nmi/h"),
    ("inertial:velocity_error_rms_mps", "INS velocity error, RMS, m/s"),
    ("magnetic:verdict", "magnetic verdict"),
    ("magnetic:residual_rms_deg_before", "magnetic residual before, deg"),
    ("magnetic:residual_rms_deg_after", "magnetic residual after, deg"),
    (f"{FLIGHT}:duration_s", "duration, s"),
    (f"{FLIGHT}:status", "status"),
    (f"{FLIGHT}:findings_warn", "warnings"),
    (f"{FLIGHT}:source", "log"),
    (f"{FLIGHT}:version", "groundstation"),
)
ON_CARDS = 8  # columns that a card shows, the first that there are


def save_flight_table(path: Path, known: Sequence[str]) -> None:
    """Write the layout of a table of flights.

    Parameters
    ----------
    path : Path
        The .rbl file.
    known : sequence of str
        Names of the columns that the catalog has; those of properties begin with ``property:``.
    """
    shown = [(f"property:{name}", title) for name, title in COLUMNS if f"property:{name}" in known]
    columns = [Column(name, name=title) for name, title in shown]
    preview = PreviewCell(plot("Height", "overview/height", legend=False))
    others = {name for name in known if name.startswith("property:")} - {name for name, _ in shown}
    hidden = [Column(name, visible=False) for name in (*sorted(others), *OF_THE_CATALOG)]
    table = TableLayout(columns=[Column(SEGMENT, name="flight id"), Column(LINK, name="open"), *columns, *hidden])
    cards = CardLayout(
        title=SEGMENT, link=LINK, fields=[Column(LINK, name="height", column_type=preview), *columns[:ON_CARDS]]
    )
    layout = rrb.TableBlueprint(
        table_layout=table,
        card_layout=cards,
        default_layout="table",
        previews_config=PreviewsConfig(timeline=FLIGHT_TIME, play_state="paused"),
        sort_by=SEGMENT,
    )
    layout.save(APPLICATION, path)
