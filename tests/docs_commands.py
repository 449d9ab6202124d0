"""Commands that the docs show in their blocks of code, and a folder with the files that they name."""

import re
import shlex
import shutil
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import typer.main
from typer.testing import CliRunner

from groundstation.cli.completion import plans_of, scenarios, studies
from groundstation.cli.main import app
from tests.readers.logs_of_every_format import write_tlog
from tests.readers.trajectory_writer import pos_rows

ROOT = Path(__file__).parent.parent
DONE, FAILED, USAGE, DATA_LOST, LIMIT_REACHED = 0, 1, 2, 3, 4

SESSION = """
title = "Two aircraft and a ground point"
frame = "local"
duration_s = 30.0

[[points]]
name = "N1"
north_m = 50000
east_m = -30000

[[aircraft]]
name = "A"
north_m = 0
east_m = -2600

[[aircraft]]
name = "B"
north_m = 0
east_m = 2600
"""
IMU = 'family = "hover"\nseed = 3\ntruth_rate_hz = 0\n\n[unit]\nrate_hz = 20\nimu_class = "consumer"\n'
SETTINGS = "[heading]\ntaxi_speed_min_mps = 6.0\n"
AIRCRAFT = "antenna_arm_m = 3.0\nentry_step_deg = 0.1\n"
SITE = 'stand = "4A"\n\n[[stands]]\nname = "4A"\nheading_deg = 352.41\nsigma_deg = 0.02\n'
LIMITS = """title = "Specification 7"
source = "specification 7, issue 2"

[[limits]]
name = "rate"
title = "Radial error rate"
share = 0.95
bounds = [{ quantity = "radial_rate_fit_nmiph", at_most = 0.8 }]
"""
TABLE = (
    "Logger 2.1, boat 7\nTime;Lat;Lon;Speed;Hdg;Roll;Depth\ns;;;kn;deg;rad;m\n"
    "0,0;54,32010;10,14020;5,2;87,1;0,021;12,5\n0,5;54,32010;10,14022;5,3;87,3;0,019;12,5\n"
    "1,0;54,32011;10,14024;5,3;87,2;0,024;12,4\n1,5;54,32011;10,14026;5,2;87,6;0,020;12,4\n"
)


@dataclass(frozen=True)
class Command:
    """A line of a page: the words, the file that its output goes to, the error that the page shows below it."""

    place: str
    words: tuple[str, ...]
    into: str = ""
    error: str = ""

    def __str__(self) -> str:
        return f"{self.place}: {shlex.join(self.words)}"


# ------------------------------------------------------------------------------------------------ from the pages


