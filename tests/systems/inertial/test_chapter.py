"""Chapter of the INS errors: conclusions that follow from the numbers, and a text for whatever is not known."""

from dataclasses import replace
from typing import Any

import pytest

from groundstation.chapters.parts import Section
from groundstation.results.flight import NotAssessable
from groundstation.results.roles import AzimuthEstimate
from groundstation.systems.inertial.answer import ChannelResult, RealOutage
from groundstation.systems.inertial.chapter import inertial
from tests.report_example import example
from tests.section_contents import every_text, facts, grid, notes, row, rows, titles, tones
from tests.systems.inertial.example import AIDED, inertial_result
from tests.told import missing_in

FIGURES = "The INS in figures"


def chapter(**changes: Any) -> Section:
    """The chapter of the example, with some fields of its answer changed."""
    section = inertial(example(inertial_result(**changes)))
    assert section is not None
    return section


def test_everything_has_its_place() -> None:
    assert titles(chapter()) == [
        *("inertial.state position", "inertial.state velocity", "inertial.radial", "States", "Outages in the log"),
        *(FIGURES, "inertial.tilt_and_drift", "Consistency of the filter"),
        *("inertial.innovations", "inertial.observability", "Settings: [inertial]"),
    ]
    assert grid(chapter(), "States").numbers == ("inertial_states",)


def test_figures_asked_first_stand_first() -> None:
    section = chapter()
    assert section.headline.replace("\u202f", " ") == "Unaided INS, 0.37 nmi/h"
    figures = ("unaided", "0.37 nmi/h", "0.87 m/s RMS", "2140 m", "95.3% (north)", "95.3% (east)")
    assert not missing_in(notes(section)[0], *figures, "the filter is consistent")
    told = facts(section, FIGURES)
    assert told["Radial error rate, time-position fit"][0] == "0.37 nmi/h"
    assert told["Error over time, median / 95 % of the epochs"][0] == "0.41 nmi/h / 1.32 nmi/h"
    assert told["Velocity error, RMS"][0] == "0.870 m/s"
    assert told["Pair used"] == ("ins against gnss", "")
    assert told["Kind"] == ("unaided", "the position error grows to 2.1 km and swings with the Schuler period")
    assert told["INS class"] == ("navigation", "noise parameters: chosen by the spread of the velocity error")


def test_states_stand_with_sigma_and_observability() -> None:
    section = chapter()
    assert row(section, "States", "Platform tilt, arcsec") == ("+11.2", "1.5", "0.81", "10:00") * 2
    assert row(section, "States", "Random gyro drift, °/h") == ("+0.0021", "0.0040", "0.08", "never") * 2
    assert row(section, "Outages in the log", "2:40:00 – 3:01:20") == (
        *("GNSS", "21:20", "212 m", "260 m", "✓ within 2 σ"),
    )
    assert rows(section, "Outages in the log")[1][-1] == "○ GNSS did not return"


def test_a_return_far_from_the_forecast_is_marked() -> None:
    section = chapter(outages=(RealOutage(60.0, 120.0, 60.0, 19.0, 9.0),))
    assert row(section, "Outages in the log", "1:00 – 2:00")[-1] == "▲ beyond 2 σ"


@pytest.mark.parametrize(
    ("missing", "left", "returned"),
    [
        ("gnss", "GNSS", "GNSS did not return"),
        ("ins", "INS", "INS did not return"),
        ("both", "both", "neither returned"),
    ],
)
def test_an_outage_says_what_was_missing(missing: str, left: str, returned: str) -> None:
    outages = (RealOutage(60.0, 120.0, 60.0, 5.0, 9.0, missing), RealOutage(600.0, 660.0, 60.0, None, None, missing))
    assert rows(chapter(outages=outages), "Outages in the log") == [
        ("1:00 – 2:00", left, "1:00", "5 m", "9 m", "✓ within 2 σ"),
        ("10:00 – 11:00", left, "1:00", "—", "—", f"○ {returned}"),
    ]


