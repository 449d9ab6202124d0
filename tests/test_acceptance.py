"""Acceptance: errors of flights against limits, the confidence of the claim, what is left out, pages and exit codes."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from groundstation.base.errors import SettingsError, UsageError
from groundstation.base.findings import Finding
from groundstation.chapters.acceptance import sections
from groundstation.chapters.acceptance_front import front
from groundstation.chapters.parts import Grid
from groundstation.cli.main import app
from groundstation.methods.fleet.acceptance import CORRELATION_CONFIDENCE, judge
from groundstation.methods.fleet.confidence import (
    correlation_within,
    effective_flights,
    flights_needed,
    order_bound,
    share_low,
)
from groundstation.methods.fleet.ins_errors import growth_of, ins_errors
from groundstation.pipeline.verbs.acceptance import STANDARDS, accept, accept_to, read_standard
from groundstation.results.acceptance import ENSEMBLE, UNKNOWN_INS, AcceptanceLimit, Bound, FlightError, Standard
from tests.acceptance_example import save_fleet, save_flight

LIMIT = AcceptanceLimit("rate", "Rate", (Bound("radial_rate_fit_nmiph", 2.0),))


def flights_of(rates: list[float], units: list[str] | None = None, hours: float = 3.0) -> list[FlightError]:
    units = units or [f"S-{place}" for place in range(len(rates))]
    return [
        FlightError(
            str(place), unit, "A", "", None, "", f"{place}", "", hours=hours, values={"radial_rate_fit_nmiph": rate}
        )
        for place, (rate, unit) in enumerate(zip(rates, units, strict=True))
    ]


def test_59_flights_with_none_over_are_enough_and_58_are_not() -> None:
    """Order statistics: 1 - 0.95^59 = 0.9515, 1 - 0.95^58 = 0.9490."""
    enough = judge(flights_of([1.0] * 58 + [1.9]), LIMIT, Standard("s", "t"))
    assert enough.decision == "pass" and enough.share_bound == pytest.approx(0.95)
    assert enough.share_low == pytest.approx(0.05 ** (1 / 59), abs=1e-9)
    short = judge(flights_of([1.0] * 58), LIMIT, Standard("s", "t"))
    assert short.decision == "not enough flights" and short.more_with_none_over == 1 and short.share_bound is None


def test_one_over_asks_for_93_and_many_over_fail() -> None:
    one = judge(flights_of([1.0] * 58 + [2.1]), LIMIT, Standard("s", "t"))
    assert (one.decision, one.over, one.more_with_none_over) == ("not enough flights", 1, 93 - 59)
    assert one.more_at_present_share is not None and one.more_at_present_share > one.more_with_none_over
    assert judge(flights_of([1.0] * 92 + [2.1]), LIMIT, Standard("s", "t")).decision == "pass"
    failed = judge(flights_of([1.0] * 14 + [2.1] * 6), LIMIT, Standard("s", "t"))
    assert failed.decision == "fail" and failed.more_at_present_share is None and failed.share_high < 0.95


def test_flights_of_one_ins_are_one_for_its_type_and_all_for_itself() -> None:
    flights = flights_of([1.0] * 70, ["S-1"] * 70)
    of_type = judge(flights, LIMIT, Standard("s", "t"))
    assert of_type.decision == "not enough flights" and of_type.effective_flights == pytest.approx(1.0)
    assert judge(flights, LIMIT, Standard("s", "t", claim="these")).decision == "pass"
    assert judge(flights, LIMIT, Standard("s", "t"), "S-1").decision == "pass"
    twice = flights_of([1.0] * 118, [f"S-{place // 2}" for place in range(118)])
    assert judge(twice, LIMIT, Standard("s", "t", claim="units")).effective_flights == pytest.approx(59.0)


def test_bound_of_the_share_and_the_decision_agree() -> None:
    """The order statistic lies within the limit where, and only where, the exact limit of the share passes it."""
    rng = np.random.default_rng(4)
    decisions = set()
    for _ in range(200):
        count = int(rng.integers(40, 200))
        units = [f"S-{one}" for one in rng.integers(0, max(count // 2, 1), count)]
        one = judge(flights_of(np.exp(0.35 * rng.normal(size=count)).tolist(), units), LIMIT, Standard("s", "t"))
        assert (one.decision == "pass") == (one.share_bound is not None and one.share_bound <= 1.0)
        decisions.add(one.decision)
    assert decisions >= {"pass", "not enough flights"}


def test_correlation_within_ins_is_found() -> None:
    rng = np.random.default_rng(7)
    units = [str(place // 8) for place in range(400)]
    for rho in (0.0, 0.4, 0.8):
        shared = np.sqrt(rho) * np.repeat(rng.normal(size=50), 8)
        values = shared + np.sqrt(1.0 - rho) * rng.normal(size=400)
        assert correlation_within(values, units, 0.5) == pytest.approx(rho, abs=0.12)
        assert correlation_within(values, units, 0.95) > correlation_within(values, units, 0.5) - 1e-12
    assert effective_flights(units, 0.4) == pytest.approx(400 / (1 + 7 * 0.4))
    assert (
        correlation_within(np.ones(3), ["a"] * 3, 0.9) == 1.0 and correlation_within(np.ones(2), ["a", "b"], 0.9) == 0.0
    )


def test_errors_of_a_flight_are_those_put_in() -> None:
    """Flying north-west over the date line: what lies along and across the track, and the slope of the error."""
    time = np.linspace(0.0, 7200.0, 721)
    latitude = 60.0 + 1e-3 * time
    west = np.cumsum(np.gradient(time) * 1e-3 / np.cos(np.deg2rad(latitude)))
    longitude = (184.0 - west + 180.0) % 360.0 - 180.0
    error = 1852.0 * 1.5 * time / 3600.0
    found = ins_errors(time, error / np.sqrt(2.0), error / np.sqrt(2.0), latitude, longitude)
    assert found is not None
    values = found.values()
    assert values["radial_rate_fit_nmiph"] == pytest.approx(1.5) and values["radial_final_nmi"] == pytest.approx(3.0)
    assert values["cross_largest_nmi"] == pytest.approx(3.0, rel=1e-3)
    assert values["along_largest_nmi"] == pytest.approx(0.0, abs=0.05)
    assert np.all(found.cross_nmi[1:] > 0.0)  # north-east is to the right of north-west
    growth = growth_of([found] * 3)
    assert growth.rate(growth.within(0.5)) == pytest.approx(1.5)
    assert growth.rate(growth.two_drms()) == pytest.approx(3.0)


def test_no_error_is_interpolated_across_a_long_gap_or_behind_the_end() -> None:
    time = np.arange(0.0, 7200.0, 10.0)
    error = np.where((time > 3000.0) & (time < 5000.0), np.nan, time)
    found = ins_errors(time, error, error, np.zeros(720), 0.002 * time)
    assert found is not None
    radial = growth_of([found]).radial_nmi[0]
    hours = growth_of([found]).hours
    assert np.isnan(radial[(hours > 3010 / 3600) & (hours < 4990 / 3600)]).all()
    assert np.isfinite(radial[hours < 2990 / 3600]).all()


def test_a_folder_is_accepted_and_what_does_not_count_says_why(tmp_path: Path) -> None:
    save_fleet(tmp_path, [0.5] * 59)
    save_flight(tmp_path, 70, 9.0, kind="gnss_aided")
    save_flight(tmp_path, 71, 9.0, hours=0.1)
    twin = save_flight(tmp_path, 72, 9.0)
    document = json.loads((twin / "summary.json").read_text())
    document["flight"]["source"]["sha256"] = f"{3:064x}"
    (twin / "summary.json").write_text(json.dumps(document))
    broken = save_flight(tmp_path, 73, 9.0)
    (broken / "summary.json").write_text("{")
    found = accept(tmp_path, "app-g")
    assert found.decision == "pass" and len(found.included) == 59
    reasons = [flight.reason for flight in found.flights if not flight.is_included]
    assert [
        any(word in reason for reason in reasons) for word in ("GNSS corrects", "less than 10 min", "cannot be read")
    ]
    assert sum(reason.startswith("the same log as") for reason in reasons) == 1
    whole = found.rows[0]
    assert whole.cep50_rate_nmiph == pytest.approx(0.5, rel=1e-6) and whole.hours == pytest.approx(177.0)
    assert whole.along95_nmi == pytest.approx(0.9, rel=1e-3) and whole.cross95_nmi == pytest.approx(1.2, rel=1e-3)
    assert whole.velocity_rms_mps == pytest.approx(0.25)
    ratio = found.judgements[0].accuracy_ratio  # 2 nmi/h over 3 h against 5 m of either axis
    assert ratio == pytest.approx(2.0 * 3.0 * 1852.0 / (2.4477 * 5.0), rel=1e-3)
    assert found.judgements[1].decision == "not flown" and "none flown" in " ".join(front(found).sentences)


@pytest.mark.parametrize(
    ("claim", "rates", "said"),
    [
        ("these", [0.5], "takes 59 flights; this 1 is 58 short"),
        ("these", [0.5] * 12, "takes 59 flights; these 12 are 47 short"),
        ("type", [0.5] * 12, "takes 59 flights; these 12 count as 1.0 and are 58 short"),
        ("these", [0.5] * 58 + [2.5], "takes 93 flights; these 59 are 34 short if none more is over"),
    ],
)
def test_a_page_says_how_many_flights_a_claim_takes_and_how_many_are_short(
    tmp_path: Path, claim: str, rates: list[float], said: str
) -> None:
    for number, rate in enumerate(rates):
        save_flight(tmp_path / "out", number, rate)
    path = tmp_path / "own.toml"
    path.write_text(
        f'title = "own"\nsource = "own"\nclaim = "{claim}"\n[[limits]]\nname = "rate"\ntitle = "Rate"\n'
        'bounds = [{ quantity = "radial_rate_fit_nmiph", at_most = 2.0 }]\n'
    )
    found = accept(tmp_path / "out", str(path))
    top = front(found)
    assert "claim on 95% of flights at 95% confidence takes" in top.headline
    assert said.partition(" if none")[0] in top.headline and said in " ".join(top.sentences)
    assert f"over, the largest {max(rates):g}\u202fnmi/h, wanted" in " ".join(top.sentences)
    (grid,) = (
        part for section in sections(found) for part in section.parts if getattr(part, "title", "") == "All flights"
    )
    assert isinstance(grid, Grid) and [head.title for head in grid.heads][:1] == ["Limit"]
    assert not [head.title for head in grid.heads if re.search(r"[a-z][A-Z]", head.title)], "a name of a class"


@pytest.mark.slow
def test_flights_of_unknown_ins_are_taken_as_of_one(tmp_path: Path) -> None:
    """Without serial and aircraft 60 flights may all be of one INS: they show nothing of its type."""
    for number in range(60):
        folder = save_flight(tmp_path, number, 0.5)
        document = json.loads((folder / "summary.json").read_text())
        document["flight"]["metadata"] = {}
        (folder / "summary.json").write_text(json.dumps(document))
    found = accept(tmp_path, "app-g")
    assert {flight.ins for flight in found.flights} == {UNKNOWN_INS}
    assert found.decision == "not enough flights" and found.judgements[0].effective_flights == pytest.approx(1.0)
    assert {one.ins for one in found.judgements} == {ENSEMBLE}, "nobody knows that they are of one"


def test_flights_of_which_a_figure_is_missing_are_told() -> None:
    slow = [replace(flight, values={}) for flight in flights_of([1.0] * 4)]
    one = judge([*flights_of([1.0] * 70), *slow], LIMIT, Standard("s", "t"))
    assert (one.flights, one.not_measured) == (70, 4)
    none = judge(slow, LIMIT, Standard("s", "t"))  # flown, and nothing is known of it: it must not pass beside others
    assert (none.decision, none.flights, none.more_with_none_over) == ("not enough flights", 0, 59)
    assert judge(slow, replace(LIMIT, hours_over=50.0), Standard("s", "t")).decision == "not flown"


def test_a_reset_of_the_ins_leaves_the_flight_out(tmp_path: Path) -> None:
    folder = save_flight(tmp_path, 1, 0.5)
    document = json.loads((folder / "summary.json").read_text())
    finding = Finding("warn", "inertial.ins_reset", "position set", "ins")
    document["findings"].append(
        {"severity": finding.severity, "code": finding.code, "text": finding.text} | {"topic": ""}
    )
    (folder / "summary.json").write_text(json.dumps(document))
    (flight,) = accept(tmp_path, "app-g").flights
    assert "set in flight" in flight.reason


def test_equal_folders_give_equal_pages(tmp_path: Path) -> None:
    for name in ("a", "b"):
        save_fleet(tmp_path / name, [0.5, 1.0, 2.5], ["S-1", "S-1", "S-2"])
        accept_to(tmp_path / name, "app-g", tmp_path / f"{name}-out")
    written = sorted(path.name for path in (tmp_path / "a-out").iterdir())
    assert written == [f"acceptance_app-g.{ending}" for ending in ("csv", "html", "json", "pdf")]
    for name in written:
        assert (tmp_path / "a-out" / name).read_bytes() == (tmp_path / "b-out" / name).read_bytes()
    page = (tmp_path / "a-out" / "acceptance_app-g.html").read_text()
    assert page.count("Signature</dt>") == 3 and "Verify them against the current CFR" in page


def test_exit_code_is_that_of_a_limit_reached_only_where_asked(tmp_path: Path) -> None:
    save_fleet(tmp_path, [3.0] * 6)
    run = CliRunner()
    call = ["report", str(tmp_path), "--standard", "app-g"]
    assert run.invoke(app, call).exit_code == 0
    assert run.invoke(app, [*call, "--fail-on", "fail"]).exit_code == 4
    (tmp_path / "few").mkdir()
    save_fleet(tmp_path / "few", [1.0])
    few = ["report", str(tmp_path / "few"), "--standard", "app-g", "--fail-on"]
    assert [run.invoke(app, [*few, level]).exit_code for level in ("fail", "warn")] == [0, 4]
    short = save_flight(tmp_path / "short", 1, 1.0, hours=0.05)  # no flight counts: nothing is shown
    none = ["report", str(short.parent), "--standard", "app-g", "--fail-on"]
    assert [run.invoke(app, [*none, level]).exit_code for level in ("fail", "warn")] == [0, 4]
    (short / "summary.json").write_text("{")
    ended = run.invoke(app, [*none, "none"])
    assert ended.exit_code == 1 and "cannot be read" in ended.stderr
    assert run.invoke(app, ["report", str(tmp_path), "--standard", "nothing"]).exit_code == 2
    assert run.invoke(app, ["report", str(tmp_path), "-o", str(tmp_path)]).exit_code == 2
    assert run.invoke(app, ["report", str(short), "--standard", "app-g"]).exit_code == 2  # one flight is no fleet
    assert run.invoke(app, [*call, "-o", str(short / "manifest.json")]).exit_code == 2


def test_standards_say_where_they_are_from(tmp_path: Path) -> None:
    for name in STANDARDS.names():
        standard, _ = read_standard(name)
        assert standard.source and standard.read and all(limit.paragraph for limit in standard.limits)
    file = tmp_path / "own.toml"
    file.write_text(
        'title = "own"\nsource = "s"\n[[limits]]\nname = "a"\ntitle = "a"\nbounds = [{quantity = "x", at_most = 1}]\n'
    )
    with pytest.raises(SettingsError, match="quantity"):
        read_standard(str(file))
    file.write_text(
        'title = "own"\nsource = "s"\n[[limits]]\nname = "a"\ntitle = "a"\nhours_over = 10\nhours_up_to = 2\n'
        'bounds = [{quantity = "radial_final_nmi", at_most = 1}]\n'
    )
    with pytest.raises(SettingsError, match="hours_up_to"):  # it would be for no flight, and decide nothing
        read_standard(str(file))
    with pytest.raises(UsageError, match="no results"):
        accept(tmp_path, "app-g")


def test_own_limits_in_the_layout_of_irig_261(tmp_path: Path) -> None:
    save_fleet(tmp_path, [0.5] * 4)
    file = tmp_path / "own.toml"
    limit = (
        '[[limits]]\nname = "v"\ntitle = "Velocity"\nbounds = [{quantity = "velocity_error_rms_mps", at_most = 1.0}]\n'
    )
    file.write_text(f'title = "Own"\nsource = "spec 7"\nlayout = "irig261"\naccuracy_ratio_min = 4.0\n{limit}')
    found = accept(tmp_path, str(file))
    assert [section.title for section in sections(found)][:3] == [
        "Introduction",
        "Test article description",
        "Test objective",
    ]
    assert found.judgements[0].accuracy_ratio == pytest.approx(1.0 / (2.4477 * 0.05), rel=1e-3)
    file.write_text(f'title = "Own"\nsource = "spec 7"\naccuracy_ratio_min = 40.0\n{limit}')
    assert all("accuracy ratio" in flight.reason for flight in accept(tmp_path, str(file)).flights)


@pytest.mark.slow
def test_a_type_that_just_misses_is_passed_by_one_in_twenty_at_most() -> None:
    """Exactly 95 % within: how often 95 % is claimed, flights of one INS correlated or not; and how often naively."""
    rng, limit, runs = np.random.default_rng(11), 1.6448536, 400
    for units, each, rho in ((60, 1, 0.0), (60, 2, 0.6), (20, 10, 0.3), (20, 10, 0.6), (3, 60, 0.3), (2, 100, 0.2)):
        names = [str(one) for one in np.repeat(np.arange(units), each)]
        passed = naive = 0
        for _ in range(runs):
            shared = np.sqrt(rho) * np.repeat(rng.normal(size=units), each)
            values = shared + np.sqrt(1.0 - rho) * rng.normal(size=units * each)
            over, count = int(np.sum(values > limit)), len(values)
            correlation = correlation_within(values, names, CORRELATION_CONFIDENCE)
            effective = effective_flights(names, correlation)
            passed += share_low(effective, over * effective / count, 0.95) >= 0.95
            naive += share_low(count, over, 0.95) >= 0.95
        assert passed / runs <= 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / runs), (units, each, rho)
        if rho >= 0.3 and each >= 10:
            assert naive / runs > 0.05, "flights taken as independent claim too much"


def test_flights_needed_agrees_with_the_order_statistic() -> None:
    for over in (0, 1, 5):
        needed = flights_needed(over, 0.9, 0.9)
        values = np.arange(float(needed))
        assert order_bound(values, needed, 0.9, 0.9) == float(needed - over - 1)
        assert order_bound(values[1:], needed - 1, 0.9, 0.9) != float(needed - over - 1)
