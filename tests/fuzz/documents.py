"""Mutated texts that users write: ``python -m tests.fuzz.documents [--cases N] [--first SEED] [KIND ...]``.

Settings, aircraft, site, intervals, thresholds, rules, profiles, ICDs (YAML), stations, scenarios, plans, standards and
INS classes, through the function that loads them; a profile and an ICD that are accepted read a log. A fault is any
exception but a refusal in one line, over ``LIMIT_S`` of processor time, a death, a file opened for writing.
"""

import argparse
import os
import re
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.errors import MOST_SHOWN, GroundstationError
from tests.fuzz.bases import g1000
from tests.fuzz.mutation import Mutant, random_edits
from tests.fuzz.pool import LIMIT_S, WALL, Child
from tests.fuzz.trial import Watch

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "groundstation"
MOST_CHARACTERS = 4 * MOST_SHOWN + 200  # of a refusal: what it quotes is cut
NUMBERS = ("0", "-1", "1e308", "-1e308", "nan", "inf", "-inf", "1e999", "9" * 400, "0x7fffffffffffffff", "077", "+5")
OTHERS = ("true", '""', '"x"', '"' + "y" * 5000 + '"', "1979-05-27T07:32:00Z", "2026-13-01", '"\\u0000"', "'''")
FORMS = ("[]", "{}", "[[]]", "[1, 2, 3]", "[nan, inf]", '["a", "b"]', "{a = 1}", "[" * 3000, "{" * 3000, "- " * 3000)
HOSTILE = ("&a [*a]", "*a", "!!python/object/apply:os.system [x]", "~", "<<: *a", "'../../x'", '"/dev/zero"', '"i-21"')
VALUES = NUMBERS + OTHERS + FORMS + HOSTILE


@dataclass(frozen=True)
class TextCase:
    """One mutated text: kind and seed."""

    format: str
    seed: int


def _documented(heading: str) -> str:
    """The first TOML below a heading of docs/configuration.md."""
    text = (ROOT / "docs" / "configuration.md").read_text(encoding="utf-8")
    found = re.search(r"```toml\n(.*?)```", text[text.index(heading) :], re.DOTALL)
    assert found is not None
    return found.group(1)


def _defaults() -> str:
    """Every plain setting of every analysis with its default."""
    from groundstation.systems import systems

    lines: list[str] = []
    for analysis in {one.settings_table: one for one in (*systems().analyses, *systems().session_analyses)}.values():
        lines.append(f"[{analysis.settings_table}]")
        for name, value in vars(analysis.settings()).items():
            if isinstance(value, bool | int | float | str):
                lines.append(f"{name} = {str(value).lower() if isinstance(value, bool) else repr(value)}")
    return "\n".join(lines) + "\n"


def _shipped(folder: str, suffix: str = "*.toml") -> tuple[str, ...]:
    return tuple(path.read_text(encoding="utf-8") for path in sorted((PACKAGE / folder).glob(suffix)))


@cache
def bases(kind: str) -> tuple[str, ...]:
    """Sound texts of a kind."""
    return {
        "settings": lambda: (_documented("# "), _defaults()),
        "aircraft": lambda: (AIRCRAFT,),
        "site": lambda: (_documented("## `--site"),),
        "intervals": lambda: (INTERVALS,),
        "thresholds": lambda: _shipped("integrity/thresholds"),
        "profile": lambda: _shipped("readers/profiles", "garmin_g1000.toml"),
        "icd": lambda: _shipped("readers/icd/shipped", "*.yaml"),
        "stations": lambda: (STATIONS,),
        "scenario": lambda: _shipped("simulation/scenarios"),
        "session": lambda: _shipped("simulation/sessions"),
        "approach": lambda: _shipped("simulation/approaches"),
        "landing-plan": lambda: _shipped("plans/landing"),
        "session-plan": lambda: _shipped("plans/session"),
        "standard": lambda: _shipped("methods/fleet/standards"),
        "noise-class": lambda: _shipped("methods/ins_classes"),
        "ins-class": lambda: _shipped("simulation/ins_classes"),
    }[kind]()


