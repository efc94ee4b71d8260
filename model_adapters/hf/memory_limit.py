"""A limit on the memory that a piece of code that comes with a checkpoint may take."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock

__all__ = ["OutOfMemoryError", "taking_at_most"]

_SIZE = Path("/proc/self/statm")  # its first number: the pages of address space that the process has
_MB = 1024 * 1024
_ALONE = Lock()  # of two at once, the second would restore the first one's limit


class OutOfMemoryError(Exception):
    """It would have taken more memory than it may."""


@contextmanager
def taking_at_most(megabytes: int) -> Iterator[None]:
    """Refuse what asks for more memory on top of what the process has; where the system does not tell, nothing is.

    It is the system that refuses, so it does not matter by which of Python's many ways a text becomes large. The limit
    is the process's: its other threads are held to it meanwhile, and one at a time may set it.

    Raises:
        OutOfMemoryError: it asked for more.
    """
    with _ALONE:
        before, highest = resource.getrlimit(resource.RLIMIT_AS)
        bound = _bound(megabytes, [limit for limit in (before, highest) if limit != resource.RLIM_INFINITY])
        resource.setrlimit(resource.RLIMIT_AS, (before if bound is None else bound, highest))
        try:
            yield
        except MemoryError as error:
            raise OutOfMemoryError(f"it takes more than {megabytes} MB of memory") from error
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (before, highest))


def _bound(megabytes: int, others: list[int]) -> int | None:
    """The address space that the process may have, in bytes; others' limits that are lower stay."""
    try:
        pages = int(_SIZE.read_text().split()[0])
    except OSError:
        return None
    # Beyond what the system can count, a limit is none.
    return min(pages * resource.getpagesize() + megabytes * _MB, 2**62, *others)