def changed_states(name: str, **changes: float) -> dict[str, Any]:
    """Both channels with one state changed."""
    north, east = (
        replace(
            channel,
            states=tuple(replace(state, **changes) if state.name == name else state for state in channel.states),
        )
        for channel in inertial_result().channels
    )
    return {"north": north, "east": east, "settings": {"noise.drift_rate_dphph": 5e-6}}


def test_a_state_the_class_leaves_out_has_no_number() -> None:
    alone = changed_states("drift_rate", value=0.0, sigma=5e-6, observability=3e-6)
    assert row(chapter(**alone), "States", "Drift rate, °/h² (not estimated in this class)") == ("—",) * 8
    cells = row(
        chapter(**alone | {"east": inertial_result().east}),
        "States",
        "Drift rate, °/h² (north not estimated in this class)",
    )
    assert cells[:5] == ("—",) * 4 + ("+0.0029",)


@pytest.mark.parametrize(("sigma", "observability"), [(5e-6, 0.2), (4e-3, 3e-6)], ids=["seen", "grown"])
def test_a_state_that_was_seen_or_has_grown_keeps_its_number(sigma: float, observability: float) -> None:
    section = chapter(**changed_states("drift_rate", sigma=sigma, observability=observability))
    assert row(section, "States", "Drift rate, °/h²")[0] == "+0.0029"


def test_of_an_ins_of_unknown_kind_the_differences_are_told_and_what_it_was_judged_by() -> None:
    section = chapter(**{**AIDED, "kind": "unknown", "kind_reason": "it stood still all the time."})
    assert section.headline == "It is not known whether GNSS corrects this INS"
    assert notes(section)[0].startswith("It is not known whether GNSS corrects this INS: it stood still all the time. ")
    assert tones(section)[0] == "unknown" and "ins_kind" in notes(section)[0]
    assert not [text for text in every_text(section) if "naided INS" in text]
    assert "States" not in titles(section) and "INS − GNSS" in titles(section)


def test_of_an_aided_ins_the_differences_are_told_and_no_state() -> None:
    section = chapter(**AIDED)
    assert section.headline == "GNSS corrects this INS: within 3.0\u202fm of it (95 %)"
    assert section.claim is not None and section.claim.headline == section.headline
    assert [figure[:2] for figure in section.claim.figures] == [("INS − GNSS, position", "3.0\u202fm")]
    assert notes(section)[0].startswith(
        "GNSS corrects this INS already: its own mode says so. Errors that GNSS removes"
    )
    assert row(section, "INS − GNSS", "Position north, m") == ("+0.20", "1.00", "2.50", "9.00", "600")
    assert row(section, "Innovations of the INS's own filter", "Velocity east, m/s") == (
        *("−0.010", "0.100", "0.300", "0.200", "91.0%", "4.0%", "3000"),
    )
    assert not [part for part in section.parts if getattr(part, "title", "") in ("States", "Consistency of the filter")]


def test_reopening_and_other_ins_are_told() -> None:
    section = chapter(reopened=2, other_ins=("ins.1", "ins.2"))
    assert section.lead.endswith("Of several INS, this is ins.") and "several" not in chapter().lead
    assert chapter(**AIDED, other_ins=("ins.1",)).lead.endswith("Of several INS, this is ins.")
    assert not missing_in(notes(section)[1], "rejected GNSS", "opened again, 2 times", "INS class navigation")
    assert facts(section, FIGURES)["Pair used"][1] == "not used: ins.1, ins.2"
    assert facts(section, FIGURES)["Filter opened again"][0] == "2 times"
    assert "that it was opened again, once: " in notes(chapter(reopened=1))[1]
    assert not [note for note in notes(chapter()) if "was opened again" in note]