INTERVALS = """[[exclude]]
from = 12.5
to = "+01:30"
reason = "towed"

[[force]]
from = "2026-05-01T10:00:00Z"
to = 2026-05-01T10:05:00Z
"""
AIRCRAFT = """antenna_arm_m = 4.2
antenna_arm_sigma_m = 0.05
entry_step_deg = 0.1
mounting_deg = 0.3
gnss_latency_s = 0.12
ins_class = "i-21"
ins_kind = "unaided"
ins_serial = "1234"
always_on_ground = false
vehicle = "flies"
"""
STATIONS = """[[stations]]
name = "N1"
latitude_deg = 55.1
longitude_deg = 37.2
altitude_ellipsoid_m = 180.0

[[stations]]
name = "N2"
latitude_deg = 55.2
longitude_deg = 37.4
altitude_ellipsoid_m = 190.0
"""


def _settings(section: str) -> Callable[[Path], Any]:
    def load(path: Path) -> Any:
        from groundstation.pipeline.one_flight.configuration import load_configuration

        configuration = load_configuration(**{section: path})
        configuration.to_dict()
        return configuration.settings, configuration.thresholds

    return load


def _profile(path: Path) -> None:
    from groundstation.pipeline.one_flight.convert import convert_log
    from groundstation.pipeline.one_flight.log import open_log
    from groundstation.readers.profile_file import load

    load(path)
    log = path.with_suffix(".csv")
    log.write_bytes(g1000())
    convert_log(open_log(log, path), path.with_suffix(".mcap"))


def _icd(path: Path) -> None:
    from groundstation.pipeline.one_flight.convert import convert_log
    from groundstation.pipeline.one_flight.log import open_log
    from groundstation.readers.icd.load import load
    from tests.fuzz.bases import chapter10

    load(path)
    log = path.with_suffix(".ch10")
    log.write_bytes(chapter10())
    convert_log(open_log(log, icds=(str(path),)), path.with_suffix(".mcap"))


def _plan(name: str) -> Callable[[Path], Any]:
    def load(path: Path) -> Any:
        from groundstation.systems.planning.landing.plan import LANDING_PLAN
        from groundstation.systems.planning.session.analysis import SESSION_PLAN
        from groundstation.systems.shipped_plans import load_plan

        return load_plan(SESSION_PLAN if name == "session" else LANDING_PLAN, path)

    return load


def _load(module: str, function: str, *, by_name: bool = False) -> Callable[[Path], Any]:
    def load(path: Path) -> Any:
        return getattr(__import__(module, fromlist=[function]), function)(str(path) if by_name else path)

    return load


LOADERS: dict[str, Callable[[Path], Any]] = {
    "settings": _settings("config"),
    "aircraft": _settings("aircraft"),
    "site": _settings("site"),
    "intervals": _settings("intervals"),
    "thresholds": _settings("thresholds"),
    "profile": _profile,
    "icd": _icd,
    "stations": _load("groundstation.pipeline.many_flights.sessions.job", "load_stations"),
    "scenario": _load("groundstation.simulation.scenario", "load_scenario"),
    "session": _load("groundstation.simulation.session_scenario", "load_session"),
    "approach": _load("groundstation.simulation.approach", "load_approach"),
    "landing-plan": _plan("landing"),
    "session-plan": _plan("session"),
    "standard": _load("groundstation.pipeline.verbs.acceptance", "read_standard"),
    "noise-class": _load("groundstation.methods.ins_noise", "load_class", by_name=True),
    "ins-class": _load("groundstation.simulation.ins_class", "load_ins_class", by_name=True),
}
KINDS = tuple(LOADERS)


def text_of(case: TextCase) -> bytes:
    """The mutated text: damaged as a file, or a line changed as a person or an attacker may, or both."""
    rng = np.random.default_rng([KINDS.index(case.format), case.seed])
    known = bases(case.format)
    text = known[int(rng.integers(len(known)))]
    if rng.random() < 0.75:
        for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
            text = _edited(text, rng)
        if rng.random() < 0.9:
            return text.encode()
    data, everyone = text.encode(), [one.encode() for kind in KINDS for one in bases(kind)]
    other = everyone[int(rng.integers(len(everyone)))]
    starts = [found.end() for found in re.finditer(rb"\n", data)]
    return Mutant(data, other, random_edits(len(data), len(other), starts, rng)).content


def _edited(text: str, rng: np.random.Generator) -> str:
    """One line taken out, doubled, moved or put in another's place, or its value or its key changed."""
    lines = text.split("\n")
    place, other = (int(one) for one in rng.integers(len(lines), size=2))
    what = int(rng.integers(8))
    if what == 0:
        del lines[place]
    elif what == 1:
        lines.insert(place, lines[other])
    elif what == 2:
        lines[place], lines[other] = lines[other], lines[place]
    elif what == 3:
        lines[place] = lines[place][int(rng.integers(len(lines[place]) + 1)) :]
    else:
        lines[place] = _changed(lines[place], rng)
    return "\n".join(lines)


