"""Models for infthor-eval: the protocols that a model implements, and one module per model family.

Importing this package imports neither torch nor transformers; the first model that needs them does.

To add an engine: a package here whose model keeps `protocols.py` and passes `check_adapter`, and
its line in `built_in.py`. In another package: `docs/own-models.md`.
"""

from infthor_eval.formats.pictures.video import Video
from model_adapters.backend import Backend, BackendConversation
from model_adapters.check import CheckResult, ContractError, check_adapter, run_checks
from model_adapters.frame_policies import with_episodes
from model_adapters.guarded import identity_of
from model_adapters.protocols import (
    ROLES,
    Adapter,
    ArmDelta,
    ArmObservation,
    Batches,
    BatchModel,
    CacheCut,
    Capabilities,
    Conversation,
    Decoding,
    Episode,
    FramePolicy,
    HandState,
    KeptCache,
    Mark,
    Model,
    Notice,
    Part,
    PersonModel,
    Policy,
    Reply,
    Role,
    Subject,
    Turn,
)
from model_adapters.refusals import check_decoding, check_turns, refuse_batches, wrap_request_errors
from model_adapters.registry import (
    adapter_identity,
    check_options,
    has_option,
    is_known,
    label,
    load,
    model_note,
    name_on_engine,
    names,
    options_of,
    switched_on,
    switches,
)
from model_adapters.thinking import Thought, answer_of, cut_at_stop
from model_adapters.transcript import Transcript

__all__ = [
    "ROLES",
    "Adapter",
    "ArmDelta",
    "ArmObservation",
    "Backend",
    "BackendConversation",
    "BatchModel",
    "Batches",
    "CacheCut",
    "Capabilities",
    "CheckResult",
    "ContractError",
    "Conversation",
    "Decoding",
    "Episode",
    "FramePolicy",
    "HandState",
    "KeptCache",
    "Mark",
    "Model",
    "Notice",
    "Part",
    "PersonModel",
    "Policy",
    "Reply",
    "Role",
    "Subject",
    "Thought",
    "Transcript",
    "Turn",
    "Video",
    "adapter_identity",
    "answer_of",
    "check_adapter",
    "check_decoding",
    "check_options",
    "check_turns",
    "cut_at_stop",
    "has_option",
    "identity_of",
    "is_known",
    "label",
    "load",
    "model_note",
    "name_on_engine",
    "names",
    "options_of",
    "refuse_batches",
    "run_checks",
    "switched_on",
    "switches",
    "with_episodes",
    "wrap_request_errors",
]
