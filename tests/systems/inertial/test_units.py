"""Several INS of one flight: which one is off, by what, and what is no fault."""

import math
from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.systems.inertial.study import units_limits as study
from groundstation.systems.inertial.units import judge_units
from groundstation.systems.inertial.units_answer import UnitsResult
from groundstation.systems.inertial.units_chapter import units as chapter
from groundstation.systems.inertial.units_faults import held_spans
from groundstation.systems.inertial.units_grid import on_grid
from groundstation.systems.inertial.units_growth import Noise, growth_of
from groundstation.systems.inertial.units_limits import limits_of
from groundstation.systems.inertial.units_log import serials_of
from groundstation.systems.inertial.units_track import ReferenceTrack, UnitTrack
from tests.report_example import example
from tests.section_contents import facts, notes, rows
from tests.systems.inertial.units_example import (
    Change,
    Errors,
    drift_of,
    gnss,
    kicked,
    stepped,
    still,
    stuck,
    swapped,
    tilt_of,
    unit,
    units,
    without_position,
)


def kinds(found: UnitsResult) -> dict[tuple[str, ...], set[str]]:
    return {one.topics: {other.kind for other in found.faults if other.topics == one.topics} for one in found.faults}


@pytest.mark.parametrize("number", [2, 3])
@pytest.mark.parametrize("has_gnss", [True, False])
def test_honest_units_agree(number: int, has_gnss: bool) -> None:
    found = judge_units(units(number, known=has_gnss), gnss() if has_gnss else None)
    assert (found.verdict, found.off, found.faults) == ("agree", (), ())
    assert [one.state for one in found.units] == ["good"] * number
    assert len(found.pairs) == number * (number - 1) // 2 and not any(one.is_beyond for one in found.pairs)


@pytest.mark.parametrize(
    ("bad", "kind"),
    [(drift_of(0.3), "drift"), (tilt_of(1200.0), "tilt"), (stepped(300.0), "step"), (kicked(2.0), "step")],
)
def test_errors_of_one_of_three_are_named_with_and_without_gnss(bad: Errors, kind: str) -> None:
    for reference in (gnss(), None):
        found = judge_units(units(3, bad=bad), reference)
        assert found.verdict == "off" and found.off == ("ins.1",), found.sentence
        assert kinds(found) == {("ins.1",): {kind}}
        assert found.sentence.startswith("ins.1 is off: ")


@pytest.mark.parametrize(("change", "kind"), [(swapped, "swapped_axis"), (stuck, "stuck"), (still, "frozen")])
@pytest.mark.parametrize("number", [2, 3])
def test_a_unit_that_contradicts_itself_is_named_even_of_two(change: Change, kind: str, number: int) -> None:
    found = judge_units(units(number, change=change), None)
    assert kinds(found) == {("ins.1",): {kind}}, found.sentence


def turned(one: UnitTrack, degrees: float = 0.6) -> UnitTrack:
    assert one.heading_deg is not None
    return replace(one, heading_deg=(one.heading_deg + degrees) % 360.0)


@pytest.mark.parametrize("reference", [gnss(), None])
def test_a_heading_that_stands_apart_is_named_of_three_and_one_of_two(reference: ReferenceTrack | None) -> None:
    found = judge_units(units(3, change=turned), reference)
    (fault,) = found.faults
    assert (found.verdict, found.off, fault.kind, fault.unit) == ("off", ("ins.1",), "heading", "deg")
    assert fault.value == pytest.approx(0.6, abs=0.1) and fault.limit is not None and fault.limit < 0.4
    assert found.sentence.startswith("ins.1 is off: heading +0.6") and "by parity of three units" in found.sentence
    assert [pair.is_beyond for pair in found.pairs] == [True, False, True]
    two = judge_units(units(2, change=turned), reference)
    assert (two.verdict, two.off) == ("one_of", ("ins", "ins.1")) and "headings 0.6" in two.sentence
    assert not judge_units(units(2, change=lambda one: turned(one, 0.1)), reference).faults


def test_a_unit_of_a_lesser_class_is_held_against_its_own_limits() -> None:
    bad = units(2, bad=drift_of(1.0))
    assert judge_units(bad, gnss()).off == ("ins.1",)
    stated = judge_units([bad[0], replace(bad[1], ins_class="tactical")], gnss())
    assert stated.verdict == "agree" and [one.ins_class for one in stated.units] == ["navigation", "tactical"]
    limits = [
        limits_of(name, stated.pairs[0].hours, is_start_known=stated.pairs[0].is_start_known)
        for name in ("navigation", "tactical")
    ]
    both = [one.pair.rate_nmiph for one in limits if one is not None]
    assert stated.pairs[0].rate_limit_nmiph == pytest.approx(math.sqrt((both[0] ** 2 + both[1] ** 2) / 2.0))
    section = chapter(example(stated))
    assert section is not None and "classes navigation and tactical (each its own)" in str(section)


