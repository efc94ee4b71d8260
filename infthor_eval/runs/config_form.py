"""The form of a run's config in a journal's header.

A journal can be cut, edited, or of another suite, and its header's config is free-form JSON. Each
suite checks, before anything is summed up, the part of it that its summary and tables read.
"""

import msgspec

from infthor_eval.errors import wrap_errors
from infthor_eval.runs.journals.records import RunHeader

__all__ = ["check_config"]


def check_config(header: RunHeader, form: type[msgspec.Struct]) -> None:
    """Check that the config in a journal's header is of a suite's form.

    Raises:
        DataError: names the run, and the place in its config.
    """
    problem = f"{header.name}: not the config of a run of {header.suite}"
    hint = "run the evaluation again"
    with wrap_errors(problem, hint, catch=msgspec.ValidationError):
        msgspec.convert(header.config, form)
