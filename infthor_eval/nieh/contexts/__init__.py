"""Contexts by the names that task files use."""

from infthor_eval.errors import UsageError
from infthor_eval.nieh.contexts import interleaved, memory, plans, retrieval, text_state, video, views
from infthor_eval.nieh.contexts.base import Context, ContextPart, ContextSettings, Sample, trajectories_identity
from infthor_eval.nieh.contexts.haystack import haystack

__all__ = ["CONTEXTS", "MEMORY", "Context", "ContextPart", "ContextSettings", "Sample", "context_named"]

MEMORY = "memory"  # the context that a memory recalls
_INTERLEAVED = "Answer the question given the state and action sequence of the embodied agent."

CONTEXTS = {
    "clues": Context(views.clues),
    "trajectory": Context(views.trajectory),
    "truncate_head": Context(views.truncate_head, needs_model=True),
    "haystack": Context(haystack, needs_model=True),
    "interleaved": Context(
        interleaved.interleaved, intro=_INTERLEAVED, parts=interleaved.interleaved_parts, sources=trajectories_identity
    ),
    "interleaved_plans": Context(plans.interleaved_plans, intro=_INTERLEAVED, parts=plans.plans_parts),
    "text_state": Context(
        text_state.text_state,
        intro="Answer the question given the description of the environment and the agent's state (the last image).",
        parts=text_state.state_parts,
        sources=trajectories_identity,
    ),
    "clip_retrieval": Context(retrieval.clip_retrieval, sources=retrieval.retriever_identity),
    "video": Context(
        video.video,
        intro="Answer the question given the video showing the agent's trajectory over time.",
        parts=video.video_parts,
        frames=video.video_frames,
        positions=video.video_positions,
        sources=video.video_identity,
    ),
    MEMORY: Context(memory.memory, parts=memory.recalled_parts, sources=memory.memory_sources),
}


def context_named(name: str) -> Context:
    """Return the context of a name.

    Raises:
        UsageError: there is none.
    """
    if name not in CONTEXTS:
        raise UsageError(f"unknown context {name!r}; a task's dataset_kwargs takes {', '.join(CONTEXTS)}")
    return CONTEXTS[name]