def test_rounding_of_the_outputs_is_the_interval_of_a_pair() -> None:
    def coarse(one: UnitTrack) -> UnitTrack:
        return replace(one, velocity_mps=np.round(one.velocity_mps / 0.064) * 0.064)

    fine, rough = (judge_units(units(2, change=change), None).pairs[0] for change in (lambda one: one, coarse))
    assert fine.velocity_rms_mps is not None and rough.velocity_rms_mps is not None
    assert fine.velocity_rms_mps.half95 < rough.velocity_rms_mps.half95
    assert abs(fine.velocity_rms_mps.value - rough.velocity_rms_mps.value) < rough.velocity_rms_mps.half95


def test_two_units_that_differ_are_one_of_the_two_until_gnss_tells() -> None:
    bad = units(2, bad=drift_of(0.3))
    alone = judge_units(bad, None)
    assert alone.verdict == "one_of" and alone.off == ("ins", "ins.1")
    assert [one.state for one in alone.units] == ["one_of", "one_of"]
    assert "one of ins and ins.1 is off" in alone.sentence
    assert judge_units(bad, gnss()).off == ("ins.1",)


def test_steps_have_their_size_inside_their_interval() -> None:
    for metres in (100.0, 1000.0):
        (fault,) = judge_units(units(2, bad=stepped(metres)), None).faults
        assert fault.start_s == pytest.approx(2000.0, abs=1.0) and fault.unit == "m"
        assert fault.value is not None and fault.value == pytest.approx(metres, abs=0.5)


@pytest.mark.slow
@pytest.mark.parametrize(("late_s", "ppm"), [(5.0, 0.0), (-0.5, 0.0), (0.0, 300.0)])
def test_clocks_that_differ_are_told_and_taken_off(late_s: float, ppm: float) -> None:
    def change(one: UnitTrack) -> UnitTrack:
        return replace(one, time_s=one.time_s * (1.0 + 1e-6 * ppm) + late_s)

    found = judge_units(units(3, change=change), gnss())
    late = found.unit("ins.1").lag_s
    assert late is not None and late.value == pytest.approx(late_s + 1e-6 * ppm * 1800.0, abs=0.02)
    assert found.verdict == "agree", found.sentence
    rate, plain = (judge_units(one, gnss()).unit("ins.1").rate_fit_nmiph for one in (units(3, change=change), units(3)))
    assert rate is not None and plain is not None and rate.value == pytest.approx(plain.value, abs=0.02)


def test_a_unit_that_repeats_another_is_no_witness() -> None:
    made = units(2)
    twin = replace(made[0], topic="ins.2", time_s=made[0].time_s + 0.2)
    found = judge_units([*made, twin], None)
    assert found.unit("ins.2").same_as == "ins" and found.unit("ins.2").state == "copy"
    assert not found.against_copy(found.unit("ins.2")) and not found.against_copy(found.unit("ins.1"))
    bad = units(2, bad=drift_of(0.3))
    assert judge_units([*bad, twin], None).verdict == "one_of"  # two votes of one unit do not outvote the other


def test_what_speaks_against_a_copy_is_told() -> None:
    first = replace(units(1)[0], serials=((0.0, "A1"),))
    assert first.heading_deg is not None
    twin = replace(first, topic="ins.1", serials=((0.0, "B2"),), heading_deg=(first.heading_deg + 4.0) % 360.0)
    found = judge_units([first, twin], gnss())
    assert found.unit("ins.1").state == "copy"
    assert found.against_copy(found.unit("ins.1")) == (
        "its heading stands 4.0 deg apart",
        "it states another serial (B2, A1)",
    )
    section = chapter(example(found))
    assert section is not None and "ins.1 repeats position and velocity of ins, yet its heading" in notes(section)[1]
    assert rows(section, "Pairs")[0][1] == "○ ins.1 repeats ins"
    same = judge_units([first, replace(first, topic="ins.1")], gnss())
    assert not same.against_copy(same.unit("ins.1"))


