"""Dishes, pots, cutlery, bottles."""

from functools import partial

from infthor_sim.object_types.record import portable

_dish = partial(portable, receptacle=True, dirtyable=True, open_top=0.8, overhang=True)
_cutlery = partial(portable, mass=0.06, materials=("Metal",), categories=("cutlery",))

TYPES = (
    portable("AluminumFoil", (0.24, 0.04, 0.06), shape="foil"),
    portable("Bottle", (0.11, 0.25, 0.11), shape="bottle", categories=("bottles",), breakable=True,
             fillable=True,
             materials=("Glass",)),
    _dish("Bowl", (0.19, 0.09, 0.19), shape="bowl", categories=("dishes", "tableware"),
          breakable=True, fillable=True,
          mass=0.47, materials=("Ceramic",), takes=("food", "cutlery", "small")),
    _cutlery("ButterKnife", (0.02, 0.01, 0.27), shape="butter_knife",
             categories=("cutlery", "knives"), mass=0.11),
    _dish("Cup", (0.11, 0.14, 0.11), shape="cup", categories=("dishes", "tableware", "drinkware"),
          breakable=True,
          fillable=True, mass=0.2, materials=("Glass",), takes=("cutlery", "stationery")),
    _cutlery("Fork", (0.03, 0.02, 0.25), shape="fork"),
    portable("Kettle", (0.20, 0.19, 0.21), shape="kettle", categories=("cookware",), openable=True,
             fillable=True,
             materials=("Metal",), lid=0.4),
    _cutlery("Knife", (0.05, 0.01, 0.33), shape="knife", categories=("cutlery", "knives"),
             mass=0.3),
    _cutlery("Ladle", (0.09, 0.12, 0.27), shape="ladle", mass=0.5),
    _dish("Mug", (0.11, 0.10, 0.09), shape="mug", categories=("dishes", "tableware", "drinkware"),
          breakable=True,
          fillable=True, mass=1.0, materials=("Ceramic",), takes=("cutlery", "stationery"),
          handled=True),
    _dish("Pan", (0.28, 0.05, 0.43), shape="pan", categories=("dishes", "cookware"), mass=0.7,
          materials=("Metal",),
          takes=("food", "cutlery", "small"), refuses=("Bread",), handled=True),
    portable("PaperTowelRoll", (0.08, 0.21, 0.07), shape="paper_roll", usable_up=True,
             materials=("Paper",)),
    portable("PepperShaker", (0.07, 0.11, 0.07), shape="pepper_shaker", categories=("small",)),
    _dish("Plate", (0.24, 0.02, 0.24), shape="plate", categories=("dishes", "tableware"),
          breakable=True, mass=0.62,
          materials=("Ceramic",), takes=("food", "cutlery", "small", "drinkware", "TissueBox")),
    _dish("Pot", (0.29, 0.16, 0.31), shape="pot", categories=("dishes", "cookware"), fillable=True,
          mass=0.7,
          materials=("Metal",), takes=("food", "cutlery", "small"), refuses=("Bread",)),
    portable("SaltShaker", (0.07, 0.11, 0.07), shape="salt_shaker", categories=("small",)),
    portable("Spatula", (0.06, 0.02, 0.30), shape="spatula", categories=("cutlery",)),
    _cutlery("Spoon", (0.04, 0.02, 0.21), shape="spoon"),
    portable("WineBottle", (0.09, 0.33, 0.09), shape="wine_bottle", categories=("bottles",),
             breakable=True,
             fillable=True, materials=("Glass",)),
)  # fmt: skip
