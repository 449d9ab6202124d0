"""The dataclasses of base mean what the standard ones mean."""

import copy
import dataclasses
import inspect
import pickle
import re
import threading
from collections.abc import Callable
from dataclasses import FrozenInstanceError, asdict, field, fields, replace
from functools import cached_property
from operator import eq
from pathlib import Path
from typing import Any, ClassVar

import pytest

import groundstation
from groundstation.base.dataclasses import INIT, dataclass

Make = Callable[..., Any]
STANDARD_IMPORT = re.compile(r"^ *from dataclasses import .*\bdataclass\b|^@dataclasses\.dataclass", re.MULTILINE)


def _family(make: Make) -> dict[str, Any]:
    """Return the same classes, made by one decorator."""

    @make(frozen=True)
    class Plain:
        """A plain one."""

        first: int
        second: float = 2.0
        third: list[int] = field(default_factory=list)
        label: ClassVar[str] = "none of its fields"

        @cached_property
        def double(self) -> float:
            return 2.0 * self.second

    @make(frozen=True)
    class Heir(Plain):
        fourth: str = "x"

    @make
    class Changeable:
        first: int
        second: int = field(default=3, repr=False, compare=False)

        def __post_init__(self) -> None:
            self.third = self.first + self.second

    @make(frozen=True, kw_only=True)
    class ByName:
        first: int = 1
        second: int

    @make(frozen=True, eq=False)
    class Identity:
        first: int

    @make(frozen=True, repr=False)
    class OwnRepr:
        first: int
        hidden: int = field(default=7, init=False)
        made: list[int] = field(default_factory=lambda: [1], init=False, hash=False)

        def __repr__(self) -> str:
            return "mine"

    @make(frozen=True)
    class Empty:
        """Nothing in it."""

    @make(frozen=True)
    class MixedOrder:
        named: int = field(kw_only=True)
        first: int
        last: int = 5

    return {one.__name__: one for one in (Plain, Heir, Changeable, ByName, Identity, OwnRepr, Empty, MixedOrder)}


OURS, STANDARD = _family(dataclass), _family(dataclasses.dataclass)
GIVEN: dict[str, list[tuple[tuple[Any, ...], dict[str, Any]]]] = {
    "Plain": [((1,), {}), ((1, 2.5, [3]), {}), ((), {"first": 1, "third": [2]}), ((), {}), ((1, 2, 3, 4), {})],
    "Heir": [((1,), {"fourth": "y"}), ((1, 2.0, [], "z"), {}), ((1,), {"fifth": 0})],
    "Changeable": [((1,), {}), ((1, 4), {}), ((1, 5), {}), ((), {"second": 1})],
    "ByName": [((), {"second": 2}), ((), {"first": 3, "second": 2}), ((1, 2), {}), ((), {})],
    "Identity": [((1,), {}), ((1,), {})],
    "OwnRepr": [((1,), {}), ((2,), {}), ((1, 2), {})],
    "Empty": [((), {}), ((1,), {})],
    "MixedOrder": [((1,), {"named": 2}), ((1, 3), {"named": 2}), ((1, 2, 3), {})],
}


def _answer(do: Callable[..., Any], *args: Any, **named: Any) -> Any:
    """Return what a call gives, or the words of its error: the other decorator must say the same."""
    try:
        return do(*args, **named)
    except (TypeError, AttributeError, FrozenInstanceError) as error:
        return type(error), str(error)


@pytest.mark.parametrize("name", OURS)
def test_instances_do_what_those_of_the_standard_decorator_do(name: str) -> None:
    made = []
    for args, named in GIVEN[name]:
        ours, standard = (_answer(side[name], *args, **named) for side in (OURS, STANDARD))
        if isinstance(standard, tuple):
            assert ours == standard
        else:
            made.append((ours, standard))
    assert made
    for ours, standard in made:
        assert vars(ours) == vars(standard)
        assert ours != "another thing"
        if name != "Identity":
            assert repr(ours) == repr(standard)
            assert _answer(hash, ours) == _answer(hash, standard)
        assert asdict(ours) == asdict(standard)
        for changed in ("first", "other"):
            told = [_answer(setattr, one, changed, 9) for one in (ours, standard)]
            assert told[0] == told[1]
        told = [_answer(delattr, one, "first") for one in (ours, standard)]
        assert told[0] == told[1]
    equal = [[_answer(eq, one, other) for one in side for other in side] for side in zip(*made, strict=True)]
    assert equal[0] == equal[1]


