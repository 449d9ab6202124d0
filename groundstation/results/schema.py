"""JSON Schema of summary.json, made from the dataclasses that are written to it.

``make schemas`` writes it. Limits beyond the type stand in the metadata of a field (``one_of``, ``pattern``, ``keys``,
``items``: see :func:`_narrowed`) or follows from its name: shares lie within [0, 1], sigmas and lengths are not
negative, whole numbers are counts.
"""

import dataclasses
import itertools
import re
import sys
import types
import typing
from collections.abc import Mapping
from typing import Any

from groundstation.base.serial import is_kept_apart
from groundstation.results.document import SCHEMA_VERSION, SummaryDocument
from groundstation.results.installations import FORMAT_VERSION, Installations
from groundstation.results.meanings import meanings_of

TITLE = "summary.json of one flight"
ABOUT = (
    "Answers of groundstation about one flight. Numbers are rounded to the digits stated for each field; NaN is null. "
    "Units stand last in the names. Times are flight seconds."
)
SHARES = re.compile(r"(share|coverage|observability|inside)\d*(_.*)?|.*_share")
NOT_NEGATIVE = re.compile(r".*sigma.*|(length|longest|total|span|nominal_period|residual|resolution)_s|completeness")
Schema = dict[str, Any]


def installations_schema() -> Schema:
    """The schema of installations.json."""
    definitions: dict[str, Schema] = {}
    whole = _object(Installations, definitions)
    whole["properties"]["format_version"] = {"const": FORMAT_VERSION}
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "installations.schema.json",
        "title": "installations.json of a folder of flights",
    }
    return {**head, **whole, "$defs": definitions}


def summary_schema(answer_types: Mapping[str, type]) -> Schema:
    """The schema of summary.json.

    Parameters
    ----------
    answer_types : mapping of analysis name to dataclass
        Answers that may stand in ``results``.
    """
    definitions: dict[str, Schema] = {}
    whole = _object(SummaryDocument, definitions)
    whole["properties"]["schema_version"] |= {"const": SCHEMA_VERSION}
    del whole["properties"]["schema_version"]["type"], whole["properties"]["schema_version"]["minimum"]
    whole["properties"]["results"] = {
        "description": "One entry per analysis that could run.",
        "type": "object",
        "properties": {name: _of(answer, definitions) for name, answer in answer_types.items()},
        "additionalProperties": False,
    }
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": "summary.schema.json", "title": TITLE}
    return {**head, **whole, "description": ABOUT, "$defs": definitions}


def definition_name(cls: type) -> str:
    """Name of a dataclass among the definitions.

    It is the one that the class states as ``schema_name``, else that of the class itself.

    Examples
    --------
    >>> from groundstation.results.gates import Gate
    >>> from groundstation.results.roles import AzimuthEstimate
    >>> definition_name(Gate), definition_name(AzimuthEstimate)
    ('gate', 'azimuth')
    """
    stated: str | None = vars(cls).get("schema_name")
    return stated or re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()


def _has_known_numbers(cls: type) -> bool:
    """Tell whether the floats of a dataclass are never NaN.

    Its module says so by ``NUMBERS_ARE_KNOWN``.
    """
    return bool(getattr(sys.modules[cls.__module__], "NUMBERS_ARE_KNOWN", False))


