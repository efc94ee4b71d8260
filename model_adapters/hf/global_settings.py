"""Settings of torch and transformers that hold for the whole process, changed for a while."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from transformers.utils import logging


@contextmanager
def torch_threads(n_threads: int | None) -> Iterator[None]:
    """Compute with this many torch threads within the context; None leaves the number as it is.

    torch's number of threads is global, so it is restored afterwards for the other models of the
    process.
    """
    before = torch.get_num_threads()
    if n_threads is None or n_threads == before:
        yield
        return
    torch.set_num_threads(n_threads)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextmanager
def hide_transformers_output() -> Iterator[None]:
    """Hide transformers' progress bars and warnings within the context; errors are raised.

    Both settings are global in transformers, so they are restored afterwards.
    """
    verbosity = logging.get_verbosity()
    has_bars = logging.is_progress_bar_enabled()
    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        yield
    finally:
        logging.set_verbosity(verbosity)
        if has_bars:
            logging.enable_progress_bar()
