"""installations.json of a folder of flights: a function of the flights alone, told in their reports."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from groundstation.base.errors import SettingsError
from groundstation.base.serial import to_json
from groundstation.pipeline.many_flights.fleet.installations import refresh_installations, show_installation
from groundstation.pipeline.many_flights.fleet.publishing import write_beside
from groundstation.pipeline.many_flights.fleet.refresh import refresh
from groundstation.pipeline.many_flights.fleet.scan import scan
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration, installed_as
from groundstation.pipeline.verbs.rules import RulesTest, rules_test
from groundstation.reports.flight_report import REPORT, write_flight_report
from groundstation.results.files import load
from groundstation.results.gates import judged_gate
from groundstation.results.installations import INSTALLATIONS, Installations, installations_in, read_installations
from groundstation.results.schema import installations_schema
from groundstation.systems import systems
from groundstation.systems.heading.installation.answer import InstallationResult
from groundstation.systems.heading.installation.lesson import Stored, lesson_of
from groundstation.systems.heading.installation.series import answer_from
from groundstation.systems.heading.installation.settings import InstallationSettings
from groundstation.systems.inertial.answer import InertialResult
from tests.installation_example import heading_of, inertial_of, save_installed

SCHEMA_FILE = Path(__file__).parents[1] / "schemas" / "installations.schema.json"
DAYS = (1, 2, 3, 4, 5)


def learned(out: Path, remade: tuple[str, ...] = ()) -> bytes:
    found, unwritten = refresh(out)
    assert not unwritten
    refresh_installations(out, found, remade)
    return (out / INSTALLATIONS).read_bytes()


def fleet_in(out: Path, days: tuple[int, ...] = DAYS) -> Path:
    for day in days:
        save_installed(out, day, 0.3 + 0.01 * day)
    return out


def read(out: Path) -> Installations:
    return read_installations(out / INSTALLATIONS)


# A function of the flights


def test_same_flights_give_the_same_bytes_in_any_order(tmp_path: Path) -> None:
    forward = learned(fleet_in(tmp_path / "a"))
    assert learned(fleet_in(tmp_path / "b", DAYS[::-1])) == forward
    one_by_one = tmp_path / "c"
    for day in (3, 1, 5, 2, 4):
        save_installed(one_by_one, day, 0.3 + 0.01 * day)
        learned(one_by_one)
    assert learned(one_by_one) == forward


def test_a_flight_added_and_removed_leaves_no_trace(tmp_path: Path) -> None:
    before = learned(fleet_in(tmp_path))
    added = save_installed(tmp_path, 0, -0.4)
    between = learned(tmp_path)
    assert between != before
    shutil.rmtree(added)
    assert learned(tmp_path) == before


def test_a_flight_added_changes_later_ones_alone(tmp_path: Path) -> None:
    learned(fleet_in(tmp_path, (1, 2, 4, 5)))
    before = {one.lesson.flight_id: one.answer for one in read(tmp_path).installations[0].flights}
    save_installed(tmp_path, 3, -0.4)
    learned(tmp_path)
    after = {one.lesson.flight_id: one.answer for one in read(tmp_path).installations[0].flights}
    is_same = [after[name] == before[name] for name in sorted(before)]
    assert is_same == [True, True, False, False]


@pytest.mark.parametrize("spoiled", ["", "{", "[]", '{"format_version": 99}', '{"format_version": 1, "x": 2}'])
def test_a_damaged_file_is_made_again(tmp_path: Path, spoiled: str) -> None:
    before = learned(fleet_in(tmp_path))
    (tmp_path / INSTALLATIONS).write_text(spoiled, encoding="utf-8")
    assert learned(tmp_path) == before


def test_answers_of_another_method_are_made_again(tmp_path: Path) -> None:
    before = learned(fleet_in(tmp_path))
    document = json.loads(before)
    document["method_version"] = 0
    document["installations"][0]["flights"][-1]["answer"]["error_deg"] = 9.0
    (tmp_path / INSTALLATIONS).write_text(json.dumps(document), encoding="utf-8")
    assert learned(tmp_path) == before


def test_without_serials_there_is_no_file(tmp_path: Path) -> None:
    fleet_in(tmp_path)
    learned(tmp_path)
    for day in DAYS:
        save_installed(tmp_path, day, 0.3, serial="")
    refresh_installations(tmp_path, refresh(tmp_path)[0], ())
    assert not (tmp_path / INSTALLATIONS).exists()


def test_flights_without_utc_or_aircraft_are_listed_with_the_reason(tmp_path: Path) -> None:
    save_installed(tmp_path, 1)
    save_installed(tmp_path, 2, is_timed=False)
    save_installed(tmp_path, 3, aircraft="")
    save_installed(tmp_path, 4, serial="")
    learned(tmp_path)
    found = read(tmp_path)
    assert found.without_serial == 1 and len(found.installations) == 1
    assert [one.reason.partition(":")[0] for one in found.left_out] == ["no aircraft named", "no UTC"]


def test_file_obeys_its_schema_and_comes_back_equal(tmp_path: Path) -> None:
    document = json.loads(learned(fleet_in(tmp_path)))
    jsonschema.validate(document, json.loads(SCHEMA_FILE.read_text(encoding="utf-8")))
    assert to_json(read(tmp_path)) == document


def test_kept_schema_is_the_one_the_types_give() -> None:
    assert json.loads(SCHEMA_FILE.read_text(encoding="utf-8")) == installations_schema(), "run `make schemas`"


# What a flight stores is what it teaches


def stored(**changes: Any) -> Stored:
    plain = Stored("f", {"aircraft": "A1", "ins_serial": "S1"}, 1_777_874_400_000_000_000, {}, heading_of(0.3))
    return replace(plain, **changes)


def test_number_of_the_taxi_has_its_sideslip_again() -> None:
    """The answer alone was moved by the mean factor of the class; what teaches is the difference as measured."""
    lesson = lesson_of(stored())
    assert lesson.not_taught == ""
    assert lesson.number_deg == pytest.approx(0.3 + 0.108)
    assert lesson.crosswind_mps == pytest.approx(4.0)  # heading - track = factor x crosswind from the right
    assert lesson.factor * lesson.crosswind_mps == pytest.approx(0.108)
    assert lesson.crosswind_sigma_mps == pytest.approx(1.5)


def test_there_and_back_the_wind_has_gone() -> None:
    lesson = lesson_of(stored(heading=heading_of(0.3, mean_direction=(0.01, 0.02), sideslip_deg=0.0)))
    assert abs(lesson.crosswind_mps) < 0.1 and lesson.crosswind_sigma_mps < 0.05


def test_without_wind_the_ordinary_one_is_taken() -> None:
    lesson = lesson_of(stored(heading=heading_of(0.3, wind=None, sideslip_deg=None)))
    assert (lesson.number_deg, lesson.crosswind_mps) == (pytest.approx(0.3), 0.0)
    assert lesson.crosswind_sigma_mps == pytest.approx(3.6)


def test_aircraft_file_stands_above_the_log() -> None:
    lesson = lesson_of(stored(stated={"ins_serial": "S9", "ins_alignment": "gyrocompass"}))
    assert (lesson.ins_serial, lesson.alignment_sigma_deg) == ("S9", 0.1)


def test_stated_mounting_and_sideslip_are_the_prior() -> None:
    settings: dict[str, float | str | bool] = {
        "aircraft.mounting_deg": 0.5,
        "aircraft.mounting_sigma_deg": 0.02,
        "aircraft.steady_sideslip_sigma_deg": 0.3,
        "aircraft.sideslip_sigma_deg": 0.4,
    }
    lesson = lesson_of(stored(heading=heading_of(0.3, settings=settings)))
    assert lesson.prior == pytest.approx((0.027, 0.04, 0.3, 0.5, 0.02))


def test_azimuth_of_the_first_hour_is_carried_back_to_the_taxi() -> None:
    inertial = replace(inertial_of(0.2), ins_topic="ins")
    lesson = lesson_of(stored(turns=inertial))
    assert lesson.azimuth_deg == pytest.approx(0.2) and lesson.azimuth_sigma_deg == pytest.approx(0.0303, abs=1e-4)


@pytest.mark.parametrize(
    "changes",
    [
        {"findings": frozenset({"inertial.realigned"})},
        {"turns": replace(inertial_of(0.2), ins_topic="ins.2")},
        {"turns": replace(inertial_of(None), ins_topic="ins")},
        {"heading": heading_of(0.3, reference_time_s=9000.0)},
    ],
)
def test_azimuth_of_another_alignment_unit_or_time_is_not_used(changes: dict[str, Any]) -> None:
    base: dict[str, Any] = {"turns": replace(inertial_of(0.2), ins_topic="ins")}
    assert lesson_of(stored(**(base | changes))).azimuth_deg is None


@pytest.mark.parametrize("gate, teaches", [("standstill_speed_of_mean", True), ("steps", False), ("segments", False)])
def test_rejected_taxi_teaches_only_where_its_interval_is_honest(gate: str, teaches: bool) -> None:
    gates = (judged_gate((None, 1.0), gate, gate, 2.0),)
    lesson = lesson_of(stored(heading=heading_of(0.3, gates=gates, verdict="reject")))
    assert lesson.teaches == teaches
    assert teaches or gate in lesson.not_taught


def test_uneven_power_is_of_its_flight_and_widens_that_alone() -> None:
    settings: dict[str, float | str | bool] = {"aircraft.taxi_power": "uneven", "uneven_power_sigma_deg": 0.3}
    even, uneven = lesson_of(stored()), lesson_of(stored(heading=heading_of(0.3, settings=settings)))
    assert uneven.taxi_sigma_deg == pytest.approx((even.taxi_sigma_deg**2 + 0.3**2) ** 0.5, abs=1e-4)
    assert uneven.steady_sigma_deg == even.steady_sigma_deg


def test_answer_of_an_older_version_says_so() -> None:
    assert "older version" in lesson_of(stored(heading=heading_of(0.3, mean_direction=None))).not_taught


@pytest.mark.parametrize("damage", [{"error_deg": float("nan")}, {"mean_direction": (1e300, 0.0)}])
def test_damaged_numbers_teach_nothing(damage: dict[str, Any]) -> None:
    heading = replace(heading_of(0.3), **damage)
    assert "missing" in lesson_of(stored(heading=heading)).not_taught


# Told


def test_reports_show_what_was_learned_and_stay_as_they_are(tmp_path: Path) -> None:
    fleet_in(tmp_path, (1, 2, 3))
    folders = sorted(path for path in tmp_path.iterdir() if path.name.startswith("2026"))
    for folder in folders:
        write_flight_report(folder, systems(), with_pdf=False)
    names = tuple(folder.name for folder in folders)
    learned(tmp_path, names)
    pages = [(folder / REPORT).read_text(encoding="utf-8") for folder in folders]
    assert "no earlier flight of this serial" in pages[0]
    assert "installation of serial S1 from 2 flights" in pages[2] and "With what 2 earlier flights" in pages[2]
    found = refresh(tmp_path)[0]
    assert refresh_installations(tmp_path, found, names) == []
    assert refresh_installations(tmp_path, found, ()) == []
    write_flight_report(folders[2], systems(), with_pdf=False)
    assert "S1 from 2 flights" not in (folders[2] / REPORT).read_text(encoding="utf-8")
    show_installation(folders[2])
    assert (folders[2] / REPORT).read_text(encoding="utf-8") == pages[2]


def test_a_page_left_behind_by_a_kill_is_filled_at_the_next_run(tmp_path: Path) -> None:
    fleet_in(tmp_path, (1, 2))
    for folder in sorted(tmp_path.iterdir()):
        write_flight_report(folder, systems(), with_pdf=False)
    found = refresh(tmp_path)[0]
    changed = refresh_installations(tmp_path, found, ())
    assert len(changed) == 2
    (tmp_path / INSTALLATIONS).unlink()  # it is written last
    assert refresh_installations(tmp_path, found, ()) == []
    assert (tmp_path / INSTALLATIONS).is_file()


def test_filled_reports_do_not_make_the_dataset_old(tmp_path: Path) -> None:
    fleet_in(tmp_path, (1, 2))
    for folder in sorted(tmp_path.iterdir()):
        write_flight_report(folder, systems(), with_pdf=False)
    assert write_beside(tmp_path, (), only_results=True) == ()
    assert scan(tmp_path).stale == ()


def test_page_of_all_has_the_installations(tmp_path: Path) -> None:
    assert write_beside(fleet_in(tmp_path), (), with_pdf=False) == ()
    page = (tmp_path / "summary.html").read_text(encoding="utf-8")
    assert "Installations" in page and "S1" in page


# One log by a file


def test_one_flight_by_the_file_has_the_answer_of_the_folder(tmp_path: Path) -> None:
    learned(fleet_in(tmp_path))
    found = read(tmp_path)
    last = found.installations[0].flights[-1]
    again = answer_from(replace(last.lesson, flight_id=""), found.lessons, InstallationSettings())
    assert to_json(replace(again, residual_deg=None)) == to_json(replace(last.answer, residual_deg=None))  # type: ignore[type-var]


@pytest.mark.parametrize("content", [None, "no JSON", "[1]", '{"format_version": 7}', '{"format_version": 1}'])
def test_a_file_that_is_none_is_refused_in_a_line(tmp_path: Path, content: str | None) -> None:
    path = tmp_path / INSTALLATIONS
    if content is not None:
        path.write_text(content, encoding="utf-8")
    if content == '{"format_version": 1}':
        assert installations_in(tmp_path) == Installations()
        return
    with pytest.raises(SettingsError) as caught:
        read_installations(path)
    assert "\n" not in str(caught.value) and INSTALLATIONS in str(caught.value)


def test_unaided_azimuth_needs_an_answer() -> None:
    assert isinstance(inertial_of(None), InertialResult)
    assert lesson_of(stored(turns=None)).azimuth_deg is None


# Other limits


def under(out: Path, text: str) -> RulesTest:
    file = out.with_suffix(".toml")
    file.write_text(text, encoding="utf-8")
    return rules_test(file, out)


def test_other_limits_show_both_answers(tmp_path: Path) -> None:
    out = tmp_path / "out"
    for day in (1, 2, 3):
        save_installed(out, day, 0.3, gates=(), verdict="accept")
    learned(out)
    unchanged = under(out, "")
    assert [row for row in unchanged.rows if "learned" in row.subject and row.gate] == []
    assert unchanged.judged == 5  # two of the three flights have learned something
    stricter = under(out, "[heading]\nwhole_half_width_max_deg = 0.01\n")
    mine = [row for row in stricter.rows if row.subject == "heading, installation learned"]
    assert [(row.verdict_before, row.verdict_after) for row in mine] == [("accept", "advisory")] * 2
    assert {row.gate for row in mine} == {"whole_half_width_learned"}


# From logs


def logs_in(folder: Path, days: tuple[int, ...]) -> list[Path]:
    """The shipped taxi log as flown on several days with one INS."""
    text = (Path(__file__).parents[1] / "sample_logs" / "taxi-good.csv").read_text(encoding="utf-8")
    folder.mkdir()
    found = []
    for day in days:
        dated = re.sub(r"# start_utc: \S+", f"# start_utc: 2026-05-{day:02d}T06:00:00Z", text, count=1)
        assert f"2026-05-{day:02d}" in dated
        found.append(folder / f"day{day}.csv")
        found[-1].write_text(f"# ins_serial: S1\n{dated}", encoding="utf-8")
    return found


@pytest.mark.slow
def test_logs_of_one_ins_learn_in_any_order_and_one_log_learns_from_the_file(tmp_path: Path) -> None:
    logs = logs_in(tmp_path / "logs", (1, 2, 3))
    once, twice = tmp_path / "once", tmp_path / "twice"
    outcomes = run_many(logs, once, Configuration(), jobs=1, only_results=True)
    run_many(logs[2:], twice, Configuration(), jobs=1, only_results=True)
    run_many(logs, twice, Configuration(), jobs=2, only_results=True)
    assert (once / INSTALLATIONS).read_bytes() == (twice / INSTALLATIONS).read_bytes()
    assert "nothing learned" in outcomes[0].text and "installation of S1 from 2 flights" in outcomes[2].text
    by_file = installed_as(Configuration(), once / INSTALLATIONS)
    (alone,) = run_many(logs[2:], tmp_path / "now", by_file, jobs=1, only_results=True)
    assert alone.text.count("installation of S1 from 2 flights") == 1 and "nothing learned" not in alone.text
    stored = load(Path(alone.folder), systems().answer_types).results.answer(InstallationResult)
    assert to_json(stored) == to_json(read(once).installations[0].flights[2].answer)
