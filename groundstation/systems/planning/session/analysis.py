"""The plan of a session as one object."""

from groundstation.results.answer import Answers, answer_of
from groundstation.systems.plan import Plan, Planned
from groundstation.systems.planning.session.answer import UNCONTROLLED, ControlPlan
from groundstation.systems.planning.session.placement_answer import PlacementPlan
from groundstation.systems.planning.session.scenario import SessionPlan


def _run(scenario: SessionPlan) -> Planned:
    from groundstation.systems.planning.session.plan import plan_session  # compiles

    return plan_session(scenario)


def _sentence(answers: Answers) -> str:
    return "; ".join(filter(None, (_of_control(answers), _of_placement(answers))))


def _of_control(answers: Answers) -> str:
    answer = answer_of(answers, ControlPlan)
    if answer is None:
        return ""
    row = answer.law(answer.recommended)
    told = f"{answer.judged}: 2 sigma north {row.two_sigma_north_m:.1f} m, east {row.two_sigma_east_m:.1f} m at the end"
    if answer.recommended == UNCONTROLLED:
        return f"{told}, nothing controlled"
    before = answer.law(UNCONTROLLED)
    without = f"{before.two_sigma_north_m:.1f} m and {before.two_sigma_east_m:.1f} m without control"
    return f"{told} ({without}); law: {answer.recommended}"


def _of_placement(answers: Answers) -> str:
    answer = answer_of(answers, PlacementPlan)
    if answer is None:
        return ""
    row, places = answer.design(answer.recommended), answer.places_of(answer.recommended)
    placed = [one for one in places if one.is_placed]
    where = ", ".join(f"{one.point} {one.north_m:.0f} m north {one.east_m:.0f} m east" for one in placed)
    sigmas = f"{row.two_sigma_north_m:.1f}, {row.two_sigma_east_m:.1f}, {row.two_sigma_up_m:.1f} m"
    return f"{where}: 2 sigma north, east, up {sigmas} at the fixed point; design: {answer.recommended}"


SESSION_PLAN = Plan(
    name="session",
    title="how aircraft should move, and where ground points should stand, for the accuracy of one aircraft",
    scenario=SessionPlan,
    answers=(ControlPlan, PlacementPlan),
    run=_run,
    sentence=_sentence,
)
