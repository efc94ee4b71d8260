"""Training of the small model in two stages, from views and replayed sets to a loaded model."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import torch

from infthor_eval.process_settings import tune_malloc
from infthor_eval.reasons import count_reasons
from infthor_eval.storage.digests import fingerprint
from infthor_eval.training.checkpoints import Checkpoints
from infthor_eval.training.encoding import Encoder
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from recipes.nano.action_sampler import ActionSampler
from recipes.nano.architecture import BLOCK, GRID, build_untrained, image_processor
from recipes.nano.corpus import corpus_texts, single_tokens
from recipes.nano.reading.asking import Asker
from recipes.nano.reading.episodes import read_episodes
from recipes.nano.reading.first_weights import set_first_weights
from recipes.nano.reading.frame_units import read_frame_units
from recipes.nano.reading.label_units import label_units
from recipes.nano.reading.network import ReadingNetwork
from recipes.nano.reading.question_sampler import QuestionSampler
from recipes.nano.reading.renaming import Vocabulary
from recipes.nano.reading.stage import reading_stage
from recipes.nano.seeing.network import SeeingNetwork
from recipes.nano.seeing.stage import lower_thresholds, raise_units, seeing_stage
from recipes.nano.seeing.view_dataset import ViewDataset
from recipes.nano.seen_objects import SeenFrame, read_seen_frames
from recipes.nano.settings import NanoRecipe
from recipes.nano.steps import NanoProgress, Stage, run_stage

# What the first stage depends on: with other settings of the second one its tower is still good.
_SEEING = ("hidden", "layers", "seed", "threads", "vision", "weight_decay")


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

    Raises:
        DataError: data cannot be read, or have nothing for one of the stages; or a state is damaged
            or cannot be written.
        UsageError: the states are of another recipe or other data.
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
    network = SeeingNetwork(training.tower, training.views, image_processor())
    return seeing_stage(training.recipe, network, training.views)


def _reading(training: _Training, print_note: Callable[[str], None]) -> Stage:
    recipe, loaded, seen = training.recipe, training.loaded, training.seen
    views, units, tower = training.views, training.views.units, training.tower
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
    return reading_stage(recipe, network, labelled, questions, actions)


def _settings(recipe: NanoRecipe, names: Sequence[str] | None = None) -> dict[str, str]:
    """Return a hash of a recipe's settings, or of some of them."""
    settings = msgspec.to_builtins(recipe)
    chosen = {name: settings[name] for name in names or settings}
    return {"recipe": fingerprint(chosen)}
