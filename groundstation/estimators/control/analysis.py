"""The plan of a session as one object."""

from groundstation.estimators.control.scenario import SessionPlan
from groundstation.estimators.plan import Plan, Planned
from groundstation.results.answer import Answers, answer_of
from groundstation.results.control import UNCONTROLLED, ControlPlan


def _run(scenario: SessionPlan) -> Planned:
    from groundstation.estimators.control.plan import plan_session  # compiles

    return plan_session(scenario)


def _sentence(answers: Answers) -> str:
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


SESSION_PLAN = Plan(
    name="session",
    title="how aircraft should move for the accuracy of one of them, by ranges between them",
    scenario=SessionPlan,
    answers=(ControlPlan,),
    run=_run,
    sentence=_sentence,
)
