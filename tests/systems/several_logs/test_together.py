"""Several logs of one flight in one MCAP: names, clocks, ledgers, refusals, sources, pages."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import UsageError
from groundstation.base.records import Column, RecordBatch
from groundstation.base.units import NS_PER_S
from groundstation.methods.overview import overview
from groundstation.methods.taxi.samples import HEADING_AND_VELOCITY
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import Converted, convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.join import join_files, join_logs
from groundstation.pipeline.one_flight.log import open_log
from groundstation.results.figures import numbers
from groundstation.results.files import load
from groundstation.store.reader import read
from groundstation.store.writer import StoreWriter
from groundstation.systems import systems
from groundstation.systems.joining import NotOneFlightError
from groundstation.systems.latency.signals import pairs_of
from groundstation.systems.several_logs.answer import Together
from groundstation.systems.several_logs.chapter import together as chapter
from groundstation.tables.motion import motion_of
from groundstation.tables.sources import TOGETHER, choose_pair, ranked, said_of, sources_of_kind, why_first
from groundstation.tables.table import Flight, Table
from tests.test_formats_agree import as_dataflash, as_ubx, as_ulog
from tests.test_verbs import groundstation

WITHIN_S = 0.02


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    as_ulog(folder / "a.ulg")
    as_ubx(folder / "b.ubx")
    as_dataflash(folder / "c.bin")
    return folder


@pytest.fixture(scope="module")
def joined(logs: Path) -> tuple[Converted, Flight]:
    target = logs / "joined.mcap"
    converted = join_logs([open_log(logs / name) for name in ("a.ulg", "b.ubx", "c.bin")], target)
    return converted, read_flight(target, converted)


def test_topics_of_later_logs_end_in_their_letter_and_nothing_is_lost(joined: tuple[Converted, Flight]) -> None:
    converted, flight = joined
    assert {"ins", "gnss", "gnss.b", "ins.b", "gnss.c", "ins.c"} <= set(flight.topics())
    assert len(flight["gnss"]) == len(flight["gnss.b"]) == len(flight["gnss.c"])
    assert set(converted.info.ledger.topics) == set(flight.topics())
    assert converted.info.source_name == "a.ulg + b.ubx + c.bin"
    assert "derived.ins.c.true_heading_deg" in flight.metadata
    assert said_of(flight, "ins.b", "ins_kind") == "gnss_aided"
    assert not said_of(flight, "ins", "ins_kind")


def test_logs_of_three_formats_are_joined_to_20_ms(joined: tuple[Converted, Flight]) -> None:
    _converted, flight = joined
    for label in "bc":
        error_s = (flight[f"gnss.{label}"].time_ns - flight["gnss"].time_ns) / NS_PER_S
        (log,) = (one for one in json.loads(flight.metadata[TOGETHER])["logs"] if one["label"] == label)
        half_s = max(one["largest_half_width95_s"] for one in log["stretches"])
        assert np.max(np.abs(error_s)) <= min(half_s, WITHIN_S)


def test_a_receivers_track_in_a_later_log_is_no_heading(logs: Path, tmp_path: Path) -> None:
    """What a reader says of a field goes with it under its new name; an INS of another log is used instead."""
    receiver = tmp_path / "receiver.mcap"
    info = convert_log(open_log(logs / "b.ubx"), receiver).info
    told = {**info.metadata, "heading_is_track.ins.true_heading_deg": "same in 9 of 9"}
    marked = tmp_path / "marked.mcap"
    with StoreWriter(marked, replace(info, metadata=told)) as writer:
        for item in read(receiver):
            if isinstance(item, RecordBatch):
                writer.write(item)
    for names in (("a.ulg", marked), (marked, "a.ulg")):
        target = tmp_path / "joined.mcap"
        flight = read_flight(target, join_logs([open_log(logs / name) for name in names], target))
        ins, other = ("ins", "ins.b") if names[0] == "a.ulg" else ("ins.b", "ins")
        assert f"heading_is_track.{other}.true_heading_deg" in flight.metadata
        assert choose_pair(flight, HEADING_AND_VELOCITY).ins == ins


def test_the_first_logs_times_and_values_are_as_without_the_others(
    joined: tuple[Converted, Flight], logs: Path
) -> None:
    alone = read_flight(logs / "alone.mcap", convert_log(open_log(logs / "a.ulg"), logs / "alone.mcap"))
    for topic in alone.topics():
        np.testing.assert_array_equal(joined[1][topic].time_ns, alone[topic].time_ns)
        for name, column in alone[topic].columns.items():
            np.testing.assert_array_equal(joined[1][topic].columns[name].values, column.values)


def test_damage_of_one_log_is_told_with_its_name_and_keeps_the_other(logs: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.ubx"
    cut.write_bytes((logs / "b.ubx").read_bytes()[:-31])
    found = join_logs([open_log(logs / "a.ulg"), open_log(cut)], tmp_path / "joined.mcap")
    assert found.has_lost_data
    assert any(damage.place.startswith("cut.ubx, ") for damage in found.info.ledger.damages)
    assert found.info.ledger.topics["gnss.b"].rows > 3_000


def test_a_log_that_cannot_be_read_is_left_out_and_told(logs: Path, tmp_path: Path) -> None:
    empty = tmp_path / "d.ulg"
    empty.write_bytes((logs / "a.ulg").read_bytes()[:16])
    found = join_logs([open_log(logs / "b.ubx"), open_log(empty)], tmp_path / "joined.mcap")
    assert found.has_lost_data
    assert found.findings[0].code == "together.unreadable"
    assert found.findings[0].text.startswith("d.ulg: log that is left out")
    assert found.info.ledger.loses_data


@pytest.mark.parametrize("content", [b"", b"nothing that a reader knows\n" * 9])
def test_an_empty_or_unknown_file_is_left_out_and_the_others_close_up(
    logs: Path, tmp_path: Path, content: bytes
) -> None:
    odd = tmp_path / "odd.xyz"
    odd.write_bytes(content)
    target = tmp_path / "joined.mcap"
    found = join_files([logs / "a.ulg", odd, logs / "b.ubx"], target, Configuration())
    assert found.has_lost_data
    assert (found.findings[0].code, found.findings[0].severity) == ("together.unreadable", "fail")
    assert found.findings[0].text.startswith("odd.xyz: log that is left out")
    assert {"gnss", "gnss.b"} <= set(found.info.ledger.topics)


def test_where_one_log_is_left_it_is_a_plain_run_that_says_what_is_left_out(logs: Path, tmp_path: Path) -> None:
    odd = tmp_path / "odd.xyz"
    odd.write_bytes(b"")
    out = tmp_path / "out"
    code, _out, _err = groundstation("run", str(odd), str(logs / "b.ubx"), "--together", "-o", str(out), "--no-pdf")
    assert code == 3
    (folder,) = (path for path in out.iterdir() if (path / "summary.json").exists())
    results = load(folder, systems().answer_types).results
    alone = convert_log(open_log(logs / "b.ubx"), tmp_path / "alone.mcap").info
    assert results.answer(Together) is None
    assert (results.source.name, results.source.sha256) == ("b.ubx", alone.source_sha256)
    assert results.findings[0].code == "together.unreadable"
    assert set(results.ledger.topics) == set(alone.ledger.topics)
    assert [one.text for one in results.findings if "left out" in one.text] == [results.findings[0].text]
    two = [str(odd), str(odd)]
    assert groundstation("convert", *two, "--together", "-o", str(tmp_path / "x.mcap"))[0] == 1


def test_the_same_log_twice_is_refused(logs: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"a\.ulg: found the same content as a\.ulg"):
        join_logs([open_log(logs / "a.ulg")] * 2, tmp_path / "x.mcap")


def test_logs_of_two_days_are_refused_in_a_line(logs: Path, tmp_path: Path) -> None:
    text = "\n".join(f"{second / 10},{second % 7 / 10},0,55.0,37.0" for second in range(600))
    names = "time_s,gnss.velocity_north_mps,gnss.velocity_east_mps,gnss.latitude_deg,gnss.longitude_deg"
    other = tmp_path / "other.csv"
    other.write_text(f"# start_utc: 2026-05-06T06:00:00Z\n{names}\n{text}\n", encoding="utf-8")
    with pytest.raises(NotOneFlightError, match="no time in common"):
        join_logs([open_log(logs / "a.ulg"), open_log(other)], tmp_path / "x.mcap")
    code, _out, _told = groundstation(
        "convert", str(logs / "a.ulg"), str(other), "--together", "-o", str(tmp_path / "y.mcap")
    )
    assert code == 1
    assert not (tmp_path / "y.mcap").exists()


def test_run_together_gives_one_flight_that_says_how(logs: Path, tmp_path: Path) -> None:
    paths = [str(logs / name) for name in ("a.ulg", "b.ubx")]
    code, out, _err = groundstation("run", *paths, "--together", "-o", str(tmp_path / "out"), "--no-pdf", "-v")
    assert code == 0
    assert "2 logs on one clock" in out
    (folder,) = (path for path in (tmp_path / "out").iterdir() if (path / "summary.json").exists())
    results = load(folder, systems().answer_types).results
    answer = results.answer(Together)
    assert answer is not None
    assert [log.source_name for log in answer.logs] == ["a.ulg", "b.ubx"]
    assert [one.topic for one in answer.sources] == ["ins", "gnss"]
    section = chapter(results)
    assert section is not None and section.claim is not None
    assert {figure.name for figure in results.figures} >= {"together_b_motion", "together_b_difference"}


def test_one_log_is_not_together(logs: Path, tmp_path: Path) -> None:
    code, _out, told = groundstation("run", str(logs / "a.ulg"), "--together", "-o", str(tmp_path / "out"))
    assert code == 2
    assert "2 to " in told


def table(topic: str, rate_hz: float, seconds: float = 100.0, **columns: np.ndarray | float | str) -> Table:
    time_ns = np.arange(0, round(seconds * NS_PER_S), round(NS_PER_S / rate_hz), dtype=np.int64)
    values = {name: Column(np.full(len(time_ns), value)) for name, value in columns.items()}
    return Table(topic, time_ns, values, np.arange(len(time_ns)), Column(time_ns))


def of_two_logs(*tables: Table) -> Flight:
    return Flight({one.topic: one for one in tables}, metadata={TOGETHER: "{}"})


VELOCITY = {"velocity_north_mps": 1.0, "velocity_east_mps": 1.0}
ATTITUDE = {"roll_deg": 0.0, "pitch_deg": 0.0}


@pytest.mark.parametrize(
    ("kind", "first", "second", "best", "why"),
    [
        ("gnss", table("gnss", 1, **VELOCITY), table("gnss.b", 5, **VELOCITY), "gnss.b", "5 Hz"),
        ("gnss", table("gnss", 5, latitude_deg=1.0), table("gnss.b", 1, **VELOCITY), "gnss.b", "no velocity"),
        ("gnss", table("gnss", 5, **VELOCITY), table("gnss.b", 10, 20.0, **VELOCITY), "gnss", "20 s of gnss.b"),
        (
            *("gnss", table("gnss", 5, velocity_sigma_mps=0.3, **VELOCITY)),
            *(table("gnss.b", 5, velocity_sigma_mps=0.03, **VELOCITY), "gnss.b", "0.03 m/s"),
        ),
        (
            "ins",
            table("ins", 50, mode="gnss_aided", **ATTITUDE),
            table("ins.b", 20, **ATTITUDE),
            "ins.b",
            "corrects ins",
        ),
        ("ins", table("ins", 20, **ATTITUDE), table("ins.b", 20, **ATTITUDE), "ins", "earlier log"),
    ],
)
def test_the_better_source_is_used(kind: str, first: Table, second: Table, best: str, why: str) -> None:
    flight = of_two_logs(first, second)
    assert sources_of_kind(flight, kind)[0] == best
    assert why in why_first(kind, ranked(flight, kind))
    assert sources_of_kind(replace(flight, metadata={}), kind) == (first.topic, second.topic)


def test_motion_overview_and_latency_take_the_long_log_though_the_first_is_short() -> None:
    position = {"latitude_deg": 40.0, "longitude_deg": -84.0}
    short = (table("ins", 10, 20.0, **VELOCITY, **ATTITUDE), table("gnss", 1, 20.0, **VELOCITY, **position))
    long = (table("ins.b", 10, **VELOCITY, **ATTITUDE), table("gnss.b", 1, **VELOCITY, **position))
    flight = of_two_logs(*short, *long)
    assert np.isfinite(motion_of(flight).speed_mps).mean() > 0.95
    shown = overview(flight, None, None)
    assert shown is not None and numbers(shown, "time_s")[-1] == 99.0
    assert pairs_of(flight)[0] == ("ins.b", "gnss.b", "velocity")


def test_a_configuration_may_set_the_limits() -> None:
    settings = Configuration({"together": {"arm_sigma_m": 0.5}}).settings.analyses["together"]
    assert settings.arm_sigma_m == 0.5


def test_a_profile_is_used_for_the_log_that_it_describes(tmp_path: Path) -> None:
    imu, gnss, settings = tmp_path / "imu.csv", tmp_path / "gnss.csv", tmp_path / "my.toml"
    head = "# start_utc: 2026-05-04T06:00:00Z\n"
    imu.write_text(head + "".join(f"{0.1 * k},{k % 7}\n" for k in range(300)), encoding="utf-8")
    rows = "".join(f"{k},{55 + 1e-4 * k},37,150\n" for k in range(30))
    gnss.write_text(f"{head}time_s,latitude_deg,longitude_deg,altitude_ellipsoid_m\n{rows}", encoding="utf-8")
    settings.write_text(
        'name = "p"\n[recognise]\nnames = ["t", "gz"]\n[time]\nkind = "seconds"\ncolumn = "t"\n'
        "[metadata.find]\nstart_utc = 'start_utc: (\\S+)'\n"
        '[columns]\ngz = { field = "imu.rate_z_dps", unit = "dps" }\n',
        encoding="utf-8",
    )
    target = tmp_path / "joined.mcap"
    converted = join_files([imu, gnss], target, Configuration(profile=str(settings)))
    flight = read_flight(target, converted)
    assert len(flight["imu"]) == 300 and len(flight["gnss.b"]) == 30
    assert flight.time_s("gnss.b")[0] == 0.0