def _object(cls: type, definitions: dict[str, Schema]) -> Schema:
    """Return the schema of a dataclass: its fields in order.

    All are required but those that are left out when they say nothing.
    """
    hints, told = typing.get_type_hints(cls), meanings_of(cls)
    properties: dict[str, Schema] = {}
    required: list[str] = []
    for field in dataclasses.fields(cls):
        hint = hints[field.name]
        if is_kept_apart(hint):
            continue
        found = _narrowed(_of(hint, definitions, _has_known_numbers(cls)), field.metadata)
        if field.name in told:
            found = {"description": told[field.name], **found}
        properties[field.name] = _bounded(found, field.name)
        if "left_out_when_default" not in field.metadata:
            required.append(field.name)
    return {
        "description": _about(cls),
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _of(hint: Any, definitions: dict[str, Schema], is_known: bool = False) -> Schema:
    """Return the schema of a type; ``is_known``: a float is never NaN."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if dataclasses.is_dataclass(hint):
        name = definition_name(typing.cast(type, hint))
        if name not in definitions:
            definitions[name] = {}  # its place is before those of its fields
            definitions[name] = _object(typing.cast(type, hint), definitions)
        return {"$ref": f"#/$defs/{name}"}
    if origin is typing.Literal:
        return {"enum": list(arguments)}
    if origin in (typing.Union, types.UnionType):
        return _one_of_several([_of(one, definitions, is_known) for one in arguments])
    if origin is tuple:
        return _array(arguments, definitions, is_known)
    if origin in (Mapping, dict):
        return {"type": "object", "additionalProperties": _of(arguments[1], definitions)}
    plain: dict[Any, Schema] = {
        str: {"type": "string"},
        bool: {"type": "boolean"},
        int: {"type": "integer", "minimum": 0},
        float: {"type": "number" if is_known else ["number", "null"]},
        type(None): {"type": "null"},
        Any: {},
    }
    return plain[hint]


def _array(arguments: tuple[Any, ...], definitions: dict[str, Schema], is_known: bool) -> Schema:
    if arguments[-1] is Ellipsis:
        return {"type": "array", "items": _of(arguments[0], definitions, is_known)}
    items = [_of(one, definitions, is_known) for one in arguments]
    size = {"minItems": len(items), "maxItems": len(items)}
    if all(item == items[0] for item in items):
        return {"type": "array", "items": items[0], **size}
    return {"type": "array", "prefixItems": items, **size}


def _one_of_several(members: list[Schema]) -> Schema:
    """Return the schema that allows any of several; plain types go in one list."""
    if not all(member.keys() <= {"type", "minimum"} for member in members):
        return {"anyOf": members}
    kinds: list[str] = []
    for member in members:
        kinds += [member["type"]] if isinstance(member["type"], str) else member["type"]
    if "number" in kinds:
        kinds = [kind for kind in kinds if kind != "integer"]
    least = {"minimum": 0} if "integer" in kinds else {}
    return {"type": list(dict.fromkeys(kinds)), **least}


def _narrowed(schema: Schema, metadata: Mapping[str, Any]) -> Schema:
    """Add the limits in the metadata of a field to the schema of its type.

    ``one_of``: texts it may be (of a mapping: its values); ``pattern``: of a text; ``keys``: of a mapping; ``items``:
    how many; ``above``, ``least``: a number is greater, or not less.
    """
    found = dict(schema)
    if "one_of" in metadata:
        allowed = {"enum": list(metadata["one_of"])}
        found = {**found, "additionalProperties": allowed} if found.get("type") == "object" else allowed
    if "pattern" in metadata:
        found["pattern"] = metadata["pattern"]
    if "keys" in metadata:
        found["propertyNames"] = {"enum": list(metadata["keys"])}
    if "items" in metadata:
        found |= {"minItems": metadata["items"], "maxItems": metadata["items"]}
    if "above" in metadata:
        found |= {"type": "number", "exclusiveMinimum": metadata["above"]}
    if "least" in metadata:
        found["minimum"] = metadata["least"]
    return found


def _bounded(schema: Schema, name: str) -> Schema:
    """Add the bounds that follow from the name of a field.

    They hold for numbers, and for the numbers in an object.
    """
    if name == "completeness" or (schema.get("type") == "object" and NOT_NEGATIVE.fullmatch(name)):
        return {**schema, "additionalProperties": _bounded(schema["additionalProperties"], "sigma")}
    kinds = schema.get("type", ())
    if "number" not in ([kinds] if isinstance(kinds, str) else kinds):
        return schema
    if SHARES.fullmatch(name):
        return {**schema, "minimum": 0, "maximum": 1}
    return {**schema, "minimum": 0} if NOT_NEGATIVE.fullmatch(name) else schema


def _about(cls: type) -> str:
    """Return the text of a class's docstring above its first section."""
    paragraphs = (" ".join(one.split()) for one in (cls.__doc__ or "").split("\n\n"))
    return " ".join(itertools.takewhile(lambda one: "----" not in one, paragraphs)).strip()


def schema_text(answer_types: Mapping[str, type]) -> str:
    """The schema as it is kept in schemas/."""
    from groundstation.results.files import json_text

    return json_text(summary_schema(answer_types))
