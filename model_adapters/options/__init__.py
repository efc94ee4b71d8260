"""What every adapter can be told, as dataclasses with defaults; nothing here imports torch or transformers.

So that models can be listed, and a slip on the command line told, before anything slow is imported.
"""

from model_adapters.options.parsing import NoOptions, describe, parse

__all__ = ["NoOptions", "describe", "parse"]
