"""Old paths of modules that moved into the folders of the systems, or into another module.

They answer for one release.

``from groundstation.results.heading import HeadingResult`` gives the module at its new path, with a warning that names
it. Remove this file, its test and the call in groundstation/__init__.py one release after the first that has it.
"""

import importlib
import warnings
from collections.abc import Sequence
from types import ModuleType

TYPE_CHECKING = False
if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec

PACKAGE = "groundstation."
EMPTY = ("estimators", "studies")  # rooms that are no more
FILES = {
    "base.normal": "base.quantiles",
    "chapters.aided_ins": "systems.inertial.aided_chapter",
    "chapters.control": "systems.planning.session.chapter",
    "chapters.cooperative": "systems.cooperative.chapter",
    "chapters.fleet.aircraft": "systems.inertial.fleet_drift_chapter",
    "chapters.fleet.calibration": "systems.reference.fleet_chapter",
    "chapters.fleet.densities": "systems.heading.fleet_densities_chapter",
    "chapters.fleet.deviation": "systems.magnetic.fleet_chapter",
    "chapters.fleet.installations": "systems.heading.installation.fleet_chapter",
    "chapters.fleet.sessions": "systems.cooperative.fleet_chapter",
    "chapters.fleet.skill": "systems.inertial.fleet_chapter",
    "chapters.forecast": "systems.inertial.forecast_chapter",
    "chapters.forecast_conclusions": "systems.inertial.conclusions_chapter",
    "chapters.heading": "systems.heading.chapter",
    "chapters.inertial": "systems.inertial.chapter",
    "chapters.inertial_claim": "systems.inertial.claim_chapter",
    "chapters.installation": "systems.heading.installation.chapter",
    "chapters.landing": "systems.landing.chapter",
    "chapters.landing_beacons": "systems.landing.beacons.chapter",
    "chapters.landing_ranges": "systems.planning.landing.chapter",
    "chapters.latency": "systems.latency.chapter",
    "chapters.magnetic": "systems.magnetic.chapter",
    "chapters.magnetic_ground": "systems.magnetic.ground_chapter",
    "chapters.placement": "systems.planning.session.placement_chapter",
    "chapters.plan": "chapters.front",
    "chapters.plots.control": "systems.planning.session.plots",
    "chapters.plots.cooperative": "systems.cooperative.plots",
    "chapters.plots.fleet.aircraft": "systems.heading.fleet_plots",
    "chapters.plots.fleet.calibration": "systems.reference.fleet_plots",
    "chapters.plots.fleet.densities": "systems.heading.fleet_densities_plots",
    "chapters.plots.fleet.deviation": "systems.magnetic.fleet_plots",
    "chapters.plots.fleet.installations": "systems.heading.installation.fleet_plots",
    "chapters.plots.fleet.skill": "systems.inertial.fleet_plots",
    "chapters.plots.forecast": "systems.inertial.forecast_plots",
    "chapters.plots.heading": "systems.heading.plots",
    "chapters.plots.inertial": "systems.inertial.plots",
    "chapters.plots.landing": "systems.landing.plots",
    "chapters.plots.landing_beacons": "systems.landing.beacons.plots",
    "chapters.plots.landing_ranges": "systems.planning.landing.plots",
    "chapters.plots.latency": "systems.latency.plots",
    "chapters.plots.magnetic": "systems.magnetic.plots",
    "chapters.plots.placement": "systems.planning.session.placement_plots",
    "chapters.plots.reference": "systems.reference.plots",
    "chapters.plots.standstill": "systems.heading.standstill_plots",
    "chapters.plots.together": "systems.several_logs.plots",
    "chapters.reference": "systems.reference.chapter",
    "chapters.shortened": "chapters.parts",
    "chapters.sources": "chapters.provenance",
    "chapters.together": "systems.several_logs.chapter",
    "chapters.verdict": "chapters.gates",
    "estimators.analysis": "systems.analysis",
    "estimators.approaches.figures": "systems.landing.geometry",
    "estimators.cooperative.arrays": "systems.cooperative.loop_types",
    "estimators.damage": "pipeline.one_flight.damage",
    "estimators.fleet.calibration": "methods.fleet.answer",
    "estimators.heading.answer": "systems.heading.outcome",
    "estimators.installation.answer": "systems.heading.installation.outcome",
    "estimators.known": "systems.known",
    "estimators.magnetic.methods": "systems.magnetic.three_methods",
    "estimators.landing_beacons.answer": "systems.landing.beacons.outcome",
    "estimators.landing_beacons.geometry": "methods.bearings",
    "estimators.landing_ranges.answer": "systems.planning.landing.outcome",
    "estimators.overview": "methods.overview",
    "estimators.plan": "systems.plan",
    "estimators.two_clocks.places": "systems.several_logs.relate",
    "exports.text": "exports.tracks",
    "methods.lag.motion": "base.attitude",
    "methods.taxi.intervals": "results.chosen",
    "methods.taxi.pair": "methods.taxi.samples",
    "pipeline.one_flight.apply_deviation": "systems.magnetic.apply_deviation",
    "pipeline.one_flight.cores": "pipeline.many_flights.processes.crews",
    "pipeline.one_flight.deviation_to_apply": "systems.magnetic.deviation_to_apply",
    "pipeline.verbs.kept_runs": "pipeline.verbs.synthesis",
    "reports.steer_card": "systems.magnetic.steer_card_page",
    "reports.svg.dates": "reports.svg.ticks",
    "results.arrays.cooperative": "systems.cooperative.arrays",
    "results.arrays.forecast": "systems.inertial.forecast_arrays",
    "results.arrays.heading": "systems.heading.arrays",
    "results.arrays.inertial": "systems.inertial.arrays",
    "results.arrays.landing": "systems.landing.arrays",
    "results.arrays.magnetic": "systems.magnetic.arrays",
    "results.arrays.reference": "systems.reference.arrays",
    "results.arrays.together": "systems.several_logs.arrays",
    "results.coefficients": "results.roles",
    "results.control": "systems.planning.session.answer",
    "results.cooperative": "systems.cooperative.answer",
    "results.deviation": "systems.magnetic.deviation_answer",
    "results.forecast": "systems.inertial.forecast_answer",
    "results.heading": "systems.heading.answer",
    "results.inertial": "systems.inertial.answer",
    "results.installation": "results.installations",
    "results.landing": "systems.landing.answer",
    "results.landing_beacons": "systems.landing.beacons.answer",
    "results.landing_ranges": "systems.planning.landing.answer",
    "results.latency": "systems.latency.answer",
    "results.magnetic": "systems.magnetic.answer",
    "results.magnetic_ground": "systems.magnetic.ground_answer",
    "results.placement": "systems.planning.session.placement_answer",
    "results.plan": "results.answer",
    "results.reasons": "results.gates",
    "results.reference": "systems.reference.answer",
    "results.together": "systems.several_logs.answer",
    "store.sequences": "store.foreign",
    "studies.approach": "systems.landing.study",
    "studies.control": "systems.planning.session.study.control",
    "studies.control_cases": "systems.planning.session.study.cases",
    "studies.control_flown": "systems.planning.session.study.flown",
    "studies.cooperative": "systems.cooperative.study.cooperative",
    "studies.cooperative_cases": "systems.cooperative.study.cases",
    "studies.cooperative_page": "systems.cooperative.study.page",
    "studies.cooperative_runs": "systems.cooperative.study.runs",
    "studies.forecast": "systems.inertial.study.forecast",
    "studies.forecast_cases": "systems.inertial.study.cases",
    "studies.forecast_consistency": "systems.inertial.study.consistency",
    "studies.forecast_coupled_bank": "systems.inertial.study.coupled_bank",
    "studies.forecast_outages": "systems.inertial.study.outages",
    "studies.forecast_page": "systems.inertial.study.page",
    "studies.forecast_runs": "systems.inertial.study.runs",
    "studies.forecast_tables": "systems.inertial.study.tables",
    "studies.heading": "systems.heading.study.heading",
    "studies.heading_crew": "systems.heading.study.crew",
    "studies.heading_family": "systems.heading.study.family",
    "studies.heading_paper": "systems.heading.study.paper",
    "studies.installation": "systems.heading.study.installation",
    "studies.installation_family": "systems.heading.study.installation_family",
    "studies.installation_pool": "systems.heading.study.installation_pool",
    "studies.landing": "systems.planning.landing.study.landing",
    "studies.landing_bearings": "systems.planning.landing.study.bearings",
    "studies.landing_cases": "systems.planning.landing.study.cases",
    "studies.landing_runs": "systems.planning.landing.study.landing",
    "studies.landing_tables": "systems.planning.landing.study.tables",
    "studies.magnetic": "systems.magnetic.study.magnetic",
    "studies.magnetic_bias": "systems.magnetic.study.bias",
    "studies.magnetic_cases": "systems.magnetic.study.cases",
    "studies.magnetic_coverage": "systems.magnetic.study.coverage",
    "studies.magnetic_flights": "systems.magnetic.study.flights",
    "studies.magnetic_judge": "systems.magnetic.study.judge",
    "studies.magnetic_page": "systems.magnetic.study.page",
    "studies.magnetic_runs": "systems.magnetic.study.runs",
    "studies.magnetic_tables": "systems.magnetic.study.tables",
    "studies.magnetic_taxis": "systems.magnetic.study.taxis",
    "studies.page": "systems.study",
    "studies.shipped_plans": "systems.shipped_plans",
    "tables.ins_kind": "tables.sources",
    "viewer.comparison_text": "viewer.comparison",
    "viewer.markdown": "viewer.names",
    "viewer.tabs.control": "systems.planning.session.tab",
    "viewer.tabs.cooperative": "systems.cooperative.tab",
    "viewer.tabs.distribution": "systems.heading.distribution_tab",
    "viewer.tabs.forecast": "systems.inertial.forecast_tab",
    "viewer.tabs.heading": "systems.heading.tab",
    "viewer.tabs.inertial": "systems.inertial.tab",
    "viewer.tabs.installation": "viewer.tabs.generic",
    "viewer.tabs.landing": "systems.landing.tab",
    "viewer.tabs.landing_beacons": "systems.landing.beacons.tab",
    "viewer.tabs.landing_ranges": "systems.planning.landing.tab",
    "viewer.tabs.magnetic": "systems.magnetic.tab",
    "viewer.tabs.magnetic_field": "systems.magnetic.field_tab",
    "viewer.tabs.placement": "systems.planning.session.placement_tab",
    "viewer.tabs.reference": "systems.reference.tab",
    "viewer.tabs.session_space": "systems.cooperative.space_tab",
    "viewer.tabs.together": "viewer.tabs.generic",
}
FOLDERS = {
    "estimators.approaches": "systems.landing",
    "estimators.control": "systems.planning.session",
    "estimators.cooperative": "systems.cooperative",
    "estimators.cooperative.plain": "systems.cooperative.filters",
    "estimators.fleet": "methods.fleet",
    "estimators.heading": "systems.heading",
    "estimators.inertial": "systems.inertial",
    "estimators.installation": "systems.heading.installation",
    "estimators.landing_beacons": "systems.landing.beacons",
    "estimators.landing_ranges": "systems.planning.landing",
    "estimators.latency": "systems.latency",
    "estimators.magnetic": "systems.magnetic",
    "estimators.reference": "systems.reference",
    "estimators.together": "systems.several_logs",
    "estimators.two_clocks": "systems.several_logs",
}
# Further modules that have names of the old one.
ALSO = {
    "estimators.two_clocks.relation": ("systems.joining",),
    "methods.lag.motion": ("methods.lag.settings",),
    "results.arrays.cooperative": (
        "results.arrays.session",
        "systems.planning.session.arrays",
        "systems.planning.session.placement_arrays",
    ),
    "results.arrays.landing": ("systems.planning.landing.arrays",),
    "results.heading": ("results.gates", "results.roles"),
    "results.inertial": ("results.roles",),
    "results.installation": ("systems.heading.installation.answer",),
}

