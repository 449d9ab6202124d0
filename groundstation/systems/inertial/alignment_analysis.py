"""Alignment and shutdown of an INS as an analysis."""

from typing import TYPE_CHECKING

from groundstation.results.answer import Answers, answer_of
from groundstation.results.columns import AnswerColumn
from groundstation.systems.analysis import Analysis, Found, RestsOn, main_numbers
from groundstation.systems.inertial.alignment_answer import GroundResult
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.known import Known

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

FIELDS = ("velocity_north_mps", "velocity_east_mps", "mode")


def _run(flight: "Flight", known: Known, settings: InertialSettings) -> Found[GroundResult]:
    from groundstation.systems.inertial.alignment_findings import assess_ground

    return Found(*assess_ground(flight, known, settings))


def _applies(flight: "Flight", known: Known) -> bool:
    from groundstation.systems.inertial.alignment import is_alone

    return is_alone(flight, known)


def _is_expected(_flight: "Flight", _known: Known) -> bool:
    return False


def _rests_on(_flight: "Flight", result: GroundResult) -> RestsOn | None:
    spans = [
        (one.start_s, one.end_s)
        for one in (result.alignment, result.standing, result.shutdown)
        if one is not None and one.start_s is not None and one.end_s is not None
    ]
    return RestsOn((result.ins_topic,), FIELDS, tuple(spans)) if spans else None


def _sentence(answers: Answers) -> str:
    found = answer_of(answers, GroundResult)
    if found is None:
        return ""
    told = []
    if found.alignment.is_moved and found.alignment.kind != "in_motion":
        told.append("moved while it aligned")
    if found.standing is not None and found.standing.is_above:
        told.append(f"drifts {found.standing.size_mps_per_min.value:.2f} m/s per min while standing")
    return f"INS {', '.join(told)}" if told else ""


GROUND = Analysis(
    name="ins_ground",
    title="alignment, drift while standing, shutdown and alignments between of the INS",
    subject="alignment and shutdown",
    needs="ins velocities; its mode and GNSS tell more",
    settings=InertialSettings,
    answer=GroundResult,
    run=_run,
    table="inertial",
    builds_on=("inertial", "trajectory"),
    applies=_applies,
    is_expected=_is_expected,
    rests_on=_rests_on,
    sentence=_sentence,
    columns=(
        AnswerColumn(
            "alignment_kind",
            "category",
            "how the INS was aligned: gyrocompass, stored_heading, in_motion, gnss_aided, unknown",
            lambda ground: ground.alignment.kind,
            is_indexed=False,
        ),
        AnswerColumn(
            "standing_drift_mps_per_min",
            "number",
            "drift of the ground speed while standing after the alignment",
            lambda ground: None if ground.standing is None else ground.standing.size_mps_per_min.value,
            is_indexed=False,
        ),
        AnswerColumn(
            "residual_speed_mps",
            "number",
            "ground speed of the INS while parked at the end",
            lambda ground: (
                None if ground.shutdown.residual_speed_mps is None else ground.shutdown.residual_speed_mps.value
            ),
            is_indexed=False,
        ),
    ),
    is_main=main_numbers(r"alignment\.kind|standing\.size_mps_per_min\.value|shutdown\.[^.]+\.value"),
)
