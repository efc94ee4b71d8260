"""A limit on the memory of code that comes with a checkpoint (chat templates)."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock

_SIZE = Path("/proc/self/statm")  # its first number is the process's address space in pages
_MB = 1024 * 1024
# Of two nested limits, the second would restore the first as if it were the original.
_LOCK = Lock()


class OutOfMemoryError(Exception):
    """Code needed more memory than allowed."""


@contextmanager
def limit_memory(megabytes: int) -> Iterator[None]:
    """Refuse allocations beyond the process's current memory plus this limit; no limit if the
    system has no /proc.

    The operating system enforces it, because Python has many ways to build a large text. The limit
    applies to the whole process, other threads included, and one thread at a time may set it.

    Raises:
        OutOfMemoryError: more memory was needed.
    """
    with _LOCK:
        before, highest = resource.getrlimit(resource.RLIMIT_AS)
        bound = _bound(
            megabytes, [limit for limit in (before, highest) if limit != resource.RLIM_INFINITY]
        )
        resource.setrlimit(resource.RLIMIT_AS, (before if bound is None else bound, highest))
        try:
            yield
        except MemoryError as error:
            raise OutOfMemoryError(f"it takes more than {megabytes} MB of memory") from error
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (before, highest))


def _bound(megabytes: int, others: list[int]) -> int | None:
    """Return the allowed address space of the process in bytes; lower limits of others are kept."""
    try:
        pages = int(_SIZE.read_text().split()[0])
    except OSError:
        return None
    # setrlimit cannot represent larger values.
    return min(pages * resource.getpagesize() + megabytes * _MB, 2**62, *others)
