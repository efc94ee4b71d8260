"""Models for infthor-eval: what a model is to the harness, and one module per model family.

Importing this package imports neither torch nor transformers; they come with the first model that needs them.
"""

from model_adapters.backend import Backend, BackendConversation, OneByOne
from model_adapters.check import ContractError, check_adapter, check_bound
from model_adapters.protocols import (
    Adapter,
    BatchingConversation,
    Bound,
    Conversation,
    ExtendableModel,
    Mark,
    Model,
    Part,
    Reply,
)
from model_adapters.registry import check_options, load, names, options
from model_adapters.transcript import Transcript

__all__ = [
    "Adapter",
    "Backend",
    "BackendConversation",
    "BatchingConversation",
    "Bound",
    "ContractError",
    "Conversation",
    "ExtendableModel",
    "Mark",
    "Model",
    "OneByOne",
    "Part",
    "Reply",
    "Transcript",
    "check_adapter",
    "check_bound",
    "check_options",
    "load",
    "names",
    "options",
]
