"""Options of all adapters, as dataclasses with defaults.

Nothing here imports torch or transformers, so that listing models and reporting a typing error take
no time.
"""

from infthor_eval.settings import NoOptions
from model_adapters.options.parsing import describe, parse, shown_default, with_defaults

__all__ = ["NoOptions", "describe", "parse", "shown_default", "with_defaults"]
