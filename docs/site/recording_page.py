"""Page of the site on recordings: tabs, views and entity paths of simulated flights, read from their files."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.verbs.synthesis import simulate_to
from groundstation.viewer.file_contents import layout_of

SHOWN = ("taxi-good", "imu-drive")  # some 8 s of one core; others take longer
TITLE = "# Tabs and entity paths of recordings"


def page() -> str:
    """Return the page; the scenarios are simulated and run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        recordings = {}
        for scenario in SHOWN:
            log = simulate_to(scenario, folder / "logs")[0]
            (outcome,) = run_many([log], folder / scenario, Configuration(), jobs=1)
            recordings[scenario] = Path(outcome.folder) / f"{outcome.flight_id}.rrd"
        return recording_page(recordings)


def recording_page(recordings: Mapping[str, Path]) -> str:
    """Return the page on some recordings by their titles: a table for each tab that none before it had."""
    parts = [TITLE, "Read from recordings of simulated flights. A tab stands here once, from the first that has it."]
    told: set[str] = set()
    for title, path in recordings.items():
        for tab in layout_of(path):
            if tab.name not in told:
                told.add(tab.name)
                rows = [
                    f"| {_cell(name)} | {', '.join(f'`{_cell(one)}`' for one in paths)} |" for name, paths in tab.views
                ]
                parts.append(f"## {tab.name}\n\nFrom `{title}`.")
                parts.append("\n".join(("| view | entity paths |", "| --- | --- |", *rows)))
    return "\n\n".join(parts) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")
