"""Recipes: what a model is trained on and how, as YAML files. `infthor_eval/training/recipes/` has the paper's."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import msgspec

from infthor_eval.errors import UsageError, unknown_name, wrap_errors
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.training.nano.settings import NanoRecipe

__all__ = ["ActionData", "Lora", "Optimizer", "Parallel", "QuestionData", "Recipe", "read_recipe", "recipe_names"]

_FOLDER = "training/recipes"


class ActionData(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Sequences of trajectories, which agents learn from.

    Attributes:
        share: of the sequences that are gone through in an epoch; 1 takes each once.
    """

    share: float = 1.0


class QuestionData(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Sequences of questions.

    Attributes:
        contexts: in which each question is asked.
        settings: of the contexts, as `dataset_kwargs` of task files have them.
        share: of the sequences that are gone through in an epoch; 1 takes each once.
    """

    contexts: tuple[str, ...] = ("clues",)
    settings: dict[str, Any] = {}
    share: float = 1.0


class Optimizer(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """AdamW with a linear schedule; defaults are those of the published trainer.

    Attributes:
        lr: the highest learning rate.
        betas: of AdamW.
        weight_decay: of AdamW.
        clip: the largest norm of all gradients together.
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
        rank: of the adapters.
        alpha: their scale.
        dropout: in them.
        targets: names of the linear layers that get one; of the decoder alone.
    """

    rank: int = 16
    alpha: int = 32
    dropout: float = 0.0
    targets: tuple[str, ...] = ("q_proj", "k_proj", "v_proj", "o_proj", "gate_proj", "up_proj", "down_proj")


class Parallel(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How processes share the work; those that are left go through different sequences.

    Attributes:
        context: processes that share one sequence.
        shard: whether weights, gradients and optimizer are sharded too (FSDP2), where no sequence is shared.
    """

    context: int = 1
    shard: bool = False


class Recipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One way to train a model.

    Attributes:
        title: what it is, in one line.
        source: where its settings come from; empty where they are ours.
        model: name of the adapter.
        model_args: its options (`pretrained`, `dtype`, ...).
        prompt: "plain" for bare sequences of texts and frames, "chat" for the checkpoint's own template; sequences of
            actions are always plain.
        max_tokens: of one sequence.
        actions: sequences of trajectories; none where None.
        questions: sequences of questions; none where None.
        freeze: parts that are not trained: vision, embeddings, decoder, head.
        optimizer: its settings.
        lora: adapters instead of the weights; None trains the weights.
        epochs: how often all sequences are gone through.
        max_steps: steps at most; None for no limit.
        sequences_per_step: of all processes together.
        gradient_checkpointing: computes activations again instead of keeping them.
        parallel: how processes share the work.
        save_every: steps between checkpoints to resume from.
        seed: of everything that is random.
    """

    title: str
    source: str = ""
    model: str
    model_args: dict[str, str] = {}
    prompt: Literal["plain", "chat"] = "plain"
    max_tokens: int
    actions: ActionData | None = None
    questions: QuestionData | None = None
    freeze: tuple[Literal["vision", "embeddings", "decoder", "head"], ...] = ("vision", "embeddings")
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
        """Refuse what cannot be.

        Raises:
            ValueError: names the setting.
        """
        if self.actions is None and self.questions is None:
            raise ValueError("neither actions nor questions: there is nothing to train on")
        if self.actions is not None and self.prompt != "plain":
            raise ValueError("sequences of actions have no turns; set prompt to plain")
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
            raise ValueError(f"{wrong} is {positive[wrong]}; it is above 0")
        if self.parallel.context > 1 and self.parallel.shard:
            raise ValueError("parallel.shard is for sequences that are not shared; leave one of the two out")


def recipe_names() -> tuple[str, ...]:
    """Names of the recipes that come with the package, sorted."""
    return tuple(sorted(path.stem for path in packaged_folder(_FOLDER).glob("*.yaml")))


def read_recipe(name: str, changes: Mapping[str, Any] | None = None) -> Recipe | NanoRecipe:
    """A recipe by its name, or from a file.

    Args:
        name: one of `recipe_names()`, or a path that ends with .yaml.
        changes: settings that take the place of the file's, dotted (`optimizer.lr`) where they lie within another.

    Raises:
        UsageError: there is no such recipe, or a setting is unknown or cannot be.
        DataError: the file is no YAML.
    """
    path = Path(name) if name.endswith(".yaml") else packaged_folder(_FOLDER) / f"{name}.yaml"
    if not path.is_file() and not name.endswith(".yaml"):
        raise unknown_name("recipe", name, recipe_names())
    document = read_yaml(path, "give a recipe as those in infthor_eval/training/recipes")
    with wrap_errors(
        f"{path}: not a recipe", "mend the setting", catch=(msgspec.ValidationError, TypeError), raise_as=UsageError
    ):
        for key, value in (changes or {}).items():
            _put(document, key.split("."), value)
        if "architecture" in document:
            return msgspec.convert(document, NanoRecipe, strict=False)
        return msgspec.convert(document, Recipe, strict=False)


def _put(document: Any, keys: list[str], value: Any) -> None:
    *outer, last = keys
    for key in outer:
        document = document.setdefault(key, {})
    document[last] = value
