"""A layout saved in the viewer: it serves any flight, stands before the data, and what is none is refused first."""

import importlib.util
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import rerun.blueprint as rrb
from rerun.chunk import RrdReader
from typer.testing import CliRunner

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.cli.main import app
from groundstation.pipeline.many_flights.sessions.job import SessionJob
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.layout import saved_layouts
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.resume import keys_of
from groundstation.pipeline.verbs.describe import describe
from groundstation.systems import systems
from groundstation.tables.session_settings import Stations
from groundstation.viewer import launch
from groundstation.viewer.catalog_table import save_flight_table
from groundstation.viewer.file_contents import MAGIC, layout_of, rerun_version
from groundstation.viewer.recording import write_recording
from groundstation.viewer.saved_layout import read_layout, write_with_layout
from tests.recording_contents import Contents
from tests.told import write_recording as write_told
from tests.viewer_example import make_flight, make_results

ROOT = Path(__file__).parents[2]
SHORT = ROOT / "sample_logs" / "taxi-short.csv"
CHUNK, ACTIVATION = 2, 3  # kinds of messages: a part of a store, the end of a layout
HEAD, FRAME = 12, struct.Struct("<QQ")  # bytes before the first message; its kind and length


@pytest.fixture(scope="module")
def layout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A layout of one page, saved for another flight."""
    path = tmp_path_factory.mktemp("layout") / "mine.rbl"
    page = rrb.Vertical(contents=[rrb.TextDocumentView(origin="/summary", name="Answers")], name="Mine")
    rrb.Blueprint(rrb.Tabs(page), auto_views=False).save("groundstation another", str(path))
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    flight = make_flight(240.0, 20.0)
    path = tmp_path_factory.mktemp("recording") / "a.rrd"
    write_told(path, flight, make_results(flight))
    return path


def messages(path: Path) -> list[tuple[int, int]]:
    """Kind and length of each message of a file, in order."""
    content, place, found = path.read_bytes(), HEAD, []
    while place + FRAME.size <= len(content):
        kind, length = FRAME.unpack_from(content, place)
        found.append((kind, length))
        place += FRAME.size + length
    return found


def test_the_layout_stands_before_the_data(recording: Path) -> None:
    found = messages(recording)
    end = [kind for kind, _ in found].index(ACTIVATION)
    reader = RrdReader(recording)
    own = len(list(reader.stream(store=reader.blueprints()[0])))
    properties = sum(chunk.entity_path.startswith("/__properties") for chunk in reader.stream())
    stores = 4  # Rerun names each of the two twice
    assert own <= end <= own + properties + stores, "nothing but the layout, properties and the names of the stores"
    data = sum(not chunk.entity_path.startswith("/__properties") for chunk in reader.stream())
    assert data > 100 and sum(kind == CHUNK for kind, _ in found[end:]) >= data


def test_a_layout_serves_another_flight(layout: Path, recording: Path, tmp_path: Path) -> None:
    target = tmp_path / "b.rrd"
    write_with_layout(recording, read_layout(layout), target)
    before, after = Contents(recording), Contents(target)
    assert [tab.name for tab in layout_of(target)] == ["Mine"]
    assert layout_of(target)[0].views == (("Answers", ("/summary/**",)),)
    assert (after.store.application_id, after.store.recording_id) == (
        before.store.application_id,
        before.store.recording_id,
    )
    assert [one.application_id for one in after.blueprints] == [before.store.application_id]
    assert after.timelines == before.timelines and after.text("/summary") == before.text("/summary")
    assert {name: sum(one.num_rows for one in rows) for name, rows in after.batches.items()} == {
        name: sum(one.num_rows for one in rows) for name, rows in before.batches.items()
    }


def test_a_recording_is_written_with_it(layout: Path, tmp_path: Path) -> None:
    flight = make_flight(200.0, 10.0)
    path = tmp_path / "a.rrd"
    write_recording(path, flight, make_results(flight), systems(), read_layout(layout))
    contents = Contents(path)
    assert [one.application_id for one in contents.blueprints] == [contents.store.application_id]
    assert [tab.name for tab in layout_of(path)] == ["Mine"] and "/raw/ins/velocity" in contents.batches


def refused(folder: Path, layout: Path, recording: Path) -> dict[str, Path]:
    """Files that are no layout, by a part of the line that says so."""
    content = layout.read_bytes()
    made = {
        "no such file": b"",
        "no layout": b"text",
        "damaged": content[: len(content) // 2],
        "a layout of Rerun 0.1.0, expected one of Rerun": MAGIC + bytes([0, 1, 0]) + content[7:],
    }
    paths = {}
    for number, (told, bytes_of) in enumerate(made.items()):
        paths[told] = folder / f"{number}.rbl"
        if bytes_of:
            paths[told].write_bytes(bytes_of)
    table = folder / "table.rbl"
    save_flight_table(table, [])
    return paths | {"found a recording": recording, "a blueprint without views": table}


def test_what_is_no_layout_is_refused_before_any_flight(layout: Path, recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    for told, path in refused(tmp_path, layout, recording).items():
        result = CliRunner().invoke(app, ["run", str(SHORT), "-o", str(out), "--layout", str(path)])
        assert result.exit_code == 2 and told in result.stderr, (told, result.stderr)
        assert result.stderr.count("\n") == 1 and not out.exists()
    without = CliRunner().invoke(app, ["run", "a", "-o", str(out), "--layout", str(layout), "--only", "results"])
    assert without.exit_code == 2 and "recordings to lay out" in without.stderr


def test_another_layout_is_another_run(layout: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.rbl"
    rrb.Blueprint(rrb.TextDocumentView(origin="/summary"), auto_views=False).save("groundstation a", str(other))
    source = open_log(SHORT).source
    plain = Configuration()
    layouts = [saved_layouts([] if path is None else [path]) for path in (None, layout, other, layout)]
    keys = [keys_of(source, replace(plain, layouts=one)) for one in layouts]
    assert len({one.conversion for one in keys}) == 1, "the MCAP stays"
    assert keys[1] == keys[3] and len({one.analysis for one in keys}) == 3
    assert replace(plain, layouts=layouts[1]).to_dict() == {"layouts": {"flight": "mine.rbl"}}


def of(kind: str, origin: str, folder: Path) -> Path:
    """A layout of one page whose view shows an entity."""
    path = folder / f"{kind}.rbl"
    page = rrb.Vertical(contents=[rrb.TextDocumentView(origin=origin, name=kind)], name=f"My {kind}")
    rrb.Blueprint(rrb.Tabs(page), auto_views=False).save("groundstation another", str(path))
    return path


def test_a_layout_is_of_the_kind_of_recording_it_was_saved_from(layout: Path, tmp_path: Path) -> None:
    session, fleet = of("session", "/cooperative/answer", tmp_path), of("fleet", "/flights", tmp_path)
    found = saved_layouts([layout, session, fleet])
    assert {one.of: one.name for one in found} == {
        "flight": "mine.rbl",
        "session": "session.rbl",
        "fleet": "fleet.rbl",
    }
    given = Configuration(layouts=found)
    assert given.layout_bytes("fleet") == fleet.read_bytes()
    assert Configuration(layouts=found[:1]).layout_bytes("session") == b""
    source = open_log(SHORT).source
    alone = keys_of(source, Configuration(layouts=found[:1]))
    assert keys_of(source, given) == alone, "flights are not made again for the layout of another kind"
    job = SessionJob((), Stations(), tmp_path, given)
    without = SessionJob((), Stations(), tmp_path, Configuration(layouts=found[:1]))
    assert job.keys().conversion == without.keys().conversion and job.keys().analysis != without.keys().analysis
    with pytest.raises(UsageError, match="both of a flight"):
        saved_layouts([layout, of("flight", "/summary", tmp_path)])


def test_run_lays_out_flights_and_fleet_each_by_its_own(layout: Path, tmp_path: Path) -> None:
    out, fleet = tmp_path / "out", of("fleet", "/flights", tmp_path)
    asked = ["run", str(SHORT), "-o", str(out), "--layout", str(layout), "--layout", str(fleet), "-q"]
    result = CliRunner().invoke(app, asked)
    assert result.exit_code == 0, result.stderr
    (flight,) = out.glob("*/*.rrd")
    assert [tab.name for tab in layout_of(flight)] == ["Mine"]
    assert [tab.name for tab in layout_of(out / "fleet.rrd")] == ["My fleet"]
    written = flight.stat().st_mtime_ns
    result = CliRunner().invoke(app, [*asked[:6], "-q"])
    assert result.exit_code == 0 and flight.stat().st_mtime_ns == written
    assert "My fleet" not in [tab.name for tab in layout_of(out / "fleet.rrd")], "without a layout its own again"


def test_view_opens_a_copy_with_it(
    layout: Path, finished_run: Callable[..., Outcome], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Path(finished_run("taxi-short").folder)
    seen = []

    def open_viewer(what: Path, **options: object) -> int:
        seen.append((what.name, [tab.name for tab in layout_of(what)], options["links"]))
        return 0

    monkeypatch.setattr(launch, "open_viewer", open_viewer)
    result = CliRunner().invoke(app, ["view", str(folder), "--web", "--layout", str(layout)])
    assert result.exit_code == 0, result.stderr
    assert seen == [(f"{folder.name}.rrd", ["Mine"], folder)]
    assert len(layout_of(folder / f"{folder.name}.rrd")) > 2, "the recording itself stays"
    result = CliRunner().invoke(app, ["view", "rerun://127.0.0.1:1", "--layout", str(layout)])
    assert result.exit_code == 2 and "address of a catalog" in result.stderr


def test_info_tells_what_a_recording_and_a_layout_are(layout: Path, recording: Path, tmp_path: Path) -> None:
    facts = describe(recording).facts
    assert facts["size"].startswith(f"{recording.stat().st_size} bytes")
    assert facts["written by"].startswith(f"Rerun {rerun_version()};")
    assert facts["tabs"].split(", ")[:2] == ["Overview", "Data quality"]
    assert facts["timelines"].startswith("flight_time 0.0 s to 2") and "; utc 2026-" in facts["timelines"]
    entities = {*Contents(recording).batches, *Contents(recording).fixed}
    assert facts["entities"].startswith(f"{sum(not one.startswith('/__') for one in entities)} (")
    told = CliRunner().invoke(app, ["info", str(layout)])
    assert told.exit_code == 0 and "Rerun layout" in told.stdout and "Mine" in told.stdout
    cut = tmp_path / "cut.rrd"
    cut.write_bytes(recording.read_bytes()[:100_000])
    with pytest.raises(GroundstationError, match="damaged"):
        describe(cut)


def test_the_pages_name_every_tab_and_the_beginning_of_every_entity_path(recording: Path) -> None:
    found = importlib.util.spec_from_file_location("recording_page", ROOT / "docs" / "site" / "recording_page.py")
    assert found is not None and found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    listed = module.recording_page({"example": recording})
    told = (ROOT / "docs" / "recording.md").read_text(encoding="utf-8")
    contents = Contents(recording)
    firsts = {path.split("/")[1] for path in {*contents.batches, *contents.fixed}} - {"__properties"}
    for tab in layout_of(recording):
        assert f"## {tab.name}\n" in listed and f"| {tab.name} |" in told, tab.name
    assert [one for one in firsts if f"`/{one}/" not in listed] == []
    assert [one for one in firsts if f"`{one}`" not in told and f"`{one}/<" not in told] == []
