"""Code of one's own that ends the process without a word, or keeps it when the command is done."""

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

from infthor_eval.storage.limits import OWN_CODE_SECONDS
from infthor_eval.terminal import print_error

__all__ = ["end_process", "noticed"]

_SOON_S = 1.0  # in which most threads end by themselves
end_process = os._exit


@contextmanager
def noticed() -> Iterator[None]:
    """Notice within the context what own code does to the process.

    `os._exit` is `sys.exit` there, which is an error of whatever called it. Threads that are left
    are told, and the process does not wait for them longer than `limits.OWN_CODE_SECONDS`.
    """
    process, before = os.getpid(), set(threading.enumerate())

    def exit_as_error(status: int) -> NoReturn:
        if os.getpid() != process:  # forked, as those of multiprocessing, which end so
            end_process(status)
        raise SystemExit(f"os._exit({status})")

    os._exit = exit_as_error
    try:
        yield
    except SystemExit as ended:
        left = [it for it in set(threading.enumerate()) - before if not it.daemon]
        if left:
            code = ended.code if isinstance(ended.code, int) else 1
            threading.Thread(target=_end_at_last, args=(left, code), daemon=True).start()
        raise
    finally:
        os._exit = end_process


def _end_at_last(left: list[threading.Thread], code: int) -> None:
    """Wait for threads once the main one has ended, as Python does, but not for ever."""
    threading.main_thread().join()
    time.sleep(_SOON_S)
    alive = [thread.name for thread in left if thread.is_alive()]
    if not alive:
        return
    seconds = OWN_CODE_SECONDS.value
    print_error(
        f"your own code left a thread that runs on ({alive[0]}); make it end, or a daemon; the "
        f"process ends in {seconds} s ({OWN_CODE_SECONDS.name})"
    )
    time.sleep(seconds)
    sys.stdout.flush()
    end_process(code)
