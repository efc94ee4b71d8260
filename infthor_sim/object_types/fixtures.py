"""Fixtures of rooms: sinks, taps, baths, toilets, windows, pictures, switches, rails, floors."""

from functools import partial

from infthor_sim.object_types.record import ObjectType, Unfolding

# What hangs on a rail hangs around it; the support is where the underside of a towel or a roll of
# the usual size is.
_rail = partial(ObjectType, receptacle=True, overhang=True, area=(-1.0, 0.2, 1.0, 0.8))
_picture = partial(ObjectType, faces_room=True, flat=True, centered=True)

TYPES = (
    ObjectType("Bathtub", (1.35, 0.60, 1.78), shape="bathtub", receptacle=True, takes=(),
               basin=True),
    ObjectType("BathtubBasin", (1.20, 0.42, 1.02), shape="bathtub_basin", receptacle=True,
               takes=("washing", "Towel"),
               support=0.01, open_top=1.0, basin=True, capacity=1),
    ObjectType("Blinds", (1.01, 0.20, 0.03), shape="blinds", openable=True, centered=True,
               faces_room=True,
               beyond_room=True, unfolds=(Unfolding(1, stays=1, reach=0.75),)),
    ObjectType("Curtains", (0.96, 2.17, 0.19), shape="curtains", materials=("Fabric",),
               faces_room=True,
               beyond_room=True),
    ObjectType("DoorFrame"),
    ObjectType("Doorway", (1.00, 2.10, 0.15), shape="doorway"),
    ObjectType("Faucet", (0.27, 0.21, 0.24), shape="faucet", toggleable=True, runs_water=True),
    ObjectType("Floor", (4.98, 0.44, 5.09), shape="floor", receptacle=True, takes=(),
               beyond_room=True, capacity=None),
    _rail("HandTowelHolder", (0.17, 0.21, 0.05), shape="towel_hook", takes=("HandTowel",),
          support=-1.59,
          area=(-0.2, 0.2, 0.2, 0.8)),
    ObjectType("LightSwitch", (0.12, 0.15, 0.02), shape="light_switch", toggleable=True,
               centered=True),
    _picture("Mirror", (0.54, 0.85, 0.07), shape="mirror", breakable=True, dirtyable=True,
             materials=("Glass",)),
    _picture("Painting", (0.88, 0.81, 0.09), shape="painting"),
    _picture("Poster", (0.62, 0.71, 0.09), shape="painting"),
    ObjectType("ShowerCurtain", (0.43, 1.94, 0.37), shape="shower_curtain", openable=True,
               unfolds=(Unfolding(0, stays=-1, reach=1.1),)),
    ObjectType("ShowerDoor", (0.07, 1.96, 0.82), shape="shower_door", openable=True,
               breakable=True, faces_room=True),
    ObjectType("ShowerGlass", (1.16, 1.92, 1.30), shape="shower_glass", breakable=True),
    ObjectType("ShowerHead", (0.20, 1.41, 0.25), shape="shower_head", toggleable=True,
               runs_water=True),
    ObjectType("Sink", (0.66, 0.16, 0.50), shape="sink", receptacle=True, materials=("Ceramic",),
               takes=("food", "dishes", "cutlery", "bottles", "washing", "Kettle"), open_top=1.0,
               basin=True,
               has_cutouts=True, faces_room=True, capacity=0),
    ObjectType("SinkBasin", (0.53, 0.13, 0.35), shape="sink_basin", receptacle=True,
               materials=("Ceramic",),
               takes=("food", "dishes", "cutlery", "bottles", "washing", "Kettle"), support=0.01,
               open_top=1.0,
               basin=True, capacity=0),
    ObjectType("Toilet", (0.53, 1.04, 0.97), shape="toilet", receptacle=True, openable=True,
               materials=("Ceramic",),
               takes=("toiletries",), area=(-0.95, -1.0, 0.95, -0.44), capacity=2),  # its tank
    _rail("ToiletPaperHanger", (0.23, 0.08, 0.10), shape="paper_hanger", takes=("ToiletPaper",),
          support=-0.25),
    _rail("TowelHolder", (0.66, 0.04, 0.11), shape="rail", takes=("Towel",), support=-13.6),
    _picture("Window", (1.04, 1.55, 0.11), shape="window", breakable=True, materials=("Glass",),
             beyond_room=True),
)  # fmt: skip