def test_a_unit_that_gnss_corrects_is_never_the_good_one() -> None:
    made = units(2, bad=drift_of(0.3))
    aided = replace(unit("ins", (np.zeros((3600, 2)), np.zeros((3600, 2))), 5), kind="gnss_aided")
    alone = judge_units([aided, made[1]], None)
    assert alone.verdict == "not_judged" and alone.unit("ins").state == "aided"
    assert alone.pairs[0].why_not == "GNSS corrects ins"
    assert judge_units([aided, made[1]], gnss()).off == ("ins.1",)


def test_a_unit_without_position_is_compared_by_velocity() -> None:
    found = judge_units(units(2, change=without_position), gnss())
    assert found.verdict == "agree" and not found.unit("ins.1").has_position
    assert found.unit("ins.1").rate_fit_nmiph is None and found.unit("ins.1").velocity_rms_mps is not None
    bad = units(3, bad=tilt_of(1200.0), change=without_position)
    assert judge_units(bad, None).off == ("ins.1",)


def test_a_receiver_that_jumps_is_not_taken_for_a_unit() -> None:
    reference = gnss()
    velocity = reference.velocity_mps.copy()
    velocity[1500:] += 3.0
    found = judge_units(units(2), replace(reference, velocity_mps=velocity))
    assert not [one for one in found.faults if one.kind == "step"], found.sentence


def test_units_that_agree_with_each_other_put_the_reference_in_doubt() -> None:
    reference = gnss()
    away = np.rad2deg(drift_of(0.5)[0][:, 0] / 6.371e6)
    found = judge_units(units(3), replace(reference, latitude_deg=reference.latitude_deg + away))
    assert found.is_common and not found.off and "the reference, or what they share, is wrong" in found.sentence
    assert not judge_units(units(3, bad=drift_of(0.5)), gnss()).is_common


def test_rate_of_a_unit_is_that_of_its_errors() -> None:
    position, velocity = drift_of(0.05)
    growth = growth_of(np.arange(3600.0), position, velocity, Noise(3.0, 0.02, 300.0, 60.0))
    assert growth is not None and growth.rate_nmiph is not None
    hours, nmi = np.arange(3600.0) / 3600.0, np.hypot(*position.T) / 1852.0
    assert growth.rate_nmiph.value == pytest.approx(float(np.sum(hours * nmi) / np.sum(hours**2)), rel=2e-3)
    assert growth.is_drift and growth.schuler_mps is None


def test_amplitude_of_a_tilt_is_known_from_most_of_a_schuler_period_on() -> None:
    growth = growth_of(np.arange(9000.0), *tilt_of(200.0, 9000))
    assert growth is not None and growth.schuler_mps is not None and not growth.is_drift
    assert growth.schuler_mps.value == pytest.approx(9.8 * 5064.0 / 2.0 / np.pi * 200e-6, rel=5e-3)


def test_limits_are_the_quantiles_of_the_same_statistics() -> None:
    """The limits' own short way to a rate and a velocity gives what the analysis gives."""
    time_s = np.arange(0.0, 7300.0, 2.0)
    position, velocity = (np.repeat(part, 1, axis=0) for part in drift_of(0.02, 7300))
    errors = position[::2][: len(time_s)], velocity[::2][: len(time_s)], np.full(len(time_s), 0.1)
    told = study.statistics_of(time_s[:3650], tuple(part[:3650] for part in errors), 0.0, is_known=True)  # type: ignore[arg-type]
    rows = time_s <= 3600.0
    growth = growth_of(time_s[rows], errors[0][rows], errors[1][rows])
    assert growth is not None and growth.rate_nmiph is not None and growth.velocity_mps is not None
    place = study.HOURS.index(1.0)
    assert told[place, 0] == pytest.approx(growth.rate_nmiph.value, rel=0.01)
    assert told[place, 1] == pytest.approx(growth.velocity_mps.value, rel=0.01)


def test_limits_grow_with_ignorance_and_are_known_for_every_class() -> None:
    for name in study.CLASSES:
        known, unknown = (limits_of(name, 2.0, is_start_known=one) for one in (True, False))
        assert known is not None and unknown is not None
        assert known.pair.rate_nmiph > known.single.rate_nmiph > 0.0
        assert unknown.single.rate_nmiph > known.single.rate_nmiph
    assert limits_of("my own", 2.0, is_start_known=True) is None


def test_serials_that_change_in_flight() -> None:
    assert serials_of("") == ()
    assert serials_of("A1, B2 from 900.5 s") == ((0.0, "A1"), (900.5, "B2"))


