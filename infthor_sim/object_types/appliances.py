"""Machines, screens and lamps."""

from functools import partial

from infthor_sim.object_types.record import ObjectType, Unfolding, portable

_machine = partial(ObjectType, moveable=True, toggleable=True)

TYPES = (
    portable("CellPhone", (0.08, 0.01, 0.16), shape="cell_phone", categories=("small", "lounge"),
             toggleable=True,
             breakable=True, mass=0.18, materials=("Plastic",)),
    _machine("CoffeeMachine", (0.44, 0.44, 0.44), shape="coffee_machine", receptacle=True,
             heat_source=True, mass=2.0,
             takes=("Mug",), support=0.13, area=(-0.7, 0.1, 0.7, 1.0), overhang=True,
             pours="coffee", capacity=None),
    _machine("DeskLamp", (0.28, 0.44, 0.29), shape="desk_lamp", light=0.9),
    _machine("Desktop", (0.88, 0.58, 0.27), shape="desktop", breakable=True),
    _machine("FloorLamp", (0.52, 1.88, 0.51), shape="floor_lamp", light=1.1),
    ObjectType("Fridge", (1.00, 1.86, 0.72), shape="fridge", receptacle=True, openable=True,
               cold_source=True,
               materials=("Metal",), takes=("food", "dishes", "bottles", "knives"), encloses=True,
               levels=(0.22, 0.41, 0.62), hinged=True, tall=True, capacity=4),
    portable("Laptop", (0.40, 0.30, 0.30), shape="laptop", categories=("lounge", "bulky"),
             openable=True,
             toggleable=True, breakable=True, mass=1.8, materials=("Plastic",), starts_open=True,
             unfolds=(Unfolding(1, stays=-1, closed=0.1),)),
    _machine("Microwave", (0.61, 0.35, 0.36), shape="microwave", receptacle=True, openable=True,
             heat_source=True,
             mass=5.0, materials=("Metal",), takes=("food", "tableware", "knives"), encloses=True,
             levels=(0.08,),
             hinged=True, runs_closed=True, built_in=True, capacity=0),
    portable("RemoteControl", (0.07, 0.02, 0.22), shape="remote", categories=("small", "lounge"),
             materials=("Plastic",)),
    ObjectType("StoveBurner", (0.22, 0.02, 0.22), shape="burner", receptacle=True, toggleable=True,
               heat_source=True,
               takes=("cookware",), overhang=True, switched_by="StoveKnob", capacity=1),
    ObjectType("StoveKnob", (0.07, 0.08, 0.07), shape="knob", toggleable=True),
    _machine("Television", (1.13, 0.81, 0.31), shape="television", breakable=True,
             materials=("Plastic",)),
    _machine("Toaster", (0.22, 0.21, 0.36), shape="toaster", receptacle=True, heat_source=True,
             mass=5.0,
             materials=("Metal",), takes=("BreadSliced",), support=0.85, overhang=True,
             capacity=None),
    ObjectType("VacuumCleaner", (0.36, 1.01, 0.31), shape="vacuum", moveable=True),
)  # fmt: skip
