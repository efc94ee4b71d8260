"""What a run is said to take, against what is counted while it is done."""

import pytest
from torch.utils.flop_counter import FlopCounterMode

from infthor_eval.training.batches import collate
from infthor_eval.training.cost import estimate_cost
from infthor_eval.training.data import TrainingData, read_training_data
from infthor_eval.training.encoding import Encoder
from infthor_eval.training.network import SequenceModel, freeze
from infthor_eval.training.recipe import read_recipe
from infthor_eval.training.starting_model import load_starting_model


@pytest.fixture
def prepared(bundled_set):
    loaded = load_starting_model(
        "qwen2.5-vl-tiny", {"attn_implementation": "eager"}, "plain", seed=0
    )
    recipe = read_recipe("infthor_32k", {"max_tokens": 5000, "epochs": 1, "parallel.shard": False})
    data = read_training_data(recipe, Encoder(loaded), [bundled_set])
    network = SequenceModel(loaded)
    freeze(network, ["vision"])
    return loaded, recipe, TrainingData(data.sequences[:1], ()), network


def test_work_is_what_is_counted(prepared):
    loaded, recipe, data, network = prepared
    batch = collate(data.sequences, loaded.family, 0)
    counter = FlopCounterMode(display=False)
    with counter:
        network(**batch)["loss"].backward()
    kept = read_recipe("infthor_32k", {"epochs": 1, "gradient_checkpointing": False})
    estimated = estimate_cost(kept, network, data, 1).flop
    # This attention computes all pairs, and a causal one half of them; they are most of it here.
    assert 0.5 < estimated / counter.get_total_flops() < 0.7
    assert estimate_cost(recipe, network, data, 1).flop > estimated


def test_memory_falls_with_those_who_share_it(prepared):
    _, recipe, data, network = prepared
    alone = estimate_cost(recipe, network, data, 1)
    assert alone.weights == sum(parameter.nbytes for parameter in network.parameters())
    assert alone.optimizer == 2 * alone.gradients
    shared = estimate_cost(read_recipe("infthor_32k", {"parallel.shard": True}), network, data, 4)
    assert (shared.weights, shared.optimizer) == (alone.weights / 4, alone.optimizer / 4)
    cut = estimate_cost(read_recipe("infthor_64k"), network, data, 8)
    assert cut.activations == pytest.approx(alone.activations / 8)
    assert cut.weights == alone.weights
