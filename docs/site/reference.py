"""Pages of the site that the code itself writes: verbs, settings, findings, formats, signals, summary.json."""

import ast
import json
import math
import re
from collections.abc import Iterator, Mapping
from itertools import groupby
from pathlib import Path
from typing import Any, get_args

import typer.main

import groundstation
from groundstation.base.findings import Severity
from groundstation.base.signal_senses import sense_of
from groundstation.base.signals import TOPICS, Field
from groundstation.base.unit_names import UNITS
from groundstation.cli.main import app
from groundstation.pipeline.verbs.catalogue import catalogue
from groundstation.pipeline.verbs.settings_list import every_setting

PACKAGE = Path(groundstation.__file__).parent
SCHEMA = PACKAGE.parent / "schemas" / "summary.schema.json"
CODE = re.compile(r"[a-z_]+\.[a-z_]+[a-z]")


def pages() -> Mapping[str, str]:
    """Return the pages by the names of their files."""
    return {
        "ref_verbs.md": _verbs(),
        "ref_settings.md": _settings(),
        "ref_summary.md": _summary(json.loads(SCHEMA.read_text(encoding="utf-8"))),
        "ref_findings.md": _findings(),
        "ref_analyses.md": _catalogue("Every analysis", "analysis"),
        "ref_formats.md": _catalogue("Every format", "format"),
        "ref_scenarios.md": _catalogue("Simulated flights and sessions", "scenario", "session"),
        "ref_studies.md": _catalogue("Every study", "study"),
    }


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table of Markdown."""
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join("| " + " | ".join(_cell(cell) for cell in row) + " |" for row in lines) + "\n"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def _verbs() -> str:
    command = typer.main.get_command(app)
    parts = [
        "# Every verb and option\n",
        "Written from the program itself; `groundstation VERB --help` tells the same.\n",
    ]
    for name, one in _commands(command, "groundstation"):
        parts.append(f"## {name.removeprefix('groundstation ')}\n\n{one.help or ''}\n")
        rows = []
        for parameter in one.params:
            names = ", ".join((*parameter.opts, *parameter.secondary_opts))
            is_option = parameter.param_type_name == "option"
            label = f"`{names}`" if is_option else f"`{(parameter.metavar or parameter.name).upper()}`"
            rows.append((label, getattr(parameter, "help", "") or ""))
        parts.append(table(("option", "meaning"), rows))
    return "\n".join(parts)


def _commands(command: Any, path: str) -> Iterator[tuple[str, Any]]:
    inside: Mapping[str, Any] = getattr(command, "commands", {})
    for name, inner in inside.items():
        yield from _commands(inner, f"{path} {name}")
    if not inside:
        yield path, command


def _settings() -> str:
    parts = [
        "# Every setting\n",
        "Tables and keys of a settings file; `groundstation list --settings` prints the same.\n",
    ]
    for name, found in groupby(every_setting(), key=lambda one: one.table):
        rows = [(f"`{one.key}`", one.default, one.unit, one.allowed, one.meaning) for one in found]
        parts.append(f"## `[{name}]`\n\n" + table(("setting", "default", "unit", "allowed", "meaning"), rows))
    return "\n".join(parts)


def _findings() -> str:
    rows: dict[str, tuple[set[str], str]] = {}
    others: list[tuple[str, str, str]] = []
    for path in sorted(PACKAGE.rglob("*.py")):
        module = ast.parse(path.read_text(encoding="utf-8"))
        calls = [node for node in ast.walk(module) if isinstance(node, ast.Call) and _is_finding(node)]
        told = [_arguments(node) for node in calls]
        for severity, code, text in told:
            if "." in code and not code.startswith("..."):
                _note(rows, severity, code, text)
        if any(not code for _severity, code, _text in told):
            others += _codes_elsewhere(module)
    heads = {code.partition(".")[0] for code in rows}
    for severity, code, text in others:
        if code.partition(".")[0] in heads:
            _note(rows, severity, code, text)
    listed = [
        (f"`{code}`", ", ".join(sorted(found - {""})) or "by its size", text) for code, (found, text) in rows.items()
    ]
    return "# Codes of findings\n\nWhat a report, summary.json and `check` may say of a log, by its code.\n\n" + table(
        ("code", "severity", "text"), sorted(listed)
    )


def _is_finding(node: ast.Call) -> bool:
    return isinstance(node.func, ast.Name) and node.func.id == "Finding"


def _arguments(node: ast.Call) -> tuple[str, str, str]:
    """Return severity, code and text of a finding, as the code writes them."""
    arguments: list[Any] = [*node.args, None, None, None]
    named = {one.arg: one.value for one in node.keywords}
    severity, code, text = (
        _told(named.get(name) or arguments[place]) for place, name in enumerate(("severity", "code", "text"))
    )
    return severity, code, text


def _note(rows: dict[str, tuple[set[str], str]], severity: str, code: str, text: str) -> None:
    severities, first = rows.setdefault(code, (set(), text))
    severities.add(severity)
    rows[code] = severities, first or text


def _codes_elsewhere(module: ast.Module) -> Iterator[tuple[str, str, str]]:
    """Yield the codes of a module that stand by name, or in a row with their severity and text."""
    for node in ast.walk(module):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.fullmatch(node.value):
            yield "", node.value, ""
        if isinstance(node, ast.Tuple) and len(node.elts) == len(("severity", "code", "text")):
            severity, code, text = (_told(one) for one in node.elts)
            if severity in get_args(Severity) and CODE.fullmatch(code):
                yield severity, code, text


def _told(node: ast.expr | None) -> str:
    """Return a text as the code writes it, values as an ellipsis; empty where it is made elsewhere."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "..." for part in node.values)
    return ""


