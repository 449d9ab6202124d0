"""Two things at once: both are done, and what one of them raises is raised."""

from threading import current_thread

import pytest

from groundstation.base.halves import both


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
