"""The plan of a landing by ranges as one object."""

from groundstation.base.findings import Finding
from groundstation.estimators.landing_ranges.scenario import RangeApproach
from groundstation.estimators.plan import Plan, Planned
from groundstation.results.answer import Answers, answer_of
from groundstation.results.landing_categories import CATEGORIES
from groundstation.results.landing_ranges import ALL_AXES, HONEST, TOUCHDOWN, RangeLanding


def _run(scenario: RangeApproach) -> Planned:
    from groundstation.estimators.landing_ranges.answer import range_landing  # compiles

    answer = range_landing(scenario)
    return Planned({answer.analysis: answer}, scenario.path.duration_s, _findings(answer))


def _findings(answer: RangeLanding) -> tuple[Finding, ...]:
    """A warning where simulated approaches contradict the filter, and where no category is met at touchdown."""
    found = []
    wrong = [row for row in answer.trials if row.filter == HONEST and row.nees > row.nees_high]
    if wrong:
        places = ", ".join(f"{row.before_threshold_m:.0f}" for row in wrong)
        text = f"errors of {answer.trial_count} simulated approaches exceed the computed sigmas {places} m before the "
        found.append(
            Finding("warn", "landing_ranges.overconfident", f"{text}threshold: geometry too weak for the filter")
        )
    if not answer.at(TOUCHDOWN).category:
        found.append(Finding("info", "landing_ranges.no_category", "no category's accuracy is met at touchdown"))
    return tuple(found)


def _sentence(answers: Answers) -> str:
    answer = answer_of(answers, RangeLanding)
    if answer is None:
        return ""
    row = answer.at(TOUCHDOWN)
    told = (
        f"touchdown, 95 %: lateral {row.lateral_95_m:.1f} m, horizontal {row.horizontal_95_m:.1f} m, vertical "
        f"{row.vertical_95_m:.1f} m: {row.category or 'no category'}"
    )
    return f"{told}; accuracy {where_met(answer)}"


def where_met(answer: RangeLanding) -> str:
    """Where each category's accuracy is met in all axes, in words."""
    told = []
    for category in CATEGORIES:
        spans = [one for one in answer.spans if one.category == category.name and one.axis == ALL_AXES]
        where = ", ".join(f"{one.from_before_threshold_m:.0f} to {one.to_before_threshold_m:.0f} m" for one in spans)
        told.append(f"{category.name} {where or 'nowhere'}")
    return f"{'; '.join(told)} (distance before the threshold)"


LANDING_PLAN = Plan(
    name="landing",
    title="which category's accuracy an approach by ranges meets, and where",
    scenario=RangeApproach,
    answers=(RangeLanding,),
    run=_run,
    sentence=_sentence,
)
