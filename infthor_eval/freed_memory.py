"""What the C library does with memory that is freed."""

import ctypes
import platform

__all__ = ["keep_freed_memory"]

_SETTINGS = (  # numbers of <malloc.h>, and bytes
    (-1, 2**28),  # M_TRIM_THRESHOLD: kept at the end of the heap
    (-2, 2**26),  # M_TOP_PAD: asked for ahead; a thread's heap is not given back when it is empty
    (-3, 2**25),  # M_MMAP_THRESHOLD: least that is always asked for anew, at its highest
)


def keep_freed_memory() -> None:
    """Have glibc keep freed memory of this process for what is allocated next (mallopt(3)).

    It gives larger pieces back to the system and asks for them anew, and the system clears every
    page of them. For a frame of several crops that took as long as half of its arithmetic, for a
    step of the small model's training up to three times as long as all of its arithmetic.
    """
    if platform.libc_ver()[0] == "glibc":
        for setting in _SETTINGS:
            ctypes.CDLL(None).mallopt(*setting)