def test_too_little_is_a_reason() -> None:
    made = units(2)
    with pytest.raises(NotAssessableError, match="1 INS with samples"):
        judge_units(made[:1])
    short = [replace(one, **{name: getattr(one, name)[:60] for name in _ROWS}) for one in made]
    assert judge_units(short, gnss()).verdict == "not_judged"
    apart = [made[0], replace(made[1], time_s=made[1].time_s + 1e5)]
    with pytest.raises(NotAssessableError, match="no time of two INS together, expected at least 120 s"):
        judge_units(apart, None)


def test_units_of_a_short_log_are_not_judged_but_their_differences_are_told() -> None:
    """A parked aircraft, 0.25 s: the chapter said "found 0 s of two INS together" of units 100 m apart."""
    time_s = np.linspace(0.0, 0.25, 14)
    north = replace(
        units(1)[0],
        topic="ins.1",
        time_s=time_s,
        latitude_deg=np.full(14, 50.0),
        longitude_deg=np.full(14, 180.0),
        velocity_mps=np.zeros((14, 2)),
        heading_deg=np.full(14, 359.9),
    )
    later = time_s[3:9:5] + 0.004  # two samples: ten a second
    other = replace(
        north,
        topic="ins.2",
        time_s=later,
        latitude_deg=np.full(2, 50.0 + 105.0 / 111_229.0),  # metres of a degree of latitude there
        longitude_deg=np.full(2, -180.0),
        velocity_mps=np.zeros((2, 2)),
        heading_deg=np.array([0.3, 0.3]),
    )
    found = judge_units((north, other))
    assert (found.verdict, found.off, found.faults) == ("not_judged", (), ())
    (pair,) = found.pairs
    assert pair.heading_difference_deg is not None and pair.heading_difference_deg.value == pytest.approx(0.4)
    assert pair.largest_m is not None and pair.largest_m.value == pytest.approx(105.0, abs=0.1)
    assert pair.hours * 3600.0 == pytest.approx(later[1] - later[0])
    assert found.sentence == (
        "headings of ins.1 and ins.2 0.40 deg apart and positions of ins.1 and ins.2 105 m apart over 0.096 s "
        "together: at least 120 s are needed to judge them"
    )
    bare = replace(other, heading_deg=None, latitude_deg=np.full(2, np.nan))
    with pytest.raises(NotAssessableError, match=r"found 0\.096 s of two INS together"):
        judge_units((north, bare))


def test_the_chapter_says_which_message_feeds_each_unit() -> None:
    """Units of a bus are ins.1 and ins.2: only the source tells which one is which."""
    found = judge_units(units(2), None)
    first, second = (unit.topic for unit in found.units)
    results = example(found)
    mapped = Finding("info", "reader.mapped", f"{second} from EGI2_INERTIAL (RT 16 T SA 29) of BUS1553-4", second)
    other = Finding("info", "reader.mapped", f"{first}: true_heading_deg from the simulator's truth", first)
    section = chapter(replace(results, findings=(*results.findings, mapped, other)))
    assert section is not None
    assert facts(section, "Where the units come from") == {second: ("EGI2_INERTIAL (RT 16 T SA 29) of BUS1553-4", "")}
    assert "Where the units come from" not in str(chapter(results))


_ROWS = ("time_s", "latitude_deg", "longitude_deg", "velocity_mps", "heading_deg")


def test_a_velocity_that_stands_as_still_in_all_units_is_not_stuck() -> None:
    """Two units without noise, a straight drive in the middle: what is still there is the vehicle."""
    time_s = np.arange(600.0)
    east = np.where((time_s > 300.0) & (time_s < 320.0), 20.0, 20.0 + np.sin(0.3 * time_s))
    velocity = np.column_stack([0.5 * np.cos(0.2 * time_s), east])
    first = replace(
        units(1)[0],
        time_s=time_s,
        latitude_deg=50.0 + np.cumsum(velocity[:, 0]) / 111_000.0,
        longitude_deg=10.0 + np.cumsum(velocity[:, 1]) / 71_000.0,
        velocity_mps=velocity,
        heading_deg=None,
    )
    moving = replace(first, topic="ins.1", velocity_mps=velocity + 0.05 * np.sin(0.7 * time_s)[:, None])
    assert not held_spans(first, [on_grid(first, time_s)])
    assert [one.axes for one in held_spans(first, [on_grid(moving, time_s)])] == [(1,)]
