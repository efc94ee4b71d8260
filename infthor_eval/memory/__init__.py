"""What may be remembered of a trajectory, at what cost: memories' protocol, and those built in."""

from infthor_eval.memory.budgets import check_recalled, pieces_of, read_budget
from infthor_eval.memory.protocol import (
    Memory,
    MemoryCapabilities,
    Observation,
    Query,
    Recalled,
    TrajectoryFacts,
    Write,
    tokens_of,
)
from infthor_eval.memory.registry import (
    MEMORIES,
    MemoryArgs,
    accepted_options,
    memory_class,
    memory_identity,
    open_memory,
    parse_options,
    wrap_memory_errors,
)

__all__ = [
    "MEMORIES",
    "Memory",
    "MemoryArgs",
    "MemoryCapabilities",
    "Observation",
    "Query",
    "Recalled",
    "TrajectoryFacts",
    "Write",
    "accepted_options",
    "check_recalled",
    "memory_class",
    "memory_identity",
    "open_memory",
    "parse_options",
    "pieces_of",
    "read_budget",
    "tokens_of",
    "wrap_memory_errors",
]
