"""Layout of a table by a profile: the column of each field, as the header states it."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Remark
from groundstation.base.signals import field_of
from groundstation.readers.days import day_ns
from groundstation.readers.dialect import uses_decimal_comma
from groundstation.readers.layout import (
    METHODS,
    Derivation,
    Key,
    LayoutRule,
    TableLayout,
    TimeRule,
    number_of,
    rule_for,
)
from groundstation.readers.norths import LOOKED_AT, OF_MOTION, Norths, by_motion, by_the_field, day_of, samples_of
from groundstation.readers.profile import ColumnRule, DerivedRule
from groundstation.readers.profile_fit import Fit
from groundstation.readers.source import Source
from groundstation.readers.told import ColumnFacts

_MOST_TOLD = 20  # missing columns
_HEIGHTS = {"altitude_ellipsoid_m": "ellipsoid", "altitude_msl_m": "msl"}


@dataclass
class _Fed:
    """Rules and derivations that are settled, and the remarks on them."""

    rules: dict[Key, LayoutRule]
    derivations: list[Derivation]
    remarks: list[Remark]

    def add(self, rule: LayoutRule) -> None:
        """Add a rule where its field is free."""
        self.rules.setdefault(rule.key, rule)


def layout_of(
    fit: Fit, source: Source, utc_of_zero_ns: int | None, end_byte: int | None
) -> tuple[TableLayout, list[Remark]]:
    """Return the layout of the rows below a header, up to ``end_byte``, and remarks."""
    profile = fit.profile
    time = _time(fit)
    fed = _Fed({}, [], [])
    found = [rule for rule in profile.columns if fit.position.keys() >= set(rule.names)]
    norths = _norths(fit, source, time, utc_of_zero_ns, end_byte)
    for rule in found:
        at = fit.position[rule.name]
        adapted = _adapted(rule, fit.told(at), fed.remarks)
        if adapted is not None:
            _feed(fit, adapted, at, norths, fed)
    missing = [
        name
        for rule in profile.columns
        for name in rule.names
        if name not in fit.position and (not rule.is_optional or (name == rule.side and rule.name in fit.position))
    ]
    if missing:
        text = f"profile {profile.name} names columns that are not there: {_with_nearest(fit, missing)}"
        fed.remarks.append(Remark("missing_columns", text))
    twice = dict.fromkeys(name for rule in found for name in rule.names if fit.names.count(name) > 1)
    if twice:
        fed.remarks.append(Remark("duplicate_column", f"{', '.join(twice)}: more than one column; the first is taken"))
    derivations = [*fed.derivations, *_derivations(fit, fed)]
    rules = [*fed.rules.values(), *_raw(fit, fed.rules.values(), derivations, time)]
    decimal_comma = uses_decimal_comma(fit.first_rows, fit.delimiter)
    texts = tuple(text for text in profile.missing if number_of(text) is None)
    return TableLayout(time, tuple(rules), tuple(derivations), decimal_comma, missing=texts), fed.remarks


def _with_nearest(fit: Fit, missing: Sequence[str]) -> str:
    """Name missing columns, each with those of the file that it may be."""
    from groundstation.readers.drafts.nearest import nearest_names

    targets = {rule.name: f"{rule.topic}.{rule.field.name}" for rule in fit.profile.columns}
    free = [name for name in fit.names if name and name not in targets and name not in fit.profile.time.columns]
    near = {name: nearest_names(name, targets.get(name, ""), free) for name in missing[:_MOST_TOLD]}
    told = [f"{name} (nearest: {', '.join(found)})" if found else name for name, found in near.items()]
    return ", ".join(told) + (f" and {len(missing) - _MOST_TOLD} more" if len(missing) > _MOST_TOLD else "")


def _time(fit: Fit) -> TimeRule:
    time = fit.profile.time
    day = day_ns(fit.metadata.get(time.date, ""), time.date_formats) if time.date else None
    names = tuple(name for name in time.columns if name in fit.position)
    return TimeRule(
        time.kind,  # type: ignore[arg-type]
        tuple(fit.position[name] for name in names),
        (", ".join(names),),
        *time.unit,
        date_formats=time.date_formats,
        day_ns=day or 0,
    )


def _adapted(rule: ColumnRule, said: ColumnFacts, remarks: list[Remark]) -> ColumnRule | None:
    """Adapt a rule to the unit and height that the file states; None if of another kind."""
    known = rule.field
    if said.unit is not None and known.unit and said.unit[0] != known.unit:
        if known.unit == "deg" and said.unit[0] == "m":  # (M): magnetic
            return rule
        text = f"{rule.name} is in {said.unit[0]} by the file's own header, {rule.topic}.{known.name} in {known.unit}"
        remarks.append(Remark("other_unit", f"{text}: the column is kept raw"))
        return None
    if said.unit is not None and known.unit and not np.isclose(said.unit[1], rule.unit_factor):
        ratio = said.unit[1] / rule.unit_factor
        rule = replace(rule, factor=rule.factor * ratio, offset=rule.offset * ratio)
        text = f"{rule.name} is in another unit than profile and family: that of the file's own header is taken"
        remarks.append(Remark("header_unit", text, rule.topic, (known.name,)))
    if said.height and known.name in _HEIGHTS and said.height != _HEIGHTS[known.name]:
        other = field_of(rule.topic, next(name for name, height in _HEIGHTS.items() if height == said.height))
        rule = rule if other is None else replace(rule, field=other)
    return rule


def _feed(fit: Fit, rule: ColumnRule, at: int, norths: Norths, fed: _Fed) -> None:
    """Add the rule of a column; for a magnetic direction also a derivation."""
    raw = (fit.profile.raw_topic, fit.label(at))
    north, by = rule.north, ""
    if rule.north and (said := fit.told(at).north):
        north, by = said, "its name"
    if rule.north and rule.field.name == "track_deg" and norths.track:
        north, by = norths.track, norths.track_by
    if north != rule.north:
        text = f"{rule.name} counts from {north} north, by {by}"
        fed.remarks.append(Remark("north", text, rule.topic, (rule.field.name,)))
    if north != "magnetic":
        fed.add(_with_cells(fit, rule_for(at, rule.topic, rule.field, rule.factor, rule.offset, raw), rule))
        return
    magnetic = field_of(rule.topic, "magnetic_heading_deg") if rule.field.name == "true_heading_deg" else None
    if magnetic is not None:
        fed.add(_with_cells(fit, rule_for(at, rule.topic, magnetic, rule.factor, rule.offset, raw), rule))
    else:
        fed.add(_with_cells(fit, LayoutRule(at, *raw, "double", rule.factor, rule.offset), rule))
    variation = fit.profile.variation
    if variation is None or variation.column not in fit.position:
        if magnetic is None:
            target = f"{rule.topic}.{rule.field.name}"
            text = f"{rule.name} counts from magnetic north, and the file tells no variation: no {target}"
            fed.remarks.append(Remark("magnetic_track", text, rule.topic))
        return
    sign = norths.sign or int(np.sign(variation.factor))
    if sign != np.sign(variation.factor):
        side = "east" if sign > 0 else "west"
        fed.remarks.append(Remark("variation_sign", f"{variation.column} is positive {side}, by {norths.sign_by}"))
    inputs = ((rule.topic, magnetic.name) if magnetic else raw, _raw_key(fit, variation.column))
    factors, outputs = (1.0, sign * abs(variation.factor)), (rule.field.name,)
    not_zero = inputs[1:] if norths.has_variation else ()
    fed.derivations.append(Derivation("true_from_magnetic", rule.topic, outputs, inputs, factors, not_zero))


def _with_cells(fit: Fit, made: LayoutRule, rule: ColumnRule) -> LayoutRule:
    """Return a rule of the layout with what the profile says of the cells."""
    side = fit.position[rule.side] if rule.side else None
    return replace(made, form=rule.form, values=rule.values, missing=rule.missing, part=rule.part, side=side)


def _raw_key(fit: Fit, name: str) -> Key:
    """Return raw topic and name of a column that no rule names."""
    return fit.profile.raw_topic, fit.label(fit.position[name])


def _derivations(fit: Fit, fed: _Fed) -> Iterator[Derivation]:
    """Derivations of the profile with inputs in the file and outputs that it does not tell."""
    known = fed.rules.keys() | {(one.topic, name) for one in fed.derivations for name in one.outputs}
    for rule in fit.profile.derived:
        outputs = {(rule.topic, name) for name in rule.outputs}
        if outputs <= known or not all(
            given.column in fit.position if given.column else given.key in known for given in rule.inputs
        ):
            continue
        keys = tuple(_raw_key(fit, given.column) if given.column else given.key for given in rule.inputs)
        yield Derivation(rule.method, rule.topic, rule.outputs, keys, _factors(fit, rule))
        known |= outputs


def _factors(fit: Fit, rule: DerivedRule) -> tuple[float, ...]:
    """Factors of the inputs of a derivation, by the unit that the file tells if it fits."""
    factors = []
    for given, unit in zip(rule.inputs, METHODS[rule.method].units, strict=True):
        said = fit.told(fit.position[given.column]).unit if given.column else None
        factors.append(said[1] if said is not None and said[0] == unit else given.factor)
    return tuple(factors)


def _raw(
    fit: Fit, rules: Iterable[LayoutRule], derivations: Sequence[Derivation], time: TimeRule
) -> Iterator[LayoutRule]:
    """Rules of columns that no other rule takes; derivations get numbers."""
    taken = {at for rule in rules for at in (rule.column, rule.side)} | set(time.columns)
    inputs = {key for derivation in derivations for key in derivation.inputs}
    for at, name in enumerate(fit.names):
        key = (fit.profile.raw_topic, fit.label(at))
        if name and at not in taken:
            yield LayoutRule(at, *key, "double" if key in inputs else "raw")


def _norths(fit: Fit, source: Source, time: TimeRule, utc_of_zero_ns: int | None, end_byte: int | None) -> Norths:
    """Find from the data which norths directions count from."""
    profile, variation = fit.profile, fit.profile.variation
    directions = {rule.field.name for rule in profile.columns if rule.north and rule.name in fit.position}
    if variation is None or variation.column not in fit.position or not directions:
        return Norths()
    rules = [LayoutRule(fit.position[variation.column], LOOKED_AT, "variation_deg", "double", abs(variation.factor))]
    rules += [
        _with_cells(fit, LayoutRule(fit.position[one.name], LOOKED_AT, one.field.name, "double", one.factor), one)
        for one in profile.columns
        if one.topic == "gnss" and one.field.name in OF_MOTION and fit.position.keys() >= set(one.names)
    ]
    layout = TableLayout(time, tuple(rules), decimal_comma=uses_decimal_comma(fit.first_rows, fit.delimiter))
    dialect = fit.dialect_to(end_byte)
    samples = samples_of(source, dialect, layout)
    found = by_motion(samples) if "track_deg" in directions else Norths()
    is_asked = not found.sign and samples.has_variation and "true_heading_deg" in directions
    day_ns = day_of(source, dialect, layout) if is_asked and utc_of_zero_ns is not None else None
    if day_ns is not None and utc_of_zero_ns is not None:
        field = by_the_field(samples, day_ns + utc_of_zero_ns)
        found = replace(found, sign=field.sign, sign_by=field.sign_by)
    return replace(found, has_variation=samples.has_variation)
