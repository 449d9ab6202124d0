"""Two things at once: both are done, and what one of them raises is raised."""

import time
from threading import current_thread

import pytest

from groundstation.base.halves import both, two_at_once


def test_the_second_is_done_by_another_thread() -> None:
    names: dict[str, str] = {}
    both(
        lambda: names.update(first=current_thread().name),
        lambda: names.update(second=current_thread().name),
    )
    assert names["first"] != names["second"] == "half"


@pytest.mark.parametrize("failing", [0, 1])
def test_an_error_of_either_is_raised_when_both_have_ended(failing: int) -> None:
    done: list[int] = []

    def work(number: int) -> None:
        if number == failing:
            raise ValueError(f"half {number}")
        done.append(number)

    with pytest.raises(ValueError, match=f"half {failing}"):
        both(lambda: work(0), lambda: work(1))
    assert done == [1 - failing]


def test_what_two_make_comes_in_the_order_of_the_items() -> None:
    def slow_if_even(one: int) -> int:
        time.sleep(0.01 if one % 2 == 0 else 0.0)
        return 10 * one

    assert two_at_once(slow_if_even, range(7)) == [0, 10, 20, 30, 40, 50, 60]


def test_an_item_that_fails_fails_the_whole() -> None:
    with pytest.raises(ZeroDivisionError):
        two_at_once(lambda one: 1 / one, [3, 2, 0, 1])
