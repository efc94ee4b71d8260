"""Memories that recall the frames nearest by CLIP.

The retriever is imported where it is needed: that takes seconds, which other memories need not
wait.
"""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from infthor_eval.errors import DataError
from infthor_eval.memory.frames import PUBLISHED_K, FrameMemory
from infthor_eval.memory.protocol import Query

if TYPE_CHECKING:
    from model_adapters.hf.retrieval import Retriever

PUBLISHED_RETRIEVER = "openai/clip-vit-large-patch14"


class _Nearest(FrameMemory):
    """Base: frames by their similarity to something."""

    def __init__(
        self,
        k: int = PUBLISHED_K,
        retriever: str = PUBLISHED_RETRIEVER,
        retriever_revision: str | None = None,
    ) -> None:
        """Set the number of frames without a budget, and the CLIP model: hub id or folder."""
        super().__init__(k)
        self._source = retriever, retriever_revision

    def identity(self) -> Mapping[str, Any]:
        """See `Memory`; another retriever finds other frames."""
        return {"retriever": self.retriever.identity()}

    @cached_property
    def retriever(self) -> "Retriever":
        """The CLIP model, loaded when it is first needed.

        Raises:
            UsageError: there is no such model.
        """
        from model_adapters.hf.retrieval import open_retriever

        return open_retriever(*self._source)

    def choose(self, query: Query, n_frames: int) -> Sequence[int]:
        """See `FrameMemory`; of equally similar frames the earlier ones."""
        from model_adapters.hf.vectors import nearest

        if not n_frames:
            return ()
        frames = self.retriever.frames([observation.frame for observation in self.past])
        return nearest(frames, self.vector(query), n_frames)

    @abstractmethod
    def vector(self, query: Query) -> Any:
        """Return the vector that frames are compared with, (dimensions,)."""


class Clip(_Nearest):
    """The frames nearest to a text: NIEH's question (published retrieval, k = 10), or the goal.

    `query=goal` with k = 20 and `openai/clip-vit-base-patch32` is the one retrieval for agents in
    the published code (`run_interactive_eval_clip.py`).
    """

    def __init__(
        self,
        k: int = PUBLISHED_K,
        retriever: str = PUBLISHED_RETRIEVER,
        retriever_revision: str | None = None,
        query: Literal["question", "goal"] = "question",
    ) -> None:
        """See `_Nearest`; frames are compared with `query`: an agent's is goal and plan."""
        super().__init__(k, retriever, retriever_revision)
        self._query = query

    def vector(self, query: Query) -> Any:
        """See `_Nearest`."""
        if self._query == "question":
            return self.retriever.text(query.text)
        if not query.present.goal:
            raise DataError(
                "the goal at this step is not known; take query=question (--memory-args)"
            )
        return self.retriever.text(query.present.goal)


class ClipView(_Nearest):
    """The frames nearest to the current view: ours, for trajectories without an image memory.

    The paper's image memory (k = 20) came from `retrieved_image` of the trajectories' files; what
    chose it is not in the published code.
    """

    def vector(self, query: Query) -> Any:
        """See `_Nearest`."""
        return self.retriever.frames([query.present.frame])[0]
