"""What every refusal is: one line, with what is wrong, where, and the mend."""

from collections.abc import Callable

import pytest

from infthor_eval.errors import InfthorError

__all__ = ["assert_raises_one_line", "read_one_line"]


def read_one_line(caught: pytest.ExceptionInfo[Exception]) -> str:
    """The message of what was raised, which is one line."""
    message = str(caught.value)
    assert "\n" not in message
    return message


def assert_raises_one_line(
    do: Callable[[], object],
    expected: str,
    errors: type[InfthorError] | tuple[type[InfthorError], ...] = InfthorError,
) -> None:
    """Hold that something is refused in one line that says what is expected, by one of `errors`."""
    with pytest.raises(errors) as caught:
        do()
    message = read_one_line(caught)
    assert expected in message
    assert len(message) < 700
