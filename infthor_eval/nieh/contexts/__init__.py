"""Contexts by the names that task files use.

To add a context (what a model sees): its functions here, its entry in `CONTEXTS` and a task
file in `tasks/nieh/contexts/`.
"""

from infthor_eval.errors import UsageError
from infthor_eval.nieh.contexts import interleaved, memory, video, views
from infthor_eval.nieh.contexts.base import (
    VIEW_FOLLOWS,
    Context,
    ContextPart,
    ContextSettings,
    QuestionVariant,
    trajectories_identity,
)
from infthor_eval.nieh.contexts.haystack import haystack
from infthor_eval.nieh.prompts import PROMPTS

__all__ = [
    "CONTEXTS",
    "DEFAULT_CONTEXT",
    "MEMORY",
    "RETRIEVED",
    "VIEW_FOLLOWS",
    "Context",
    "ContextPart",
    "ContextSettings",
    "QuestionVariant",
    "check_prompt",
    "context_named",
]

DEFAULT_CONTEXT = "clues"  # of tasks and docs that leave it open
MEMORY = "memory"  # the context that a memory recalls
RETRIEVED = "clip_retrieval"  # whose frames a model chooses: a journal does not have them
_INTERLEAVED = "Answer the question given the state and action sequence of the embodied agent."

CONTEXTS = {
    "clues": Context(views.clues, prompts=PROMPTS),
    "trajectory": Context(views.trajectory, prompts=PROMPTS),
    "truncate_head": Context(views.truncate_head, needs_model=True, prompts=PROMPTS),
    "haystack": Context(haystack, needs_model=True, prompts=PROMPTS),
    "interleaved": Context(
        interleaved.interleaved,
        intro=_INTERLEAVED,
        intro_without_frames=_INTERLEAVED,
        parts=interleaved.interleaved_parts,
        sources=trajectories_identity,
    ),
    "interleaved_plans": Context(
        interleaved.interleaved_plans,
        intro=_INTERLEAVED,
        intro_without_frames=_INTERLEAVED,
        parts=interleaved.plans_parts,
    ),
    "text_state": Context(
        views.text_state,
        intro="Answer the question given the description of the environment and the agent's state "
        "(the last image).",
        intro_without_frames="Answer the question given the description of the environment and "
        "the agent's state.",
        parts=views.state_parts,
        sources=trajectories_identity,
    ),
    RETRIEVED: Context(views.clip_retrieval, prompts=PROMPTS, sources=views.retriever_identity),
    "video": Context(
        video.video,
        intro="Answer the question given the video showing the agent's trajectory over time.",
        parts=video.video_parts,
        frames=video.video_frames,
        positions=video.video_positions,
        sources=video.video_identity,
    ),
    MEMORY: Context(
        memory.memory,
        intro_without_frames="Answer the question given what was recalled of the agent's views, "
        "in time order.",
        parts=memory.recalled_parts,
        sources=memory.memory_sources,
    ),
}


def context_named(name: str) -> Context:
    """Return the context of a name."""
    if name not in CONTEXTS:
        raise UsageError(
            f"unknown context {name!r}; a task's dataset_kwargs takes {', '.join(CONTEXTS)}"
        )
    return CONTEXTS[name]


def check_prompt(name: str, prompt: str) -> None:
    """Check that a context can be asked in the words of a prompt."""
    if prompt not in context_named(name).prompts:
        takers = ", ".join(
            other for other, context in CONTEXTS.items() if prompt in context.prompts
        )
        raise UsageError(
            f"prompt {prompt}: the context {name} is asked in words of its own; it is for {takers}"
        )
