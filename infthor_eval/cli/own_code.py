"""Code of one's own that ends the process without a word, or keeps it when the command is done."""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

from infthor_eval.storage.limits import OWN_CODE_SECONDS
from infthor_eval.terminal import print_error

_SOON_S = 1.0  # in which most threads end by themselves
end_process = os._exit


@contextmanager
def noticed() -> Iterator[None]:
    """Make `os._exit` an error of whoever calls it within the context, as `sys.exit` is one, and
    wait for threads that were begun in it for no longer than `limits.OWN_CODE_SECONDS`."""
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
        threading.Thread(target=_end_at_last, args=(left, ended.code), daemon=True).start()
        raise
    finally:
        os._exit = end_process


def _end_at_last(left: list[threading.Thread], code: int) -> None:
    """Once the main thread has ended, wait for others, as Python does, but not for ever."""
    threading.main_thread().join()
    time.sleep(_SOON_S)
    alive = [thread.name for thread in left if thread.is_alive()]
    if alive:
        print_error(
            f"your own code left a thread that runs on ({alive[0]}); make it end, or a daemon; the "
            f"process ends in {OWN_CODE_SECONDS.value} s ({OWN_CODE_SECONDS.name})"
        )
        time.sleep(OWN_CODE_SECONDS.value)
        end_process(code)
