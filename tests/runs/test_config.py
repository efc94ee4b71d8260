"""The config of a run: written, read back, hashed."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import DataError
from infthor_eval.nieh.config import MetricsConfig, NiehConfig, NiehTaskConfig
from infthor_eval.plans.config import PlansConfig, PlansTaskConfig
from infthor_eval.runs import RunConfig, TaskConfig

TASK = {
    "config": {"task": "nieh_gt", "dataset_kwargs": {"context": "clues"}},
    "decoding": {"max_new_tokens": 50},
    "metrics": {"names": ["strict"]},
    "data": "d",
    "simulator": None,
    "n_samples": 1,
    "skipped": [],
}
JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)


def nieh_task(**fields):
    return NiehTaskConfig(
        settings={"dataset_kwargs": {"context": "clues"}},
        decoding={"max_new_tokens": 50},
        metrics=MetricsConfig(names=("strict",)),
        data="d",
        simulator=None,
        n_samples=1,
        skipped=(),
        **fields,
    )


@given(
    st.dictionaries(st.text(min_size=1, max_size=5), JSON),
    st.none() | st.integers(1, 9),
    st.none() | st.sampled_from(("1k", "500")),
)
def test_what_is_written_is_read_back(identity, limit, budget):
    config = NiehConfig(tasks={"nieh_gt": nieh_task()}, frames="shown", budget=budget)
    config = config.complete("nieh", {"name": "m", **identity}, limit=limit, seed=3)
    written = msgspec.json.encode(config)
    assert msgspec.json.decode(written, type=NiehConfig) == config
    assert msgspec.json.decode(written, type=NiehConfig).hash == config.hash
    assert (config.suite, config.seed, config.limit) == ("nieh", 3, limit)


def test_tuples_and_texts_of_other_types_are_written_plainly():
    class Version(str):
        __slots__ = ()

    config = RunConfig().complete("toy", {"name": "m", "sizes": (1, 2), "torch": Version("2.1")})
    assert config.model == {"name": "m", "sizes": [1, 2], "torch": "2.1"}
    assert type(config.model["torch"]) is str
    with pytest.raises(DataError, match="cannot be written into a run's config"):
        RunConfig().complete("toy", {"name": object()})


def test_a_field_with_its_default_leaves_the_hash_as_it_is():
    class Grown(NiehConfig, frozen=True, kw_only=True, omit_defaults=True):
        later: str | None = None

    config = NiehConfig(tasks={"nieh_gt": nieh_task()}, frames="shown")
    assert Grown(tasks={"nieh_gt": nieh_task()}, frames="shown").hash == config.hash
    changed = Grown(tasks={"nieh_gt": nieh_task()}, frames="shown", later="x")
    assert changed.hash != config.hash
    assert changed.differing(config) == ["later"]


def test_a_config_of_an_older_version_is_read():
    # As the version before wrote it: what was not set, too.
    old = {
        "infthor_eval": "0.1.0", "suite": "nieh", "model": {"name": "m"}, "adapter": {},
        "limit": None, "seed": 0, "k_tokens": None, "tokens_per_frame": None, "frames": "shown",
        "tasks": {"nieh_gt": TASK},
    }  # fmt: skip
    config = msgspec.convert(old, NiehConfig)
    assert config.tasks["nieh_gt"].context == "clues"
    assert config.model == {"name": "m"}
    plans = {"config": {}, "trajectories": {}, "broken": [["t", "bad"]], "rewards": None}
    old = {"tasks": {"p": plans}, "simulator": "unity", "frames": "shown", "ai2thor": "5.0.0"}
    config = msgspec.convert(old, PlansConfig)
    assert config.tasks["p"] == PlansTaskConfig(broken=(("t", "bad"),), rewards=None)
    assert config.tasks["p"].skip_reasons == ["bad"]


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("tasks",), []),
        (("frames",), 1),
        (("tasks", "nieh_gt"), {}),
        (("tasks", "nieh_gt", "config", "dataset_kwargs", "context"), None),
        (("tasks", "nieh_gt", "config", "dataset_kwargs", "budget"), "much"),
        (("tasks", "nieh_gt", "metrics", "names"), []),
        (("tasks", "nieh_gt", "decoding"), {}),
        (("tasks", "nieh_gt", "sources"), {"memory": {"name": "last"}}),
    ],
)
def test_a_config_that_tables_could_not_read_is_refused(place, value):
    document = msgspec.json.decode(
        msgspec.json.encode({"tasks": {"nieh_gt": TASK}, "frames": "shown"})
    )
    parent = document
    for key in place[:-1]:
        parent = parent[key]
    parent[place[-1]] = value
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(document, NiehConfig)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"dataset_kwargs": {"ctx_size": float("nan")}}, "['ctx_size'] is nan, which JSON cannot"),
        ({"doc_to_text": "a\ud800"}, "['doc_to_text'] is 'a\\ud800', which is no valid Unicode"),
        ({"f": len}, "cannot be written into a run's config"),
    ],
)
def test_a_config_that_json_cannot_hold_is_refused_with_the_fields_name(settings, words):
    config = RunConfig(tasks={"t": TaskConfig(settings=settings)})
    with pytest.raises(DataError) as error:
        config.complete("toy", {"name": "m"})
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "changes",
    [
        {"n_samples": 10**400},
        {"n_samples": -1},
        {"decoding": {"max_new_tokens": 10**400}},
        {"config": {"dataset_kwargs": {"context": "memory", "budget": 10**400}}},
        {"config": {"dataset_kwargs": {"context": "memory", "budget": -1}}},
    ],
)
def test_counts_that_no_mean_can_be_over_are_refused(changes):
    msgspec.convert(TASK, NiehTaskConfig)
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(TASK | changes, NiehTaskConfig)