def test_settings_are_spelled_as_in_the_file_and_noise_of_the_class_stands_apart() -> None:
    settings: dict[str, float | str | bool] = {"transition": "exact", "noise.tilt_rad": 0.0002}
    section = chapter(settings=settings)
    assert facts(section, "Settings: [inertial]") == {"transition": ('"exact"', "")}
    assert facts(section, "Noise of the INS class") == {"tilt_rad": ("0.0002", "")}


def with_share(share: float, *, raised: bool) -> dict[str, Any]:
    """A pair of channels with a share of innovations inside their band."""

    def changed(channel: ChannelResult) -> ChannelResult:
        limits = (None, None) if raised else (channel.nis_low, channel.nis_high)
        return replace(channel, share_inside95=share, nis_low=limits[0], nis_high=limits[1])

    return {channel.name: changed(channel) for channel in inertial_result().channels}


@pytest.mark.parametrize(
    ("share", "raised", "tone", "verdict"),
    [
        (0.95, False, "good", "the filter is consistent"),
        (0.80, False, "warn", "the filter is overconfident"),
        (0.80, True, "warn", "the filter is overconfident"),
        (0.995, False, "warn", "the filter is too careful, its sigmas are too large"),
        (0.995, True, "plain", "this log does not test the σ of the filter"),
        (1.0, True, "plain", "this log does not test the σ of the filter"),
    ],
)
def test_conclusion_on_the_filter_follows_its_innovations(share: float, raised: bool, tone: str, verdict: str) -> None:
    section = chapter(**with_share(share, raised=raised))
    assert verdict in notes(section)[0]
    assert tones(section)[0] == tone
    assert ("of the innovations lie inside" in notes(section)[0]) == (not raised or share < 0.93)


def test_raised_noise_has_no_limits() -> None:
    (north, east) = rows(chapter(**with_share(0.99, raised=True)), "Consistency of the filter")
    assert north == ("North", "0.970", "noise raised", "99.0%", "15 210", "12", "0.610 m/s", "744 m")
    assert east[2] == "noise raised"
    assert rows(chapter(), "Consistency of the filter")[0][2] == "0.93 … 1.07"
    assert "neither NIS nor the share inside shows consistency" in grid(chapter(), "Consistency of the filter").caption


def test_azimuth_is_told_with_its_reason() -> None:
    assert not missing_in(notes(chapter())[-1], "Azimuth error", "+0.042° (σ 0.015°)", "seven turns, 410 m/s")
    section = chapter(azimuth=AzimuthEstimate(False, None, 0.4, 1, 20.0, "one turn is too little"))
    assert not missing_in(notes(section)[-1], "Azimuth error", "not observable", "one turn is too little")
    assert tones(section)[-1] == "unknown"


def test_a_reason_stands_in_place_of_the_answer() -> None:
    section = inertial(example(None, not_assessable=(NotAssessable("inertial", "GNSS for a minute only"),)))
    assert section is not None
    assert notes(section) == ["Not assessable: GNSS for a minute only"]


def test_without_answer_and_reason_there_is_no_chapter() -> None:
    assert inertial(example(None)) is None


def test_what_is_not_known_is_a_dash() -> None:
    unknown = float("nan")
    names = ("radial_error_rate_50_nmiph", "radial_error_rate_fit_nmiph", "velocity_error_rms_mps")
    rates = dict.fromkeys(names) | {"radial_error_rate_95_nmiph": unknown}
    channels = {channel.name: replace(channel, states=()) for channel in inertial_result().channels}
    bare = {"outages": (), "azimuth": None, "settings": {}, "figures": (), "largest_radial_error_m": None}
    section = chapter(**channels, **rates, **bare)
    assert section.headline == "Unaided INS"
    assert facts(section, FIGURES)["Error over time, median / 95 % of the epochs"][0] == "— / —"
    assert facts(section, FIGURES)["Largest radial error"][0] == "—"
    assert "States" not in titles(section) and "Outages in the log" not in titles(section)
    shown = " ".join(every_text(section))
    assert "nan" not in shown.lower().split() and "None" not in shown
