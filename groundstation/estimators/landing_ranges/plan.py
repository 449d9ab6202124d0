"""The plan of a landing by ranges as one object."""

import numpy as np

from groundstation.base.findings import Finding
from groundstation.estimators.landing_ranges.scenario import RangeApproach
from groundstation.estimators.plan import Plan, Planned
from groundstation.results.answer import Answers, answer_of
from groundstation.results.landing_categories import CATEGORIES
from groundstation.results.landing_ranges import ALL_AXES, HONEST, TOUCHDOWN, RangeLanding

LEAST_WIDTH_M = 50.0  # of points that do not stand on one line; beside the course
OVERFLOWN_M = 100.0


def _run(scenario: RangeApproach) -> Planned:
    from groundstation.estimators.landing_ranges.answer import range_landing  # compiles

    answer = range_landing(scenario)
    findings = (*_of_places(scenario), *_findings(answer))
    return Planned({answer.analysis: answer}, scenario.path.duration_s, findings)


def _of_places(scenario: RangeApproach) -> tuple[Finding, ...]:
    """Warnings of places that no accuracy makes good: points on one line, and under the path."""
    found, points = list[Finding](), scenario.points
    if not points:
        return ()
    places = np.array([(point.before_threshold_m, point.right_m) for point in points])
    width_m = float(np.linalg.svd(places - places.mean(axis=0), compute_uv=False)[-1]) if len(points) > 2 else np.inf
    if np.abs(places[:, 1]).max() < LEAST_WIDTH_M:
        text = "all points are on the course line: no range separates right from left"
        found.append(Finding("warn", "landing_ranges.on_course", text))
    elif width_m < LEAST_WIDTH_M and scenario.moving is None:
        text = f"all points are within {width_m:.0f} m of one line: ranges show little across it"
        found.append(Finding("warn", "landing_ranges.on_one_line", text))
    slope = np.tan(np.deg2rad(scenario.path.glide_angle_deg))
    for point in points:
        is_under = 0.0 <= point.before_threshold_m <= scenario.path.start_m and abs(point.right_m) < LEAST_WIDTH_M
        below_m = scenario.path.threshold_height_m + slope * point.before_threshold_m - point.up_m
        if is_under and below_m < OVERFLOWN_M:
            text = f"{point.name} is under the path, {below_m:.0f} m below it: an obstacle, and hard to hear"
            found.append(Finding("warn", "landing_ranges.under_path", text))
    return tuple(found)


def _findings(answer: RangeLanding) -> tuple[Finding, ...]:
    """Warn where simulated approaches contradict the filter, or touchdown meets no category."""
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
    """Tell in words where each category's accuracy is met in all axes."""
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
