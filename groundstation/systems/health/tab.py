"""Tab on autopilot health: checks, quantities, messages, the chapter."""

from collections.abc import Sequence

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.words import capitalised
from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.health.answer import AutopilotHealth, Verdict
from groundstation.systems.health.arrays import HealthLanes
from groundstation.systems.health.chapter import health as chapter
from groundstation.viewer import colours
from groundstation.viewer.names import path_parts
from groundstation.viewer.plot_views import panels_of, plot_of, runs_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document, lanes

ORDER: tuple[Verdict, ...] = ("fail", "warn", "pass", "not_logged")
PALETTE = {"good": colours.GREEN, "amber": colours.ORANGE, "red": colours.VERMILION, "not logged": colours.GREY}


def health(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None for a log without an autopilot."""
    answer, section = results.answer(AutopilotHealth), chapter(results)
    if answer is None or section is None:
        return None
    recorder.document("health/answer", markdown(section))
    left: list[rrb.View | rrb.Container] = []
    shown = _lanes(recorder, answer, results.rows_of(HealthLanes))
    if shown is not None:
        left.append(shown)
    checks: list[rrb.View | rrb.Container] = [
        view for run in runs_of(recorder, plot_of(recorder, "health.motors", results), "health/motors") for view in run
    ]  # seconds around the loss: in a view of the whole flight they are a sliver
    for one in sorted(answer.checks, key=lambda check: ORDER.index(check.verdict)):
        told = plot_of(recorder, "health.panels", results, one.key)
        title = capitalised(one.title)
        views = panels_of(recorder, told, of=title if told is not None and len(told.panels) == 1 else "")
        checks += views if len(views) == 1 else [rrb.Vertical(contents=views, name=title)] if views else []
    if checks:
        left.append(rrb.Tabs(contents=checks, active_tab=0) if len(checks) > 1 else checks[0])
    right: list[rrb.View | rrb.Container] = [document("What was found", "health/answer")]
    if _messages(recorder, answer):
        parts = rrb.TextLogColumns(text_log_columns=["loglevel", "body"])
        right.append(rrb.TextLogView(name="Messages and modes", origin="/health/messages", columns=parts))
    columns: list[rrb.View | rrb.Container] = [_above(one) for one in (left, right) if one]
    return rrb.Horizontal(contents=columns, column_shares=[3.0, 2.0][: len(columns)], name="Autopilot health")


def _above(views: Sequence[rrb.View | rrb.Container]) -> rrb.View | rrb.Container:
    """Return views above each other; one alone as it is, as the viewer would make of it."""
    return views[0] if len(views) == 1 else rrb.Vertical(contents=views, row_shares=[2.0, 3.0])


def _lanes(recorder: Recorder, answer: AutopilotHealth, data: HealthLanes | None) -> rrb.View | None:
    """Log a lane for each check, whose state is its grade."""
    if data is None:
        return None
    titles = [one.title for one in answer.checks if np.any(data.check == one.title)]
    paths = [f"health/lanes/{place:02d}_{part}" for place, part in enumerate(path_parts(titles))]
    for title, path in zip(titles, paths, strict=True):
        own = data.where(data.check == title)
        order = np.argsort(own.start_s, kind="stable")
        recorder.spans(path, own.start_s[order], own.end_s[order], own.grade[order], PALETTE)
    return (
        lanes("Checks: green within limits, orange amber, red beyond, grey: pause of the log", paths) if paths else None
    )


def _messages(recorder: Recorder, answer: AutopilotHealth) -> bool:
    """Log what happened as lines in time; False where nothing did."""
    if not answer.happenings:
        return False
    ordered = sorted(answer.happenings, key=lambda one: one.time_s)
    time_ns = recorder.time_ns(np.array([one.time_s for one in ordered]))
    recorder.texts("health/messages", time_ns, [one.text for one in ordered], [one.grade for one in ordered])
    return True
