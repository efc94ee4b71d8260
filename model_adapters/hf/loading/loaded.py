"""A checkpoint in memory."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from model_adapters.hf.cached.decoding import Generation
from model_adapters.hf.family import Family
from model_adapters.hf.prompting.rendering import prompt_end
from model_adapters.thinking import MARKERS, opening_marker


@dataclass(frozen=True)
class LoadedCheckpoint:
    """A model with everything that is needed to run it.

    Attributes:
        model: the transformers model, in evaluation mode.
        tokenizer: tokenizer of the model.
        image_processor: image processor of the model; None for one that reads text alone.
        template: template of conversations (Jinja): the checkpoint's chat template, or a plain one.
        family: family of the model.
        generation: end tokens and penalties.
        max_tokens: context limit, or None if the config has none.
        identity: what distinguishes this checkpoint from others, as JSON values.
    """

    model: Any
    tokenizer: Any
    image_processor: Any
    template: str
    family: Family
    generation: Generation
    max_tokens: int | None
    identity: dict[str, Any]

    @cached_property
    def opening(self) -> str:
        """Marker that the template writes before every reply, so that the model begins in thought;
        mostly empty."""
        if not any(before in self.template for before, _ in MARKERS.values()):
            return ""
        return opening_marker(prompt_end(self.tokenizer, self.template))

    @cached_property
    def marker_ids(self) -> dict[int, str]:
        """Special tokens that are markers of thoughts, by id: decoding would leave them out."""
        markers = {text for pair in MARKERS.values() for text in pair}
        added = self.tokenizer.added_tokens_decoder.items()
        return {
            token: str(special_token.content)
            for token, special_token in added
            if special_token.special and special_token.content in markers
        }
