"""Recipes: data and settings of training, in YAML; the paper's are in `recipes/` beside this."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from infthor_eval.errors import DataError, UsageError, unknown_name, wrap_errors
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.storage.folders import packaged_folder

_FOLDER = "training/recipes"
_EXAMPLES = "see infthor_eval/training/recipes for examples"
_Form = TypeVar("_Form", bound=msgspec.Struct)


class ActionData(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Sequences of trajectories.

    Attributes:
        form: "plans" for histories of whole plans (appendix B); of the published models for final
            tasks, "goals" for histories without the text of a plan, "text" and "frames" for single
            actions behind a memory.
        share: share of the sequences that is used.
    """

    form: Literal["plans", "goals", "text", "frames"] = "plans"
    share: float = 1.0


class QuestionData(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Sequences of questions.

    Attributes:
        contexts: contexts in which each question is asked.
        settings: settings of the contexts, as in `dataset_kwargs` of task files.
        share: share of the sequences that is used.
    """

    contexts: tuple[str, ...] = ("clues",)
    settings: dict[str, Any] = {}
    share: float = 1.0


class Optimizer(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """AdamW with a linear schedule; defaults are those of the published trainer.

    Attributes:
        lr: highest learning rate.
        betas: betas of AdamW.
        weight_decay: weight decay of AdamW, for all trained weights.
        clip: largest norm of the gradient.
        warmup_ratio: share of the steps in which the learning rate rises.
    """

    lr: float = 1e-5
    betas: tuple[float, float] = (0.9, 0.95)
    weight_decay: float = 0.1
    clip: float = 1.0
    warmup_ratio: float = 0.03


class Lora(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Low-rank adapters (peft) instead of the weights themselves.

    Attributes:
        rank: rank of the adapters.
        alpha: scale of the adapters.
        dropout: dropout probability in the adapters.
        targets: names of the decoder's linear layers that get an adapter.
    """

    rank: int = 16
    alpha: int = 32
    dropout: float = 0.0
    targets: tuple[str, ...] = (
        "q_proj",
        "k_proj",
        "v_proj",
        "o_proj",
        "gate_proj",
        "up_proj",
        "down_proj",
    )


class Parallel(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Parallelism; processes that do not share a sequence process different sequences.

    Attributes:
        context: processes that share one sequence (context parallelism).
        shard: shard weights, gradients and optimizer (FSDP2); not with context parallelism.
    """

    context: int = 1
    shard: bool = False


class Recipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One way to train a model.

    Attributes:
        title: description in one line.
        source: source of the settings; empty for our own.
        model: name of the model's adapter.
        model_args: options of the adapter (`pretrained`, `dtype`, ...).
        prompt: "plain" for bare sequences of texts and frames, "chat" for the checkpoint's
            template; sequences of plans are plain, other forms of actions are chats.
        max_tokens: most tokens of a sequence.
        actions: sequences of trajectories, or None.
        words: words of their plans and actions.
        questions: sequences of questions, or None.
        freeze: parts that are not trained: vision, embeddings, decoder, head.
        optimizer: settings of the optimizer.
        lora: settings of low-rank adapters, or None to train the weights.
        epochs: number of epochs.
        max_steps: most steps, or None for no limit.
        sequences_per_step: sequences of a step, of all processes together.
        gradient_checkpointing: recompute activations instead of keeping them.
        parallel: division of the work among processes.
        save_every: steps between states to resume from.
        seed: seed of everything that is random.
    """

    title: str
    source: str = ""
    model: str
    model_args: dict[str, str] = {}
    prompt: Literal["plain", "chat"] = "plain"
    max_tokens: int
    actions: ActionData | None = None
    words: Words = Words.PUBLISHED
    questions: QuestionData | None = None
    freeze: tuple[Literal["vision", "embeddings", "decoder", "head"], ...] = (
        "vision",
        "embeddings",
    )
    optimizer: Optimizer = Optimizer()
    lora: Lora | None = None
    epochs: int = 3
    max_steps: int | None = None
    sequences_per_step: int = 8
    gradient_checkpointing: bool = True
    parallel: Parallel = Parallel()
    save_every: int = 100
    seed: int = 0

    def __post_init__(self) -> None:
        """Check that the settings are valid and fit together.

        Raises:
            ValueError: a setting is not valid; the message names it.
        """
        if self.actions is None and self.questions is None:
            raise ValueError("neither actions nor questions: there is nothing to train on")
        if self.actions is not None:
            self._check_actions(self.actions)
        positive = {
            "max_tokens": self.max_tokens,
            "epochs": self.epochs,
            "sequences_per_step": self.sequences_per_step,
            "save_every": self.save_every,
            "parallel.context": self.parallel.context,
            "optimizer.lr": self.optimizer.lr,
            "optimizer.clip": self.optimizer.clip,
            "max_steps": 1 if self.max_steps is None else self.max_steps,
        }
        wrong = next((name for name, value in positive.items() if not value > 0), None)
        if wrong is not None:
            raise ValueError(f"{wrong} is {positive[wrong]}; use a number above 0")
        if self.parallel.context > 1 and self.parallel.shard:
            raise ValueError(
                "parallel.shard and parallel.context cannot be combined; leave one of them out"
            )

    def _check_actions(self, actions: ActionData) -> None:
        if actions.form == "plans" and self.prompt != "plain":
            raise ValueError("sequences of plans have no turns; set prompt to plain")
        if actions.form != "plans" and self.prompt != "chat":
            raise ValueError(
                f"actions of the form {actions.form} follow a system prompt; set prompt to chat"
            )
        if actions.form != "plans" and self.words is not Words.PUBLISHED:
            raise ValueError(
                f"actions of the form {actions.form} are in the published words; leave words out"
            )


def recipe_names() -> tuple[str, ...]:
    """Return the names of the packaged recipes, sorted."""
    return tuple(sorted(path.stem for path in packaged_folder(_FOLDER).glob("*.yaml")))


def read_recipe(name: str, changes: Mapping[str, Any] | None = None) -> Recipe:
    """Read a recipe by its name, or from a file.

    Args:
        name: one of `recipe_names()`, or a path that ends in .yaml.
        changes: settings that replace those of the file, as for `read_recipe_file`. Another model
            does not get the `model_args` of the file, which are options of the file's model.
    """
    path = Path(name) if name.endswith(".yaml") else packaged_folder(_FOLDER) / f"{name}.yaml"
    if not path.is_file() and not name.endswith(".yaml"):
        raise unknown_name("recipe", name, recipe_names())
    return read_recipe_file(path, changes or {}, Recipe)


def read_recipe_file(path: Path, changes: Mapping[str, Any], form: type[_Form]) -> _Form:
    """Read a recipe of some form, with changed settings: dots for nested ones (`optimizer.lr`)."""
    document = read_yaml(path, _EXAMPLES)
    if not isinstance(document, dict):
        raise DataError(f"{path}: not a recipe (no mapping of settings); {_EXAMPLES}")
    wrong = (msgspec.ValidationError, TypeError)
    with wrap_errors(f"{path}: not a recipe", "fix the setting", catch=wrong, raise_as=UsageError):
        if changes.get("model", document.get("model")) != document.get("model"):
            document.pop("model_args", None)
        for key, value in changes.items():
            _set_nested(document, key.split("."), value)
        return msgspec.convert(document, form, strict=False)


def _set_nested(document: Any, keys: list[str], value: Any) -> None:
    *outer, last = keys
    for key in outer:
        document = document.setdefault(key, {})
    document[last] = value
