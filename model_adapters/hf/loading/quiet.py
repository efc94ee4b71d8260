"""Progress bars and warnings of transformers, hidden from the user's terminal."""

from collections.abc import Iterator
from contextlib import contextmanager

from transformers.utils import logging

__all__ = ["hide_transformers_output"]


@contextmanager
def hide_transformers_output() -> Iterator[None]:
    """Hide progress bars and warnings of transformers within the context; errors are raised as
    always.

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
