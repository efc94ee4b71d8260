"""Training of the small model in two stages, from views and replayed sets to a loaded model."""

import math
import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
import torch
from torch import Tensor

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.household.sequence_text import MARKS
from infthor_eval.household.wording import noun
from infthor_eval.process_settings import tune_malloc
from infthor_eval.reasons import count_reasons
from infthor_eval.storage.digests import fingerprint
from infthor_eval.training.batches import collate
from infthor_eval.training.checkpoints import Checkpoints
from infthor_eval.training.encoding import Encoder, TrainingSequence
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from recipes.nano.action_sampler import ActionSampler
from recipes.nano.architecture import BLOCK, GRID, build_untrained, image_processor
from recipes.nano.reading.asking import Asker, ReadingSequence, question_intro
from recipes.nano.reading.branches import collate_branched
from recipes.nano.reading.episodes import read_episodes
from recipes.nano.reading.first_weights import set_first_weights
from recipes.nano.reading.frame_units import FrameUnits, label_units, read_frame_units
from recipes.nano.reading.network import ReadingNetwork
from recipes.nano.reading.question_sampler import QuestionSampler
from recipes.nano.reading.renaming import Vocabulary
from recipes.nano.seeing.muon import Muon
from recipes.nano.seeing.network import SeeingNetwork
from recipes.nano.seeing.units import Role, Units
from recipes.nano.seeing.view_dataset import ViewBatch, ViewDataset
from recipes.nano.seen_objects import SeenFrame, read_seen_frames
from recipes.nano.settings import NanoRecipe
from recipes.nano.spelling import spellings
from recipes.nano.steps import NanoProgress, Stage, adamw, run_stage

# What the first stage depends on: with other settings of the second one its tower is still good.
_SEEING = ("hidden", "layers", "seed", "threads", "vision", "weight_decay")
_MOST_COUNTED = 30  # numbers up to this are words
_BEFORE_PLACES = (" in the", " on the")
_WHITENED_FRAMES = 600
_SHIFT = 2.0  # logits by which units are raised when the tower is trained
_RAISED = 1.0  # logits by which those of what is shown are once more, when the decoder is
_SMOOTHING = 1e-3  # of the patches' mean variance, added to each; components of less are noise
_SCALE = 0.5  # standard deviation of the first layer's outputs
_BATCHES = 4  # that the sequences of a step are computed in
_Sequence = TypeVar("_Sequence", ReadingSequence, TrainingSequence)


@dataclass(frozen=True)
class TrainingData:
    """What the small model is trained on.

    Attributes:
        sets: folders of replayed sets, with trajectories and questions.
        views: files of labelled views.
    """

    sets: Sequence[Path]
    views: Sequence[Path]


def train_small_model(
    recipe: NanoRecipe,
    data: TrainingData,
    states: Path,
    on_step: Callable[[NanoProgress], None],
    print_note: Callable[[str], None] = lambda _: None,
) -> LoadedCheckpoint:
    """Train the small model, from the last state if there is one.

    A training that was stopped and continued gives the weights of one that was not.

    Args:
        recipe: recipe of the training.
        data: what it is trained on.
        states: folder of the states.
        on_step: called after every step.
        print_note: called with a line for each reason for which items were skipped, and before what
            takes minutes.

    Returns:
        The trained model with weights rounded to bfloat16.
    """
    tune_malloc()
    torch.set_num_threads(recipe.threads)
    torch.manual_seed(recipe.seed)
    training = _prepare(recipe, data)

    def run(stage: Stage, settings: dict[str, str]) -> None:
        run_stage(stage, Checkpoints(states / stage.name, training.about | settings), on_step)

    run(_seeing(training), _settings(recipe, _SEEING))
    run(_reading(training, print_note), _settings(recipe))
    raise_units(training.tower, training.views.units)
    # Halves the file; no answer of the bundled model depends on the rounding.
    training.loaded.model.to(torch.bfloat16)
    return training.loaded


@dataclass(frozen=True)
class _Training:
    """What both stages have in common.

    Attributes:
        recipe: recipe of the training.
        sets: folders of replayed sets.
        views: the views to learn seeing from.
        seen: the frames of the sets, and what they show.
        vocabulary: the types that questions and answers may name.
        loaded: the model.
        about: what states depend on beside the recipe.
    """

    recipe: NanoRecipe
    sets: Sequence[Path]
    views: ViewDataset
    seen: Sequence[SeenFrame]
    vocabulary: Vocabulary
    loaded: LoadedCheckpoint
    about: dict[str, str]

    @property
    def tower(self) -> Any:
        """The vision tower."""
        return self.loaded.model.model.visual


def _prepare(recipe: NanoRecipe, data: TrainingData) -> _Training:
    views = ViewDataset(data.views, BLOCK)
    units = views.units
    seen = read_seen_frames(data.sets)
    vocabulary = Vocabulary(
        (name for name, loose in zip(units.types, views.loose, strict=True) if loose),
        (name for name, fixed in zip(units.types, views.fixtures, strict=True) if fixed),
        units.types,
    )
    types = sorted({*units.types, *(one.type for _, objects in seen for one in objects)})
    tokens = single_tokens(data.sets, vocabulary, types)
    about = {
        "views": views.identity(),
        "frames": fingerprint({"frames": [frame.digest for frame, _ in seen]}),
    }
    loaded = build_untrained(recipe, corpus_texts(data.sets, types), tokens)
    return _Training(recipe, data.sets, views, seen, vocabulary, loaded, about)


