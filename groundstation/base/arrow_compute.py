"""Functions of ``pyarrow.compute`` that reading tables needs, by the same names.

Importing ``pyarrow.compute`` wraps every function of Arrow, with its documentation: half of what pyarrow takes. The
functions themselves stand in the module below it, which is not documented: where it is another one, theirs serve.
"""

from typing import Any

try:
    import pyarrow._compute as _arrow

    _call = _arrow.call_function
except (ImportError, AttributeError):
    import pyarrow.compute as _arrow

    _call = _arrow.call_function

CastOptions = _arrow.CastOptions


def all(values: Any, *, min_count: int) -> Any:
    """Tell whether all values are true; of fewer than ``min_count`` that is not known."""
    return _call("all", [values], _arrow.ScalarAggregateOptions(min_count=min_count))


def any(values: Any) -> Any:
    """Tell whether any value is true."""
    return _call("any", [values])


def binary_join_element_wise(*parts: Any) -> Any:
    """Join texts row by row, with the last argument between them.

    Examples
    --------
    >>> import pyarrow as pa
    >>> binary_join_element_wise(pa.array(["N", "S"]), pa.array(["1", "2"]), " ").to_pylist()
    ['N 1', 'S 2']
    """
    return _call("binary_join_element_wise", list(parts))


def cast(values: Any, target_type: Any = None, *, options: Any = None) -> Any:
    """Convert values to another type, safely or as options say.

    Examples
    --------
    >>> import pyarrow as pa
    >>> cast(pa.array(["1.5"]), pa.float64()).to_pylist()
    [1.5]
    """
    return _call("cast", [values], CastOptions.safe(target_type) if options is None else options)


def coalesce(*values: Any) -> Any:
    """Return the first value of each row that is not null."""
    return _call("coalesce", list(values))


def dictionary_encode(values: Any, null_encoding: str = "mask") -> Any:
    """Code values by a dictionary of those that differ."""
    return _call("dictionary_encode", [values], _arrow.DictionaryEncodeOptions(null_encoding=null_encoding))


def equal(a: Any, b: Any) -> Any:
    """Tell where values are equal."""
    return _call("equal", [a, b])


def extract_regex(text: Any, pattern: str) -> Any:
    """Return the named groups of a pattern, null where it does not match."""
    return _call("extract_regex", [text], _arrow.ExtractRegexOptions(pattern))


def fill_null(values: Any, filler: Any) -> Any:
    """Return values with a scalar of their type where they are null."""
    return _call("coalesce", [values, filler])


def filter(values: Any, mask: Any) -> Any:
    """Return the values where a mask is true."""
    return _call("filter", [values, mask])


def if_else(condition: Any, a: Any, b: Any) -> Any:
    """Return values of the first where a condition is true, else of the second."""
    return _call("if_else", [condition, a, b])


def is_in(values: Any, *, value_set: Any) -> Any:
    """Tell where values are among those of a set."""
    return _call("is_in", [values], _arrow.SetLookupOptions(value_set))


def is_valid(values: Any) -> Any:
    """Tell where values are not null."""
    return _call("is_valid", [values])


def match_substring_regex(text: Any, pattern: str) -> Any:
    """Tell where a pattern is found."""
    return _call("match_substring_regex", [text], _arrow.MatchSubstringOptions(pattern))


def replace_substring(text: Any, pattern: str, replacement: str, *, max_replacements: int | None = None) -> Any:
    """Replace a text inside others, the first times alone where stated."""
    options = _arrow.ReplaceSubstringOptions(pattern, replacement, max_replacements=max_replacements)
    return _call("replace_substring", [text], options)


def replace_substring_regex(text: Any, pattern: str, replacement: str) -> Any:
    """Replace what matches a pattern."""
    return _call("replace_substring_regex", [text], _arrow.ReplaceSubstringOptions(pattern, replacement))


def starts_with(text: Any, pattern: str) -> Any:
    """Tell where texts start with another."""
    return _call("starts_with", [text], _arrow.MatchSubstringOptions(pattern))


def struct_field(values: Any, indices: list[int]) -> Any:
    """Return the part of structures at a place."""
    return _call("struct_field", [values], _arrow.StructFieldOptions(indices))


def utf8_lower(text: Any) -> Any:
    """Return texts in small letters."""
    return _call("utf8_lower", [text])


def utf8_slice_codeunits(text: Any, start: int, stop: int) -> Any:
    """Return the characters between two places.

    Examples
    --------
    >>> import pyarrow as pa
    >>> utf8_slice_codeunits(pa.array(["North"]), 0, 1).to_pylist()
    ['N']
    """
    return _call("utf8_slice_codeunits", [text], _arrow.SliceOptions(start, stop))


def utf8_trim_whitespace(text: Any) -> Any:
    """Return texts without blanks at their ends."""
    return _call("utf8_trim_whitespace", [text])


def utf8_upper(text: Any) -> Any:
    """Return texts in capitals."""
    return _call("utf8_upper", [text])