def _changed(line: str, rng: np.random.Generator) -> str:
    """A line with another value, or a key with a letter changed."""
    found = re.match(r"(\s*(?:- )?[^=:#]+[=:]\s*)(.*)", line)
    if found is None:
        return line + VALUES[int(rng.integers(len(VALUES)))]
    if rng.random() < 0.15:
        at = int(rng.integers(len(found.group(1))))
        return line[:at] + chr(int(rng.integers(97, 123))) + line[at + 1 :]
    numbers = list(re.finditer(r"-?\d[\d.]*", found.group(2)))
    value = VALUES[int(rng.integers(len(VALUES)))]
    if numbers and rng.random() < 0.5:
        one = numbers[int(rng.integers(len(numbers)))]
        return found.group(1) + found.group(2)[: one.start()] + value + found.group(2)[one.end() :]
    return found.group(1) + value


def run_text(case: Any, folder: Path, watch: Watch) -> dict[str, Any]:
    """Load one text; what it came to and its fault."""
    suffix = ".yaml" if case.format == "icd" else ".toml"
    path = folder / f"text-{case.seed}{suffix}"  # classes are read once a path
    for old in folder.iterdir():
        old.unlink()
    path.write_bytes(text_of(case))
    watch.folder, watch.seen = os.path.realpath(folder), []
    try:
        LOADERS[case.format](path)
        came_to, fault = "accepted", ""
    except GroundstationError as error:
        told = str(error)
        came_to, fault = "refused", ""
        if "\n" in told or len(told) > MOST_CHARACTERS or not told.isprintable():
            came_to, fault = "crash", f"a refusal of {len(told)} characters: {told[:300]!r}"
    except BaseException:  # every other exception is what is looked for
        came_to, fault = "crash", traceback.format_exc()
    finally:
        watch.folder = ""
    if watch.seen:
        came_to, fault = "escape", "; ".join(watch.seen[:3])
    return {"came_to": came_to, "fault": fault}


def run_texts(cases: Iterator[TextCase]) -> Iterator[tuple[TextCase, dict[str, Any]]]:
    """Results of texts, one after the other, in a child process."""
    child: Child | None = None
    for case in cases:
        child = child or Child([TextCase(case.format, seed) for seed in range(3)], run_text)  # type: ignore[list-item,arg-type]
        found = child.run(case, WALL * LIMIT_S)  # type: ignore[arg-type]
        if found is None:
            code, child = child.end(), None
            found = {"came_to": "death", "fault": f"no answer, exit code {code}", "seconds": LIMIT_S, "growth_mb": 0.0}
        elif found["seconds"] > LIMIT_S and not found["fault"]:
            found |= {"came_to": "hang", "fault": f"{found['seconds']:.1f} s of processor time"}
        yield case, found
    if child is not None:
        child.end()


def fuzz(kind: str, first: int, cases: int) -> int:
    """Run one kind; returns the number of faults."""
    began, counts, slowest, most_mb, faults = time.monotonic(), Counter[str](), 0.0, 0.0, 0
    for case, found in run_texts(TextCase(kind, seed) for seed in range(first, first + cases)):
        counts[found["came_to"]] += 1
        slowest, most_mb = max(slowest, found["seconds"]), max(most_mb, found["growth_mb"])
        if found["fault"]:
            faults += 1
            print(f"--- {kind} seed {case.seed}: {found['came_to']}\n{found['fault'][-1500:]}", flush=True)
    told = ", ".join(f"{name} {count}" for name, count in sorted(counts.items()))
    spent = time.monotonic() - began
    print(
        f"{kind:13} {cases} texts in {spent:.0f} s: {told}; slowest {slowest:.2f} s, {most_mb:.0f} MB; {faults} faults",
        flush=True,
    )
    return faults


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.documents")
    parser.add_argument("kinds", nargs="*", default=[], choices=[*KINDS, []], metavar="KIND")
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    return 1 if sum(fuzz(kind, options.first, options.cases) for kind in options.kinds or KINDS) else 0


if __name__ == "__main__":
    sys.exit(main())