def _catalogue(title: str, *kinds: str) -> str:
    rows = [
        (f"`{entry['name']}`", str(entry["title"]), str(entry["needs"]).replace("nothing", ""))
        for entry in catalogue()
        if entry["kind"] in kinds
    ]
    head = ("name", "what", "needs")
    if not any(row[2] for row in rows):
        return f"# {title}\n\n" + table(head[:2], [row[:2] for row in rows])
    return f"# {title}\n\n" + table(head, rows)


# ------------------------------------------------------------------------------------------------ summary.json


def _summary(schema: Mapping[str, Any]) -> str:
    """Return every field of summary.json: the parts of the file, each followed by the objects in it."""
    objects = schema["$defs"]
    parts = [
        "# Every field of summary.json\n",
        f"{schema['description']} Written from schemas/summary.schema.json; `or null`: the value may be missing.\n",
        _fields(schema, objects),
    ]
    results = schema["properties"]["results"]["properties"]
    own = {name: one["$ref"] for name, one in schema["properties"].items() if "$ref" in one}
    answers = {f"results.{name}": one["$ref"] for name, one in results.items()}
    told: set[str] = {reference.rpartition("/")[2] for reference in (*own.values(), *answers.values())}
    for path, reference in (own | answers).items():
        name = reference.rpartition("/")[2]
        parts.append(f"## {name}\n\nIn the file: `{path}`. {_plain(objects[name])}\n")
        parts.append(_fields(objects[name], objects))
        for inner in _inside(objects, name, told):
            parts.append(f"### {inner}\n\n{_plain(objects[inner])}\n")
            parts.append(_fields(objects[inner], objects))
    for inner in [one for one in objects if one not in told]:
        parts.append(f"## {inner}\n\n{_plain(objects[inner])}\n\n{_fields(objects[inner], objects)}")
    return "\n".join(parts)


def _inside(objects: Mapping[str, Any], name: str, told: set[str]) -> Iterator[str]:
    """Yield the objects in an object that were not told before, each before those in it."""
    for inner in re.findall(r'"#/\$defs/(\w+)"', json.dumps(objects[name])):
        if inner not in told:
            told.add(inner)
            yield inner
            yield from _inside(objects, inner, told)


def _fields(described: Mapping[str, Any], objects: Mapping[str, Any]) -> str:
    """Return the table of an object's fields; a column in which nothing stands is left out."""
    rows = [
        (f"`{name}`", _type(one), _unit(name), _plain(one) or _first_sentence(one, objects))
        for name, one in described["properties"].items()
        if name != "results" or "properties" not in one
    ]
    head = ("field", "type", "unit", "meaning")
    kept = [at for at in range(len(head)) if any(row[at] for row in rows)]
    return table(tuple(head[at] for at in kept), [tuple(row[at] for at in kept) for row in rows])


def _first_sentence(one: Mapping[str, Any], objects: Mapping[str, Any]) -> str:
    """Return what the object that a field holds is."""
    name = next(iter(re.findall(r'"#/\$defs/(\w+)"', json.dumps(one))), "")
    return _plain(objects[name]).partition(". ")[0].rstrip(".") if name else ""


def _plain(described: Mapping[str, Any]) -> str:
    """Return a description of the code without the marks of its docstrings."""
    return str(described.get("description", "")).replace("``", "`")


def _unit(name: str) -> str:
    """Return the unit that a name ends with."""
    return next((one.spelled for suffix, one in UNITS.items() if name.endswith(f"_{suffix}")), "")


def _type(one: Mapping[str, Any]) -> str:
    """Return the type of a field in words, objects as links."""
    if "$ref" in one:
        name = one["$ref"].rpartition("/")[2]
        return f"[{name}](#{name})"
    if "const" in one:
        return str(one["const"])
    if "enum" in one:
        return ", ".join(str(value) for value in one["enum"])
    if "anyOf" in one:
        return " or ".join(_type(inner) for inner in one["anyOf"])
    kinds = one.get("type", "any")
    return " or ".join(_kind(kind, one) for kind in ([kinds] if isinstance(kinds, str) else kinds))


def _kind(kind: str, one: Mapping[str, Any]) -> str:
    if kind == "array":
        least, most = one.get("minItems"), one.get("maxItems")
        size = f"{least} " if least is not None and least == most else ""
        return f"list of {size}{_type(one.get('items', {}))}"
    inner = one.get("additionalProperties")
    if kind == "object" and isinstance(inner, Mapping):
        return f"object of {_type(inner)}"
    return {"string": "text", "boolean": "true or false"}.get(kind, kind)


# ------------------------------------------------------------------------------------------------ signals


def _signals() -> str:
    parts = [
        "# Every signal\n",
        "Topics and fields with units, ranges and senses, as the code has them; words and frames stand in the "
        "[glossary](glossary.md). A value out of its range is counted by `check`. `truth` has the fields of `ins` and "
        "only judges results.\n",
    ]
    for topic, fields in TOPICS.items():
        if topic != "truth":
            rows = [
                (f"`{one.name}`", one.kind, _unit(one.name), _range(one), sense_of(topic, one.name)) for one in fields
            ]
            parts.append(f"## {topic}\n\n" + table(("field", "kind", "unit", "range", "sense"), rows))
    return "\n".join(parts)


def _range(field: Field) -> str:
    if field.is_heading:
        return "[0, 360)"
    if field.kind != "double" or (math.isinf(field.low) and math.isinf(field.high)):
        return ""
    return f"at least {field.low:g}" if math.isinf(field.high) else f"[{field.low:g}, {field.high:g}]"
