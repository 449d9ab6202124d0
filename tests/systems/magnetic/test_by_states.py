"""States of their own as reference of the deviation, where the INS is none or is less sure."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.chapter import magnetic
from groundstation.systems.magnetic.estimate import estimate_deviation
from groundstation.systems.magnetic.settings import MagneticSettings
from tests.made_states import BY, MadeStates, made_states
from tests.report_example import example
from tests.section_contents import every_text, facts
from tests.systems.magnetic.example import Made, make, taxi_heading

AIDED = {"ins": "gnss_aided"}
SIGMA_DEG = 0.2


def states(made: Made, sigma_deg: float = SIGMA_DEG, **changes: Any) -> MadeStates:
    """The attitude of a made flight as states, with a sigma of the heading."""
    ins = made.flight["ins"]
    columns = {name: np.array(ins.values(name)) for name in ("roll_deg", "pitch_deg", "true_heading_deg")}
    return MadeStates(made_states(made.flight.time_s("ins"), true_heading_sigma_deg=sigma_deg, **columns), **changes)


def estimated(made: Made, **options: Any) -> MagneticResult:
    return estimate_deviation(made.flight, phases=made.phases, **options)


@pytest.fixture(scope="module")
def true() -> Made:
    return make()


@pytest.fixture(scope="module")
def wrong() -> Made:
    """The same flight, its INS heading wrong by 3 deg."""
    return make(ins_error_deg=3.0)


def test_an_aided_ins_is_replaced_and_its_error_is_not_in_the_deviation(true: Made, wrong: Made) -> None:
    found = estimated(wrong, kinds=AIDED, states=states(true))
    source = found.alignment.source("states")
    assert source is not None and source.is_used and BY in found.alignment.origin
    assert found.alignment.sigma_deg == pytest.approx(np.hypot(SIGMA_DEG, MagneticSettings().mounting_sigma_deg))
    letters = [found.method("poisson_attitude").coefficients_deg[letter] for letter in "ABCDE"]
    assert letters == pytest.approx(true.coefficients_deg, abs=1e-3)
    assert any("no magnetometer is in them" in remark for remark in found.remarks)
    section = magnetic(example(found))
    assert section is not None and any(BY in text for text in every_text(section))
    assert facts(section, "Basis")["Sensors"][1] == "attitude and heading by the best trajectory, heading σ 0.22°"


def test_a_surer_ins_stays_and_gives_the_same_answer(true: Made) -> None:
    plain = estimated(true, heading=taxi_heading())
    beside = estimated(true, heading=taxi_heading(), states=states(true, sigma_deg=2.0))
    source = beside.alignment.source("states")
    assert source is not None and not source.is_used and plain.alignment.source("states") is None
    alike = replace(beside, figures=(), alignment=replace(beside.alignment, sources=plain.alignment.sources))
    assert alike == replace(plain, figures=())


def test_what_is_no_reference_or_not_wanted_is_not_used(true: Made) -> None:
    never = MagneticSettings(states_sigma_max_deg=0.0)
    for options in (
        {"states": states(true, is_good=False)},
        {"states": states(true), "settings": never},
        {"states": None},
    ):
        with pytest.raises(NotAssessableError, match="no independent reference"):
            estimated(true, kinds=AIDED, **options)
    with pytest.raises(NotAssessableError, match=r"sigma of 0\.22 deg, limit 0\.1"):
        estimated(true, kinds=AIDED, states=states(true), settings=MagneticSettings(states_sigma_max_deg=0.1))
    away = MadeStates(replace(states(true).states, time_s=states(true).states.time_s + 1e5))
    with pytest.raises(NotAssessableError, match="attitude of the best trajectory is known"):
        estimated(true, kinds=AIDED, states=away)