@pytest.mark.parametrize("name", OURS)
def test_classes_show_what_those_of_the_standard_decorator_show(name: str) -> None:
    ours, standard = _family(dataclass)[name], _family(dataclasses.dataclass)[name]  # not used yet
    assert inspect.signature(ours).parameters.keys() == inspect.signature(standard).parameters.keys()
    assert ours.__match_args__ == standard.__match_args__
    told = [[(one.name, one.type, one.default, one.kw_only) for one in fields(cls)] for cls in (ours, standard)]
    assert told[0] == told[1]
    assert ours.__dataclass_params__.frozen == standard.__dataclass_params__.frozen


def test_init_is_compiled_at_the_first_instance_alone() -> None:
    plain = _family(dataclass)["Plain"]
    assert not inspect.isfunction(vars(plain)[INIT])
    first = plain(1)
    compiled = vars(plain)[INIT]
    assert inspect.isfunction(compiled)
    changed = replace(first, second=4.0)
    assert changed == plain(1, 4.0)
    assert changed.double == 8.0
    assert vars(plain)[INIT] is compiled


def test_an_heir_may_be_made_by_either_decorator() -> None:
    heir = dataclasses.dataclass(frozen=True)(type("Heir", (OURS["Plain"],), {"__annotations__": {}}))
    other = dataclass(frozen=True)(type("Other", (STANDARD["Plain"],), {"__annotations__": {}}))
    for made in (heir(1), other(1)):
        assert made.first == 1
        with pytest.raises(FrozenInstanceError):
            made.first = 2
    with pytest.raises(TypeError, match="non-frozen"):
        dataclass(type("Bad", (OURS["Plain"],), {"__annotations__": {"fifth": int}}))


@dataclass(frozen=True)
class Carried:
    """What goes to another process."""

    value: int
    parts: tuple[int, ...] = ()


def test_copies_and_pickles_are_equal() -> None:
    one = Carried(1, (2,))
    for other in (copy.copy(one), copy.deepcopy(one), pickle.loads(pickle.dumps(one))):
        assert other == one
        assert hash(other) == hash(one)


def test_a_pickle_may_be_read_before_the_first_instance_is_made() -> None:
    new: Any = dataclass(frozen=True)(type("Carried", (), {"__annotations__": {"value": int}}))
    one = new.__new__(new)
    vars(one)["value"] = 3
    assert repr(one) == "Carried(value=3)"
    assert one == new(3)
    assert hash(one) == hash(new(3))


def test_threads_may_make_the_first_instance_together() -> None:
    for _ in range(50):
        plain, made, gate = _family(dataclass)["Plain"], list[Any](), threading.Barrier(4)

        def work(plain: Any = plain, made: list[Any] = made, gate: threading.Barrier = gate) -> None:
            gate.wait()
            made.append(plain(1))

        threads = [threading.Thread(target=work) for _ in range(4)]
        for one in threads:
            one.start()
        for one in threads:
            one.join()
        assert made == [plain(1)] * 4


def test_other_options_are_those_of_the_standard_decorator() -> None:
    @dataclass(frozen=True, slots=True, order=True)
    class Slotted:
        first: int

    assert not hasattr(Slotted(1), "__dict__")
    assert Slotted(1) < Slotted(2)


def test_a_field_without_a_default_after_one_with_it_is_refused() -> None:
    made: Any = dataclass(type("Bad", (), {"__annotations__": {"first": int, "second": int}, "first": 1}))
    with pytest.raises(TypeError, match="non-default argument 'second'"):
        made(2)


def test_every_module_of_the_package_takes_this_decorator() -> None:
    told = [
        str(path)
        for path in sorted(Path(groundstation.__file__).parent.rglob("*.py"))
        if path.name != "dataclasses.py" and STANDARD_IMPORT.search(path.read_text(encoding="utf-8"))
    ]
    assert not told, f"from groundstation.base.dataclasses import dataclass: {', '.join(told)}"
