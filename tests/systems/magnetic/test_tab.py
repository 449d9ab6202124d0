"""The tab Magnetic of the recording: values as they came, a reason where there is none."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.chapters.markdown import escaped, markdown
from groundstation.chapters.wording import number
from groundstation.results.answer import by_analysis
from groundstation.results.flight import NotAssessable
from groundstation.systems.magnetic.answer import ADVISORY, STEER_CARD, MagneticResult
from groundstation.systems.magnetic.chapter import magnetic
from tests.recording_contents import Contents
from tests.systems.magnetic.test_run import figure_eight, simulated
from tests.told import write_recording


@pytest.fixture(scope="module")
def contents(tmp_path_factory: pytest.TempPathFactory) -> Contents:
    path = tmp_path_factory.mktemp("recording") / "flight.rrd"
    flight = simulated("magnetic-eight").flight
    tables = {topic: table for topic, table in flight.tables.items() if topic == "magnetometer"}
    write_recording(path, replace(flight, tables=tables), figure_eight())
    return Contents(path)


def test_errors_and_modulus_are_those_of_the_result(contents: Contents) -> None:
    figures = {figure.name: figure for figure in figure_eight().figures}
    samples, modulus = figures["magnetic_samples"], figures["magnetic_modulus"]
    mine = samples["part"] == "held out"
    for part, column in (("d01_dots", "error_before_deg"), ("d02_dots", "error_poisson_attitude_deg")):
        shown = contents.scalars(f"/magnetic/held_out/error_of_magnetic_heading/{part}")[1].ravel()
        assert np.array_equal(shown, samples[column][mine])
    rows = contents.scalars("/magnetic/modulus/modulus_of_the_field/b00_lines")[1]
    known = np.isfinite(rows).all(axis=1)
    assert np.array_equal(rows[known][:, 0], modulus["before_nt"] / 1e3)


def test_field_lies_on_the_sphere_once_it_is_freed_of_the_iron() -> None:
    found = figure_eight()
    magnetic = found.answer(MagneticResult)
    assert magnetic is not None
    declination = magnetic.declination
    assert declination.horizontal_nt is not None and declination.down_nt is not None
    figure = next(figure for figure in found.figures if figure.name == "magnetic_field")
    strength = np.hypot(declination.horizontal_nt, declination.down_nt)
    before, after = (
        np.linalg.norm([figure[f"{state}_{axis}_nt"] for axis in ("forward", "right", "down")], axis=0) - strength
        for state in ("before", "after")
    )
    assert np.std(after) < 0.2 * np.std(before) and abs(np.mean(after)) < 60.0
    assert 1000 < len(before) <= 4000


def test_sphere_and_eight_are_in_the_tab(contents: Contents) -> None:
    assert {"/magnetic/field/model", "/magnetic/field/as_read", "/magnetic/field/freed_of_iron"} <= set(contents.fixed)
    assert {"/magnetic/track/north/00_curve", "/magnetic/track/north/axes/grid"} <= set(contents.fixed)
    assert "/magnetic/track/north/01_told/0" in contents.batches, "the aircraft moves along its track"


def test_text_holds_verdict_card_and_reasons(contents: Contents) -> None:
    found = figure_eight().answer(MagneticResult)
    assert found is not None
    text = contents.text("/magnetic/answer")
    assert text.startswith("# Magnetic deviation: accept\n")
    section = magnetic(figure_eight())
    assert section is not None
    assert text == markdown(section)
    assert escaped(ADVISORY) in text
    row = found.card[3]
    assert f"| 90° | {escaped(f'{row.steer_deg:.1f}°')} | {escaped(number(row.deviation_deg, 1, '°', True))} |" in text
    assert STEER_CARD not in text
    why = magnetic(replace(figure_eight(), answers={}, not_assessable=(NotAssessable("magnetic", "no | turns"),)))
    assert why is not None
    assert markdown(why).endswith("no \\| turns")


def test_with_empty_figures_the_tab_stands_and_without_a_result_there_is_none(tmp_path: Path) -> None:
    flight, results = simulated("magnetic-eight").flight, figure_eight()
    reason = (NotAssessable("magnetic", "no opposite turns"),)
    write_recording(tmp_path / "a.rrd", flight, replace(results, answers={}, figures=(), not_assessable=reason))
    found = results.answer(MagneticResult)
    assert found is not None
    bare = replace(results, answers=by_analysis(replace(found, figures=())), figures=())
    write_recording(tmp_path / "b.rrd", flight, bare)
    without = Contents(tmp_path / "a.rrd")
    assert "no opposite turns" in without.text("/summary") and "/magnetic/answer" not in without.fixed
    assert Contents(tmp_path / "b.rrd").text("/magnetic/answer").startswith("# Magnetic deviation: accept")