def commands(page: Path, tools: Sequence[str] = ("groundstation",)) -> tuple[Command, ...]:
    """Return the calls of these tools in a page's blocks of code, in their order."""
    found = []
    lines = tuple(_lines(page.read_text(encoding="utf-8")))
    for (number, line), (_, below) in zip_longest(lines, lines[1:], fillvalue=(0, "")):
        for text in _without_comment(line.removeprefix("$ ")).split("&&"):
            if text.split()[:1] and text.split()[0] in tools:
                words, into = _redirected(shlex.split(text.partition(" | ")[0]))
                found.append(Command(f"{page.name}:{number}", words, into, below if below[:6] == "error:" else ""))
    return tuple(found)


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield the lines of the blocks of code, fenced and indented, continued ones joined."""
    is_fenced, joined = False, ""
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            is_fenced = not is_fenced
        elif is_fenced or line.startswith("    "):
            joined += line.strip()
            if joined.endswith("\\"):
                joined = joined.removesuffix("\\")
                continue
            yield number, joined
        joined = ""


def _without_comment(line: str) -> str:
    return re.split(r"(?:^|\s)#", line)[0].strip()


def _redirected(words: list[str]) -> tuple[tuple[str, ...], str]:
    if ">" not in words:
        return tuple(words), ""
    at = words.index(">")
    return tuple(words[:at]), words[at + 1]


# ------------------------------------------------------------------------------------------------ done


def run(command: Command) -> str:
    """Run a call in this process, in the working directory; return what is wrong, or nothing."""
    done = CliRunner().invoke(app, _as_shell(command.words[1:]))
    if command.error:
        is_so = done.exit_code in (FAILED, USAGE) and command.error in done.output
        return "" if is_so else f"{command}: not the error of the page: {done.output[-1000:]}"
    no_is_an_answer = LIMIT_REACHED if "--for" in command.words else DONE  # the taxi cannot be used for all
    if done.exit_code not in (DONE, DATA_LOST, no_is_an_answer):
        return f"{command}: exit code {done.exit_code}\n{done.output[-1000:]}{_crash(done.exception)}"
    if command.into:
        Path(command.into).write_text(done.stdout, encoding="utf-8")
    return ""


def _crash(error: BaseException | None) -> str:
    return "" if error is None or isinstance(error, SystemExit) else repr(error)


def parse(command: Command, made: list[str] | None = None) -> str:
    """Parse a call without running it: verb, options, values, names and files given; return what is wrong.

    ``made`` are the files and folders that calls before this one write; those of this one are added.
    """
    made = [] if made is None else made
    try:
        context: Any = typer.main.get_command(app).make_context("groundstation", _as_shell(command.words[1:]))
        while hasattr(context.command, "commands"):
            name, verb, rest = context.command.resolve_command(context, [*context._protected_args, *context.args])
            context = verb.make_context(name, rest, parent=context)
    except Exception as error:  # whatever the parser says of it
        return f"{command}: {getattr(error, 'format_message', error.__str__)()}"
    problems = list(_problems(context.command.name, context.params, made))
    made += [str(output) for output in [context.params.get("output"), command.into] if output]
    return "\n".join(f"{command}: {problem}" for problem in problems)


def _problems(verb: str, given: dict[str, Any], made: Sequence[str]) -> Iterator[str]:
    """Yield what a call would stumble over at once: a name or a file that is not there."""
    known = {"study": studies, "session": plans_of("session"), "landing": plans_of("landing"), "simulate": scenarios}
    name = given.get("name" if verb == "study" else "scenario")
    if verb in known and name and not (name in known[verb](name) or Path(name).is_file()):
        yield f"no {verb} {name}"
    for option in ("paths", "logs", "flight", "out", "config", "aircraft", "site", "stations", "thresholds"):
        value = given.get(option)
        paths = value if isinstance(value, list | tuple) else [value] if value else []
        yield from (f"no file {path}" for path in map(str, paths) if not ("://" in path or _is_there(path, made)))


def _is_there(path: str, made: Sequence[str]) -> bool:
    return Path(path).exists() or any(Path(path).is_relative_to(one) for one in made)


def _as_shell(words: Sequence[str]) -> list[str]:
    """Return the words with patterns of files put in full, as a shell does."""
    return [one for word in words for one in (sorted(map(str, Path().glob(word))) if "*" in word else []) or [word]]


# ------------------------------------------------------------------------------------------------ tools beside


def missing_target(command: Command) -> str:
    """Return the target of a call of make that the Makefile does not have, or nothing."""
    targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    asked = [word for word in command.words[1:] if "=" not in word and not word.startswith("-")]
    return "".join(f"{command}: no target {word}" for word in asked if word not in targets)


def missing_extra(command: Command) -> str:
    """Return the extra or the file of a call of pip that the project does not have, or nothing."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = re.findall(r"\[([\w,]+)\]", " ".join(command.words))
    extras = {extra for group in named for extra in group.split(",")} - set(project["optional-dependencies"])
    files = [after for word, after in zip(command.words, command.words[1:], strict=False) if word == "-r"]
    return " ".join([*(f"{command}: no extra {one}" for one in sorted(extras)), *_absent(command, files)])


def _absent(command: Command, files: Sequence[str]) -> list[str]:
    return [f"{command}: no file {one}" for one in files if not (ROOT / one).exists()]


# ------------------------------------------------------------------------------------------------ the folder


def make_folder(folder: Path) -> None:
    """Write the files that the pages name: logs of every kind, settings, and what a run left of two logs."""
    for name, text in (
        *(
            ("settings.toml", SETTINGS),
            ("aircraft.toml", AIRCRAFT),
            ("site.toml", SITE),
            ("table.csv", TABLE),
            ("boat.csv", TABLE),
        ),
        *(("limits.toml", LIMITS), ("unit_limits.toml", "rate_nmiph = 1.5\n")),
        *(("imu.toml", IMU), ("pair.toml", SESSION)),
    ):
        (folder / name).write_text(text, encoding="utf-8")
    samples = ROOT / "sample_logs"
    (folder / "logs").mkdir()
    for name, sample in (
        ("flight.csv", "good"),
        ("flight2.csv", "drift"),
        ("yourlog", "good"),
        ("logs/a.csv", "good"),
        ("logs/b.csv", "short"),
    ):
        shutil.copy(samples / f"taxi-{sample}.csv", folder / name)
    shutil.copytree(samples, folder / "sample_logs")
    rows = [
        f"2026/05/04 06:0{s // 60}:{s % 60:02d}.000 55.97 37.41 205.0 1 9 {'0.02 ' * 6}0 9 {'0 ' * 3}{'0.01 ' * 6}"
        for s in range(300)
    ]
    write_tlog(folder / "flight.tlog")
    (folder / "reference.pos").write_bytes(pos_rows(rows))
    for line in (
        "simulate imu.toml --format ulog -o made",
        "simulate imu.toml --format dataflash -o made",
        "simulate pair.toml -o session",
        "convert flight.csv -o flight.mcap",
        "profile new table.csv -o profile.toml",
        "run logs -o out --only results -j 1",
    ):
        problem = run(Command("the folder", ("groundstation", *line.split())))
        if problem:
            raise AssertionError(problem)
    for name in ("ulg", "bin"):
        next(made for made in (folder / "made").iterdir() if made.suffix.lower() == f".{name}").rename(
            folder / f"flight.{name}"
        )
    for rest in ("imu.toml", "pair.toml"):
        (folder / rest).unlink()
    shutil.rmtree(folder / "made")
