"""Application of all verbs: exit codes, options spelled alike, errors in one line."""

import math
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, ParamSpec

import typer
import typer.core

from groundstation.base.errors import GroundstationError, UsageError, lack_of_memory
from groundstation.base.failures import Failure, reason_of
from groundstation.cli.plain_words import with_plain_words
from groundstation.cli.text import as_json, printable
from groundstation.cli.text import say as say
from groundstation.cli.text import tell as tell

if TYPE_CHECKING:
    from groundstation.pipeline.many_flights.processes.confined import ProcessLimits
    from groundstation.pipeline.one_flight.isolation import Isolation

DONE, FAILED, USAGE, DATA_LOST, LIMIT_REACHED = 0, 1, 2, 3, 4
INTERRUPTED = 130
EXIT_CODES = (
    "Exit codes: 0 done; 1 could not read or compute; 2 usage; 3 done, with data lost (truncated, corrupt spans, "
    "channels dropped); 4 done, and --fail-on reached; 130 interrupted. For several logs the worst wins (1, 4, 3, 0)."
)

VERBS = (
    *(
        "info",
        "check",
        "convert",
        "run",
        "watch",
        "report",
        "view",
        "clip",
        "export",
        "compare",
        "cooperative",
        "plan",
        "profile",
        "rules",
        "runways",
        "serve",
    ),
    *("simulate", "study", "list"),
)


EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "info": ("info flight3.ulg",),
    "check": ("check flight3.ulg", "check flight3.ulg --for heading", "check logs/a.csv logs/b.csv --fail-on warn"),
    "convert": ("convert flight3.ulg -o flight3.mcap",),
    "run": (
        "run flight3.ulg -o out",
        "run logs -o out --aircraft aircraft.toml --site airfield.toml",
        "run flight3.ulg --reference sbet_20250708.out -o out",
        "run logs -o out --only results",
        "run logs -o out --dry-run",
    ),
    "watch": ("watch incoming -o out", "watch incoming -o out --once --every 5"),
    "report": ("report out", "report out --standard app-g -o acceptance"),
    "view": ("view out", "view flight3.ulg --web", "view out --layout mine.rbl"),
    "export": (
        "export out/20260504T060000Z_SIM-1_101 -o flight.kml",
        "export flight3.ulg -o flight3.csv --track gnss",
        "export out/20260504T060000Z_SIM-1_101 -o tables --figures",
    ),
    "clip": (
        "clip flight3.mcap --from +05:00 --to +12:30 -o part.mcap",
        "clip flight3.ulg --anonymous --no-recording -o for_others.mcap",
    ),
    "compare": ("compare out/first out/second -o comparison",),
    "cooperative": ("cooperative a.csv b.csv --stations stations.toml -o out",),
    "profile": ("profile new log.csv -o my.toml", "profile check my.toml log.csv", "profile list"),
    "rules": ("rules test stricter.toml --over out", "rules test stricter.toml --over out -o changes.csv"),
    "runways": ("runways near 60.19 11.07", "runways show ENGM 01L", "runways update runways.csv"),
    "serve": ("serve out",),
    "simulate": ("simulate taxi-good -o logs",),
    "study": ("study heading -o tables --runs 50",),
    "list": ("list", "list flight3.ulg"),
}


def examples(verb: str) -> str:
    """Return the examples under the help of a verb: calls to copy, a paragraph each."""
    return "\n\n".join(("Examples:", *(f"groundstation {line}" for line in EXAMPLES[verb])))


