"""What all runs of a command share: it is read once, and anew for the next command.

A process may do many commands (a notebook, a test), and files may have changed in between.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, ParamSpec, Protocol, TypeVar

Arguments = ParamSpec("Arguments")
T_co = TypeVar("T_co", covariant=True)
_N_KEPT = 8  # results of each function


class _Cached(Protocol[Arguments, T_co]):
    def __call__(self, *args: Arguments.args, **kwargs: Arguments.kwargs) -> T_co: ...

    def cache_clear(self) -> None: ...


_CACHED: list[_Cached[..., Any]] = []


def once_a_command(read: Callable[Arguments, T_co]) -> _Cached[Arguments, T_co]:
    """Keep what a function reads from files until `forget_files`; its arguments are hashable."""
    cached: Any = lru_cache(maxsize=_N_KEPT)(read)
    _CACHED.append(cached)
    return cached


def forget_files() -> None:
    """Begin a command: whatever an earlier one read is read again."""
    for cached in _CACHED:
        cached.cache_clear()
