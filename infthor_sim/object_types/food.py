"""Fruit, vegetables, bread, eggs, and their slices."""

from functools import partial

from infthor_sim.object_types.record import portable

_food = partial(portable, materials=("Food",), categories=("food",))

TYPES = (
    _food("Apple", (0.12, 0.12, 0.12), shape="apple", sliceable=True, mass=0.2, centered=True,
          slice_type="AppleSliced", slices=5),
    _food("AppleSliced", (0.03, 0.11, 0.11), shape="apple_slice"),
    _food("Bread", (0.16, 0.14, 0.30), shape="bread", sliceable=True, mass=0.7, centered=True,
          slice_type="BreadSliced", slices=9),
    _food("BreadSliced", (0.03, 0.14, 0.14), shape="bread_slice", cookable=True),
    _food("Egg", (0.07, 0.07, 0.07), shape="egg", categories=("food", "small"), breakable=True,
          sliceable=True,
          mass=0.01, centered=True, slice_type="EggCracked", slices=1, cracks=True),
    _food("EggCracked", (0.09, 0.03, 0.09), shape="egg_cracked", cookable=True),
    _food("Lettuce", (0.18, 0.21, 0.25), shape="lettuce", sliceable=True, mass=0.64, centered=True,
          slice_type="LettuceSliced", slices=7),
    _food("LettuceSliced", (0.04, 0.18, 0.18), shape="lettuce_slice"),
    _food("Potato", (0.08, 0.08, 0.12), shape="potato", cookable=True, sliceable=True, mass=0.18,
          centered=True,
          slice_type="PotatoSliced", slices=8),
    _food("PotatoSliced", (0.02, 0.07, 0.08), shape="potato_slice", cookable=True),
    _food("Tomato", (0.12, 0.10, 0.13), shape="tomato", sliceable=True, mass=0.12, centered=True,
          slice_type="TomatoSliced", slices=6),
    _food("TomatoSliced", (0.02, 0.10, 0.11), shape="tomato_slice"),
)  # fmt: skip
