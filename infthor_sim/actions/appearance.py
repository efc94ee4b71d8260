# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Randomizing materials, colours and light."""

import colorsys
import re
from typing import Any

import numpy as np

from infthor_sim.actions.registry import action
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array
from infthor_sim.pictures.appearance import RANDOM_PATTERNS, Finish
from infthor_sim.render.shell import SHELL_NAMES
from infthor_sim.simulation import Simulation

# factors of a surface's colour
_DARKEST = 0.45
_BRIGHTEST = 1.55
_ITHOR = re.compile(r"FloorPlan\d*(\d\d)|FloorPlan(\d)")
# by the hundreds of the floor plan
_ROOMS = {"0": "Kitchen", "2": "LivingRoom", "3": "Bedroom", "4": "Bathroom"}
_PROCEDURAL = {
    "kitchen": "Kitchen",
    "living-room": "LivingRoom",
    "bedroom": "Bedroom",
    "bathroom": "Bathroom",
}


@action("RandomizeMaterials")
def randomize_materials(
    sim: Simulation,
    useTrainMaterials: bool | None = None,
    useValMaterials: bool | None = None,
    useTestMaterials: bool | None = None,
    useExternalMaterials: bool | None = None,
    inRoomTypes: list[str] | None = None,
) -> dict[str, Any]:
    """Give every object, the walls and the ceilings another colour and pattern.

    There is one set of patterns: which of Unity's sets are used is only checked and reported.
    """
    used = _material_sets(
        sim, useTrainMaterials, useValMaterials, useTestMaterials, useExternalMaterials
    )
    room = _room_type(sim.world.scene)
    if inRoomTypes is not None and room is not None and room not in inRoomTypes:
        listed = ", ".join(inRoomTypes)
        raise ActionError(
            f"inRoomTypes must include the scene's own room type {room}, not only {listed}"
        )
    _draw_finishes(sim, RANDOM_PATTERNS)
    return {**used, "totalMaterialsConsidered": len(RANDOM_PATTERNS)}


@action("RandomizeColors")
def randomize_colors(sim: Simulation) -> None:
    """Give every object, the walls and the ceilings another colour and leave their patterns."""
    _draw_finishes(sim, ())


@action("ResetMaterials", "ResetColors")
def reset_materials(sim: Simulation) -> None:
    """Give all surfaces their usual colours and patterns."""
    sim.world.appearance.finishes = {}
    sim.world.mark_changed()


@action("RandomizeLighting")
def randomize_lighting(
    sim: Simulation,
    synchronized: bool = False,
    brightness: list[float] | None = None,
    randomizeColor: bool = True,
    hue: list[float] | None = None,
    saturation: list[float] | None = None,
) -> None:
    """Draw brightness and colour of the daylight; there is one light, so none to synchronize."""
    if not randomizeColor and (hue is not None or saturation is not None):
        raise ActionError(
            "Cannot pass in randomizeColor=False while also providing hue or saturation."
        )
    # All three are drawn whatever is used, so that the draws after this action do not depend on
    # `randomizeColor`.
    factor = _draw(sim, "brightness", brightness or [0.5, 1.5], 100.0)
    tone = _draw(sim, "hue", hue or [0.0, 1.0], 1.0)
    depth = _draw(sim, "saturation", saturation or [0.5, 1.0], 1.0)
    look = sim.world.appearance
    look.brightness = factor
    look.light = np.array(colorsys.hsv_to_rgb(tone, depth, 1.0)) if randomizeColor else np.ones(3)
    sim.world.mark_changed()


@action("ResetLighting")
def reset_lighting(sim: Simulation) -> None:
    """Give the light its usual brightness and colour."""
    look = sim.world.appearance
    look.brightness, look.light = 1.0, np.ones(3)
    sim.world.mark_changed()


def _draw_finishes(sim: Simulation, patterns: tuple[int, ...]) -> None:
    """Draw a finish for everything that is seen."""
    finishes = {}
    for name in (*SHELL_NAMES, *sim.world.objects):
        tint: Array = sim.random.uniform(_DARKEST, _BRIGHTEST, 3)
        finishes[name] = Finish(tint, int(sim.random.choice(patterns)) if patterns else None)
    sim.world.appearance.finishes = finishes
    sim.world.mark_changed()


def _material_sets(
    sim: Simulation,
    train: bool | None,
    validation: bool | None,
    test: bool | None,
    external: bool | None,
) -> dict[str, bool]:
    """Return which sets of materials are used, by default those of the scene's own split."""
    split = _split(sim.world.scene)
    used = {
        "useTrainMaterials": split == "train" if train is None else train,
        "useValMaterials": split == "val" if validation is None else validation,
        "useTestMaterials": split == "test" if test is None else test,
        "useExternalMaterials": split == "train" if external is None else external,
    }
    if not any(chosen for name, chosen in used.items() if name != "useExternalMaterials"):
        raise ActionError("RandomizeMaterials needs at least one of train, val and test materials")
    return used


def _split(scene: str) -> str:
    """Return AI2-THOR's split of a scene: of 30 rooms of a type 20 train, 5 val, 5 test."""
    ithor = _ITHOR.fullmatch(scene)
    if ithor is None:
        return (
            "val"
            if scene.startswith("FloorPlan_Val")
            else "test"
            if scene.startswith("FloorPlan_Test")
            else "train"
        )
    number = int(ithor[1] or ithor[2])
    return "train" if number <= 20 else "val" if number <= 25 else "test"


def _room_type(scene: str) -> str | None:
    """Return the type of a scene's room; None for houses."""
    if scene.startswith("FloorPlan_"):
        return "RoboTHOR"
    if scene.startswith("FloorPlan"):
        number = scene.removeprefix("FloorPlan")
        return _ROOMS.get(number[0] if len(number) > 2 else "0")
    return _PROCEDURAL.get(scene.rpartition("-")[0])


def _draw(sim: Simulation, name: str, limits: list[float], largest: float) -> float:
    if len(limits) != 2 or min(limits) < 0 or max(limits) > largest:
        raise ActionError(f"{name} must be two numbers within 0 and {largest:g}, not {limits}")
    return float(sim.random.uniform(min(limits), max(limits)))
