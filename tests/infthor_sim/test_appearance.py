"""Randomized materials, colours and light."""

import numpy as np
import pytest

from infthor_sim.player.fifo import FieldType

from .conftest import need_data
from .harness import Bench


def frame(bench: Bench) -> np.ndarray:
    return bench.picture(FieldType.RGB).astype(float)


@pytest.mark.parametrize("action", ["RandomizeMaterials", "RandomizeColors"])
def test_looks_change_and_are_reset(bench, action):
    usual = frame(bench)
    objects = bench.metadata["objects"]
    assert bench.ok(action)["objects"] == objects
    assert np.abs(frame(bench) - usual).mean() > 10
    bench.ok("ResetMaterials")
    assert np.array_equal(frame(bench), usual)
    bench.ok(action)
    bench.reset("kitchen-1")
    assert np.array_equal(frame(bench), usual)


def test_the_same_seed_the_same_looks(bench):
    drawn = []
    for seed in (41, 42, 42):
        bench.reset("kitchen-1")
        bench.ok("SetRandomSeed", seed=seed)
        bench.ok("RandomizeMaterials")
        drawn.append(frame(bench))
    assert np.array_equal(drawn[1], drawn[2])
    assert np.abs(drawn[0] - drawn[1]).mean() > 10


def test_light(bench):
    usual = frame(bench)
    bench.ok("RandomizeLighting", brightness=[0.5, 0.5], randomizeColor=False)
    assert frame(bench).mean() == pytest.approx(usual.mean() * 0.5, rel=0.1)
    bench.ok("RandomizeLighting", brightness=[1, 1], hue=[0, 0], saturation=[1, 1])
    red, green, blue = frame(bench).mean(axis=(0, 1))
    assert red > 20 * max(green, blue)
    bench.ok("ResetLighting")
    assert np.array_equal(frame(bench), usual)
    bench.refused("RandomizeLighting", randomizeColor=False, hue=[0, 1])
    bench.refused("RandomizeLighting", brightness=[-1, 1])
    bench.refused("RandomizeLighting", saturation=[0, 2])


def test_sets_of_materials(bench):
    reported = bench.ok("RandomizeMaterials")["actionReturn"]
    assert reported["useTrainMaterials"]
    assert not reported["useValMaterials"]
    assert reported["totalMaterialsConsidered"] > 0
    bench.refused("RandomizeMaterials", useTrainMaterials=False)
    bench.ok("RandomizeMaterials", inRoomTypes=["Kitchen", "LivingRoom"])
    bench.refused("RandomizeMaterials", inRoomTypes=["LivingRoom"])


@pytest.mark.parametrize(
    ("scene", "split"),
    [("FloorPlan20", "Train"), ("FloorPlan221", "Val"), ("FloorPlan326", "Test")],
)
def test_the_scene_decides_on_the_sets(scene, split):
    from infthor_sim.scenes.catalogue import Catalogue

    bench = Bench.at(scene, catalogue=Catalogue(need_data()), size=20)
    reported = bench.ok("RandomizeMaterials")["actionReturn"]
    assert [name for name in ("Train", "Val", "Test") if reported[f"use{name}Materials"]] == [split]


def test_a_restored_state_looks_as_it_did(bench):
    bench.ok("RandomizeColors")
    changed = frame(bench)
    bench.ok("SaveState")
    bench.ok("ResetMaterials")
    bench.ok("RestoreState")
    assert np.array_equal(frame(bench), changed)
