"""The tutorial runs from its first cell to its last, and shows what it talks about."""

import os
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

TUTORIAL = Path(__file__).parents[1] / "docs" / "notebooks" / "tutorial.ipynb"
LONGEST_CELL_S = 120  # the whole takes 39 s on two busy cores; a cold cache of compiled code is allowed for


def notebook() -> Any:
    return nbformat.read(TUTORIAL, as_version=4)


def executed_in(folder: Path) -> Any:
    """The tutorial with its outputs, run in a folder of its own without a way to the Internet."""
    nowhere = "http://127.0.0.1:9"
    environment = os.environ | {"http_proxy": nowhere, "https_proxy": nowhere, "IPYTHONDIR": str(folder)}
    done = notebook()
    client = NotebookClient(done, timeout=LONGEST_CELL_S, resources={"metadata": {"path": str(folder)}})
    client.execute(env=environment)
    return done


def outputs_of(executed: Any, source: str) -> dict[str, Any]:
    """What the one cell with some source shows: text by kind of output."""
    (cell,) = [cell for cell in executed.cells if cell.cell_type == "code" and source in cell.source]
    shown: dict[str, Any] = {}
    for output in cell.outputs:
        shown |= {output.name: output.text} if output.output_type == "stream" else dict(output.data)
    return shown


def test_it_is_kept_without_outputs() -> None:
    for cell in notebook().cells:
        assert not cell.get("outputs") and cell.get("execution_count") is None


def expect_nothing_goes_to_stderr(executed: Any) -> None:
    streams = [out for cell in executed.cells for out in cell.get("outputs", ()) if out.output_type == "stream"]
    assert [out.text for out in streams if out.name == "stderr"] == []


def expect_a_flight_shows_its_verdict(executed: Any) -> None:
    card = outputs_of(executed, "flight = groundstation.open(log)")["text/html"]
    assert "Accept" in card and "Enter −1.2°" in card
    assert card == outputs_of(executed, "again = groundstation.open")["text/html"]


def expect_tables_and_figures_are_shown(executed: Any) -> None:
    assert "precision e of Markelov 2015" in outputs_of(executed, 'to_frame("gates")')["text/html"]
    for name in ("density", "growth"):
        assert len(outputs_of(executed, f'figure("{name}")')["image/png"]) > 10_000


def expect_the_setting_has_the_effect_the_text_tells(executed: Any) -> None:
    lines = outputs_of(executed, "taxi_speed_min_mps")["text/plain"].splitlines()[1:]
    rows = [line.split() for line in lines]
    seconds, half_width = ([float(row[column]) for row in rows] for column in (2, 4))
    assert seconds == sorted(seconds, reverse=True) and seconds[0] > 2 * seconds[-1]
    assert half_width[-1] > half_width[0]
    assert rows[0][-1] == "accept" and rows[-1][-1] != "accept"


def expect_what_is_not_assessable_is_told_in_a_line(executed: Any) -> None:
    (cell,) = [cell for cell in executed.cells if cell.source == "flight.forecast()"]
    (output,) = cell.outputs
    assert output.traceback == ["NotAssessableError: forecast: no INS position in the log"]


def expect_the_recording_is_a_widget(executed: Any) -> None:
    assert "application/vnd.jupyter.widget-view+json" in outputs_of(executed, "flight.show(")


@pytest.mark.slow
def test_every_cell_runs_and_shows_what_its_text_tells(tmp_path: Path) -> None:
    executed = executed_in(tmp_path)  # once: each worker of a run in parallel would run it again for its own test
    expect_nothing_goes_to_stderr(executed)
    expect_a_flight_shows_its_verdict(executed)
    expect_tables_and_figures_are_shown(executed)
    expect_the_setting_has_the_effect_the_text_tells(executed)
    expect_what_is_not_assessable_is_told_in_a_line(executed)
    expect_the_recording_is_a_widget(executed)