# Names that left a module that stays.
NAMES = {"results.arrays.flight": {"LatencySearch": "systems.latency.arrays"}}


def new_path(old: str) -> str:
    """Return the path of a moved module below the package; empty for one that did not move.

    Examples
    --------
    >>> new_path("results.heading"), new_path("estimators.inertial.filter"), new_path("base.angles")
    ('systems.heading.answer', 'systems.inertial.filter', '')
    """
    if old in FILES or old in FOLDERS:
        return FILES.get(old) or FOLDERS[old]
    folder, _, name = old.rpartition(".")
    return f"{FOLDERS[folder]}.{name}" if folder in FOLDERS else ""


def spec_of(name: str) -> "ModuleSpec | None":
    """Return a spec for a path that moved, None for any other."""
    old = name.removeprefix(PACKAGE)
    if not (old in EMPTY or new_path(old)):
        return None
    from importlib.machinery import ModuleSpec

    return ModuleSpec(name, _Loader(), is_package=old in EMPTY or old in FOLDERS)  # type: ignore[arg-type]


def name_that_left(module: str, name: str) -> object:
    """Return what a module that stays once had; its ``__getattr__`` asks.

    Raises
    ------
    AttributeError
        It never had the name.
    """
    new = NAMES[module.removeprefix(PACKAGE)].get(name)
    if new is None:
        raise AttributeError(f"module {module!r} has no attribute {name!r}")
    warnings.warn(f"{module}.{name} is now in {PACKAGE}{new}", DeprecationWarning, stacklevel=3)
    found: object = getattr(importlib.import_module(PACKAGE + new), name)
    return found


class _Loader:
    """Loader of a module from its new path."""

    def create_module(self, spec: "ModuleSpec") -> ModuleType | None:
        """Return the module at its new path; for a folder None, a new empty module."""
        old = spec.name.removeprefix(PACKAGE)
        if old in EMPTY or old in FOLDERS:
            return None
        new = [PACKAGE + path for path in (new_path(old), *ALSO.get(old, ()))]
        warnings.warn(f"{spec.name} is now {', '.join(new)}", DeprecationWarning, stacklevel=2)
        return _alias([importlib.import_module(path) for path in new])

    def exec_module(self, module: ModuleType) -> None:
        """Run nothing, as the module at the new path has run."""


def _alias(modules: Sequence[ModuleType]) -> ModuleType:
    """Return a module with the contents of others, those of the first before the rest.

    The import system names it anew and leaves the others alone.
    """
    alias = ModuleType(modules[0].__name__, modules[0].__doc__)
    for module in reversed(modules):
        alias.__dict__.update({name: value for name, value in vars(module).items() if not name.startswith("__")})
    return alias