def _seeing(training: _Training) -> Stage:
    """The tower learns to see; its first layer is set to the views' principal components."""
    recipe = training.recipe
    views = training.views
    vision = recipe.vision
    network = SeeingNetwork(training.tower, views, image_processor())
    rng = np.random.default_rng(recipe.seed)
    first = views.random_frames(min(_WHITENED_FRAMES, len(views)), rng)
    whiten_patches(network.tower, network.inputs(first), recipe.seed)
    matrices = [parameter for parameter in network.tower.blocks.parameters() if parameter.ndim == 2]
    chosen = {*map(id, matrices), *map(id, network.tower.merger.mlp[2].parameters())}
    others = [parameter for parameter in network.parameters() if id(parameter) not in chosen]
    optimizers = (
        Muon(matrices, lr=vision.matrix_lr, weight_decay=recipe.weight_decay),
        adamw([(others, vision.lr)], recipe.weight_decay),
    )

    def compute(number: int) -> Tensor:
        loss = network.loss(_draw(recipe, views, number))
        loss.backward()
        return loss.detach()

    return Stage("vision", vision.steps, network, optimizers, compute)


def _draw(recipe: NanoRecipe, views: ViewDataset, number: int) -> ViewBatch:
    """Return the pictures of a step: crops alone at first, then also frames."""
    vision = recipe.vision
    rng = np.random.default_rng([recipe.seed, number])
    is_crops = number < vision.crops * vision.steps or rng.random() < vision.mixed
    if is_crops:
        return views.crops(max(1, vision.patches_per_step // views.crop_patches), rng)
    return views.random_frames(max(1, vision.patches_per_step // views.frame_patches), rng)


def whiten_patches(tower: Any, pixels: Tensor, seed: int) -> None:
    """Set the patch embedding to filters whose outputs on the frames are about uncorrelated.

    The filters are the first principal components, scaled to equal variance and rotated at random.
    From random filters, which are noise, the tower needs four times as many frames to see as much
    (the trials are in the model card).

    Args:
        tower: a Qwen2.5-VL vision tower.
        pixels: patches of frames, (frames, patches, values).
        seed: seed of the rotation.
    """
    generator = torch.Generator().manual_seed(seed)
    patches = pixels.flatten(0, 1)
    variances, components = torch.linalg.eigh(patches.T @ patches / len(patches))
    kernel = tower.patch_embed.proj.weight  # (hidden, colours, time, height, width)
    width, colours, n_times, *side = kernel.shape
    n_kept = min(width, len(variances))
    scales = (variances[-n_kept:] + _SMOOTHING * variances.mean()).rsqrt()
    whitened = scales[:, None] * components[:, -n_kept:].T
    rotation = torch.empty(width, n_kept)
    torch.nn.init.orthogonal_(rotation, generator=generator)
    filters = (_SCALE * rotation @ whitened).reshape(width, colours, 1, *side)
    with torch.no_grad():
        # Both time steps are the same picture, and their sum counts.
        kernel.copy_(filters.expand(-1, -1, n_times, -1, -1) / n_times)


def lower_thresholds(tower: Any, units: Units) -> None:
    """Let units hand on what they are half sure of: a unit is on from above a half at first, and
    rare things seldom get there."""
    with torch.no_grad():
        tower.merger.mlp[0].bias[: len(units)] += _SHIFT


def raise_units(tower: Any, units: Units) -> None:
    """Let the decoder take more for shown than when it was trained.

    What is asked of twins is smaller than most of what it learned from.
    """
    n_types = len(units.types)
    shown = slice(Role.SHOWN * n_types, (Role.SHOWN + 1) * n_types)
    with torch.no_grad():
        tower.merger.mlp[0].bias[shown] += _RAISED


def _reading(training: _Training, print_note: Callable[[str], None]) -> Stage:
    recipe = training.recipe
    loaded = training.loaded
    seen = training.seen
    views = training.views
    units = views.units
    tower = training.tower
    lower_thresholds(tower, units)
    encoder = Encoder(loaded)
    episodes, skipped = read_episodes(training.sets)
    actions = ActionSampler(encoder, training.sets, recipe.acting, recipe.words)
    for _, reason, n in count_reasons(("", one.reason) for one in (*skipped, *actions.skipped)):
        print_note(f"{n} skipped: {reason}")
    frames = [frame for frame, _ in seen]
    asker = Asker(encoder, frames[0])
    questions = QuestionSampler(asker, episodes, seen, training.vocabulary, units, recipe.reading)
    set_first_weights(
        loaded, units, views.loose.tolist(), views.fixtures.tolist(), GRID, recipe.seed
    )
    print_note(f"{len(frames):,} frames: computing what the tower tells of them")
    told = read_frame_units(frames, image_processor(), tower, units)
    labelled = label_units(seen, units, views.loose, GRID, recipe.seed)
    network = ReadingNetwork(loaded, told, units)
    return _reading_stage(recipe, network, labelled, questions, actions)


def _reading_stage(
    recipe: NanoRecipe,
    network: ReadingNetwork,
    labelled: FrameUnits,
    questions: QuestionSampler,
    actions: ActionSampler,
) -> Stage:
    """Return the stage, in which the tower is frozen but for the merger's last layer.

    Args:
        recipe: recipe of the training.
        network: the decoder with what the tower tells of all frames.
        labelled: what the frames show, which comes first.
        questions: draws questions.
        actions: draws histories and plans.
    """
    layers = [*network.decoder.layers.parameters()]
    in_layers = {*map(id, layers)}
    others = [one for one in network.trained_parameters() if id(one) not in in_layers]
    optimizer = adamw([(layers, recipe.layer_lr), (others, recipe.lr)], recipe.weight_decay)
    told = network.frames

    def compute(number: int) -> Tensor:
        rng = random.Random(f"{recipe.seed}/{number}")
        network.frames = labelled if number < recipe.reading.labelled * recipe.steps else told
        drawn = questions.draw(rng, number / recipe.steps)
        loss = _learn_to_read(network, drawn, recipe.event_weight)
        loss += _learn_to_act(network, actions.histories(rng), 1.0)
        return loss + _learn_to_act(
            network, actions.synthetic_plans(rng), recipe.acting.text_plans_weight
        )

    return Stage("reading", recipe.steps, network, (optimizer,), compute)


def _learn_to_read(
    network: ReadingNetwork, sequences: Sequence[ReadingSequence], event_weight: float
) -> Tensor:
    """Add the gradients of questions, and return their loss per token of answers."""
    n_tokens = sum(one.tokens.n_loss_tokens for one in sequences)
    n_frames = sum(of_frame is not None for one in sequences for of_frame in one.events)
    whole = torch.zeros(())
    for part in _parts(sequences, [one.tokens.n_tokens for one in sequences]):
        batch = collate_branched([one.tokens for one in part], network.family, pad_id=0)
        answers, events = network.losses(batch, [one.events for one in part])
        loss = answers / n_tokens
        (loss + event_weight * events / max(1, n_frames)).backward()
        whole += loss.detach()
    return whole


def _learn_to_act(
    network: ReadingNetwork, sequences: Sequence[TrainingSequence], weight: float
) -> Tensor:
    """Add the weighted gradients of actions, and return their weighted loss per token."""
    n_tokens = sum(one.n_loss_tokens for one in sequences)
    whole = torch.zeros(())
    for part in _parts(sequences, [one.n_tokens for one in sequences]):
        batch = collate(part, network.family, pad_id=0)
        loss = weight * network(**batch, num_items_in_batch=n_tokens)["loss"]
        loss.backward()
        whole += loss.detach()
    return whole


def _parts(sequences: Sequence[_Sequence], lengths: Sequence[int]) -> Iterator[list[_Sequence]]:
    """Yield sequences in batches of about one length.

    A question on one frame has 30 tokens, one behind a memory 300: most of a single batch would be
    padding.
    """
    order = sorted(range(len(sequences)), key=lengths.__getitem__)
    size = math.ceil(len(order) / _BATCHES)
    for first in range(0, len(order), size):
        yield [sequences[at] for at in order[first : first + size]]


def _settings(recipe: NanoRecipe, names: Sequence[str] | None = None) -> dict[str, str]:
    """Return a hash of a recipe's settings, or of some of them."""
    settings = msgspec.to_builtins(recipe)
    chosen = {name: settings[name] for name in names or settings}
    return {"recipe": fingerprint(chosen)}


def corpus_texts(folders: Sequence[Path], types: Iterable[str]) -> Iterator[str]:
    """Yield all texts of the sets, for training a tokenizer that has their words."""
    for object_type in types:
        yield from spellings(object_type)
        yield object_type
    for folder in folders:
        for path in sorted((folder / "metadata").glob("*/traj.txt")):
            text = path.read_text(encoding="utf-8").replace("<image>", " ")
            for mark in MARKS:
                text = text.replace(mark, "\n")
            yield from text.splitlines()
        for question in NiehSet(folder).questions:
            yield f" {question.text}"
            yield from (f"{space}{answer}" for answer in question.answers for space in ("", " "))
    yield from map(str, range(_MOST_COUNTED))
    yield question_intro()


def single_tokens(
    folders: Sequence[Path], vocabulary: Vocabulary, types: Iterable[str]
) -> list[str]:
    """Return the texts of several words that become one token.

    They are the introduction of every question of the published evaluation, which would otherwise
    be three quarters of a question's tokens; what questions say around the things that they name;
    and the names of these.
    """
    names = [f" {noun(name)}" for name in types]
    phrases = {
        phrase
        for folder in folders
        for question in NiehSet(folder).questions
        for phrase in vocabulary.phrases(question.text)
    }
    texts = [*_BEFORE_PLACES, *sorted(phrases), *names]
    return [question_intro(), *dict.fromkeys(text for text in texts if " " in text.strip())]