class InOrder(typer.core.TyperGroup):
    """Group of verbs in the order in which a flight passes them, wherever they are defined."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options before the verb."""
        return with_plain_words(self.callback, super().get_params(ctx))

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names, those without a place at the end."""
        places = {name: place for place, name in enumerate(VERBS)}
        return sorted(super().list_commands(ctx), key=lambda name: places.get(name, len(VERBS)))


app = typer.Typer(
    name="groundstation",
    cls=InOrder,
    help="Ground station for post-flight navigation analysis: recorded logs become MCAP, a heading correction, a "
    "Rerun recording and a report.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Parameters = ParamSpec("Parameters")

ProgressMode = Literal["auto", "none", "json"]
FailOnMode = Literal["none", "warn", "fail"]

Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Print only errors on the terminal.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print more; show where an internal error came from.")]
Json = Annotated[bool, typer.Option("--json", help="Print the results as JSON.")]
FailOn = Annotated[FailOnMode, typer.Option("--fail-on", help="Exit 4 at a finding this severe or worse.")]
Force = Annotated[bool, typer.Option("-f", "--force", help="Overwrite existing results.")]
Jobs = Annotated[int, typer.Option("-j", "--jobs", help="Processes; 0: one per core.", min=0)]
Together = Annotated[
    bool,
    typer.Option("--together", help="The logs are of one flight: put them on one clock, by GNSS time or by motion."),
]
Pdf = Annotated[
    bool,
    typer.Option(
        "--pdf/--no-pdf",
        help="Write the reports as PDF too. A steer card and an acceptance are written as PDF in any case.",
    ),
]
Only = Annotated[
    Literal["results"] | None,
    typer.Option(
        "--only", help="results: write no recordings and no reports, of each flight or of all; a later run writes them."
    ),
]
Store = Annotated[
    str,
    typer.Option(
        "--store",
        help="A Delta table that also gets the rows of the flights; several runs may write into one.",
        metavar="delta:PATH|URL",
    ),
]
Timeout = Annotated[
    float | None,
    typer.Option(
        "--timeout",
        help="Longest time for one log; one that takes longer fails. Default: no limit.",
        metavar="SECONDS",
        min=1.0,
    ),
]
Isolate = Annotated[
    bool,
    typer.Option(
        "--isolate",
        help="Read each log in a process of its own, with the limits of memory, time and file size that the settings "
        "state in isolation.",
    ),
]
Progress = Annotated[ProgressMode, typer.Option("--progress", help="Progress on stderr: a bar, nothing, JSON lines.")]
PowerUp = Annotated[
    int | None,
    typer.Option(
        "--power-up", help="Of a log with several power-ups: which, from 1. Default: the only one.", metavar="N", min=1
    ),
]
Profile = Annotated[
    Path | None,
    typer.Option(
        "--profile", help="Profile (TOML) that describes the columns of a CSV.", metavar="FILE", readable=False
    ),
]
IcdFiles = Annotated[
    list[str] | None,
    typer.Option(
        "--icd",
        help="ICD (DTS YAML) that defines the words of 1553 and ARINC-429 buses, or the name of a shipped one; "
        "may be repeated.",
        metavar="FILE",
    ),
]
ConfigFile = Annotated[Path | None, typer.Option("--config", help="Settings (TOML).", metavar="FILE", readable=False)]
AircraftFile = Annotated[
    Path | None,
    typer.Option("--aircraft", help="Aircraft file (TOML): antenna arm, entry step.", metavar="FILE", readable=False),
]
WeatherFile = Annotated[
    Path | None,
    typer.Option(
        "--weather",
        help="METAR lines (text): each flight takes the wind nearest to its taxi, within 60 min.",
        metavar="FILE",
        readable=False,
    ),
]
Layout = Annotated[
    Path | None,
    typer.Option(
        "--layout",
        help="Layout saved in the viewer (blueprint, .rbl): the recording shows it in place of the default tabs.",
        metavar="FILE",
        readable=False,
    ),
]
Layouts = Annotated[
    list[Path] | None,
    typer.Option(
        "--layout",
        help="Layout saved in the viewer (blueprint, .rbl), which flights, sessions or fleet.rrd show in place of the "
        "default tabs, whichever it was saved from. May be repeated.",
        metavar="FILE",
        readable=False,
    ),
]
InstallationFile = Annotated[
    Path | None,
    typer.Option(
        "--installation",
        help="installations.json of earlier flights: a second heading answer, with the mounting and the crosswind "
        "factor that they taught.",
        metavar="FILE",
        readable=False,
    ),
]
SiteFile = Annotated[
    Path | None,
    typer.Option(
        "--site", help="Site file (TOML): stands, runways and their bearings.", metavar="FILE", readable=False
    ),
]
IntervalsFile = Annotated[
    Path | None,
    typer.Option("--intervals", help="Intervals to exclude or force (TOML).", metavar="FILE", readable=False),
]
ThresholdsFile = Annotated[
    Path | None,
    typer.Option("--thresholds", help="Limits of the integrity ledger (TOML).", metavar="FILE", readable=False),
]
ReferenceFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--reference",
        help="Reference for the log (SBET, .pos, another log), or a folder of them: it judges the results; no "
        "estimator uses it.",
        metavar="FILE",
        readable=False,
    ),
]


def refuse_pdf_of_results(only: str | None, *, pdf: bool) -> None:
    """Refuse to make PDFs where no reports are asked for.

    Raises
    ------
    UsageError
        When both options are given.
    """
    if only == "results" and pdf:
        raise UsageError("--only results", "--pdf", "one of them", "`report OUT --pdf` makes the reports later")


def time_limit_s(given: float | None) -> float:
    """Return the limit of ``--timeout`` for one log, seconds; infinite where it is left out.

    Raises
    ------
    UsageError
        When it is no number.
    """
    if given is not None and math.isnan(given):
        raise UsageError("--timeout nan", "no number", "seconds")
    return math.inf if given is None else given


def tell_failures(found: Iterable[Failure], *, with_traces: bool = False) -> int:
    """Print on stderr the parts that failed; the exit code for that."""
    code = DONE
    for failure in found:
        code = FAILED
        say(f"error: {failure.text}")
        if with_traces:
            say(failure.trace.rstrip())
    return code


def time_bound(timeout: float | None, isolation: "Isolation | None" = None) -> "ProcessLimits | None":
    """Return the bounds for one log; None with neither a limit of time nor ``--isolate``.

    Raises
    ------
    UsageError
        When the limit is no number, or this system cannot read a log apart.
    """
    timeout_s = time_limit_s(timeout)
    if timeout is None and isolation is None:
        return None
    from groundstation.pipeline.many_flights.processes.apart import bounds_of

    return bounds_of(isolation, timeout_s)


def tell_written(paths: Iterable[object], *, as_json_text: bool, quiet: bool) -> None:
    """Print the files that were written."""
    written = [str(path) for path in paths]
    if as_json_text:
        tell(as_json({"written": written}))
    elif not quiet:
        tell("\n".join(map(printable, written)))


def answers_with_exit_code(verb: Callable[Parameters, int | None]) -> Callable[Parameters, None]:
    """Turn a verb's answer into the exit code, and its errors into one clear line."""

    @wraps(verb)
    def run(*args: Parameters.args, **options: Parameters.kwargs) -> None:
        try:
            code = verb(*args, **options) or DONE
        except UsageError as error:
            say(f"error: {error}")
            code = USAGE
        except GroundstationError as error:
            say(f"error: {error}")
            code = FAILED
        except KeyboardInterrupt:
            say("interrupted")
            code = INTERRUPTED
        except BrokenPipeError:  # the reader of our output went away: `groundstation list | head -1`
            sys.stderr.close()
            code = DONE
        except Exception as error:
            code = FAILED
            if lacking := lack_of_memory(error):
                say(f"error: {lacking}")
            elif isinstance(error, OSError):
                say(printable(f"error: {error.filename or 'file system'}: {error.strerror or error}"))
            elif options.get("verbose"):  # a defect of ours: one line for the user, the rest on request
                say("".join(traceback.format_exception(error)).rstrip())
            else:
                say(f"error: {reason_of(error)}; -v shows where")
        if options.get("verbose"):
            _tell_of_compiled_code()
        raise typer.Exit(code)

    return run


def _tell_of_compiled_code() -> None:
    """Say why compiled code is not kept where the user wants it, if anything was compiled."""
    compiling = sys.modules.get("groundstation.base.compile")
    if compiling is not None and (reason := compiling.why_nothing_is_kept()):
        say(reason)
