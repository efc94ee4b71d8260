"""Seats, beds, tables, shelves, cabinets and drawers."""

from functools import partial

from infthor_sim.object_types.record import ObjectType, portable

_furniture = partial(ObjectType, moveable=True, receptacle=True, furniture=True)
_seat = partial(ObjectType, moveable=True, receptacle=True, takes=("lounge",))
_store = partial(ObjectType, receptacle=True, openable=True, encloses=True)

TYPES = (
    _furniture("ArmChair", (0.86, 0.91, 0.84), shape="sofa", materials=("Fabric",),
               takes=("lounge",), support=0.48,
               infer_support=True),
    _furniture("Bed", (1.40, 0.92, 2.34), shape="bed", dirtyable=True, mass=100.0,
               materials=("Fabric",),
               takes=("lounge",), support=0.6, infer_support=True),
    _store("Cabinet", (0.37, 0.66, 0.40), shape="cabinet", materials=("Wood",), refuses=("bulky",),
           support=0.01,
           centered=True, levels=(0.03,), hinged=True, built_in=True, stacked=True,
           faces_room=True),
    _furniture("Cart", (0.60, 0.80, 0.40), shape="cart"),
    _seat("Chair", (0.47, 0.95, 0.54), shape="chair", mass=10.0, materials=("Wood",), support=0.5,
          infer_support=True),
    _furniture("CoffeeTable", (1.14, 0.44, 0.70), shape="coffee_table", mass=14.0,
               materials=("Wood",)),
    ObjectType("CounterTop", (0.95, 0.02, 1.35), shape="counter", receptacle=True, space_below=0.1,
               furniture=True,
               has_cutouts=True, faces_room=True),
    _furniture("Desk", (1.60, 0.80, 0.66), shape="desk", mass=30.0, materials=("Wood",),
               has_cutouts=True,
               infer_support=True),
    _furniture("DiningTable", (1.45, 0.78, 0.92), shape="dining_table", mass=20.0,
               materials=("Wood",),
               has_cutouts=True),
    # it is round
    _seat("DogBed", (0.99, 0.18, 0.83), shape="pet_bed", area=(-0.59, -0.59, 0.59, 0.59)),
    _store("Drawer", (0.49, 0.19, 0.38), shape="drawer", materials=("Wood",), refuses=("bulky",),
           centered=True,
           levels=(0.12,), slides=True, built_in=True, stacked=True, faces_room=True),
    _furniture("Dresser", (1.52, 0.97, 0.53), shape="chest", mass=30.0, materials=("Wood",),
               has_cutouts=True,
               tall=True),
    portable("Footstool", (0.28, 0.31, 0.28), shape="stool", receptacle=True, takes=("lounge",),
             area=(-0.7, -0.7, 0.7, 0.7)),
    _furniture("Ottoman", (0.85, 0.43, 0.52), shape="ottoman", takes=("lounge",),
               infer_support=True),
    _store("Safe", (0.50, 0.51, 0.56), shape="safe", moveable=True,
           takes=("small", "ornaments", "Book"),
           levels=(0.04,), hinged=True, built_in=True),
    ObjectType("Shelf", (0.51, 0.23, 0.29), shape="shelf", receptacle=True, materials=("Wood",),
               support=0.0,
               built_in=True, stacked=True, faces_room=True),
    ObjectType("ShelvingUnit", (0.94, 1.48, 0.38), shape="shelving", moveable=True, furniture=True,
               tall=True,
               faces_room=True),
    _furniture("SideTable", (0.62, 0.67, 0.37), shape="side_table", mass=10.0, materials=("Wood",),
               has_cutouts=True,
               infer_support=True),
    _furniture("Sofa", (2.47, 0.94, 0.93), shape="sofa", mass=100.0, materials=("Fabric",),
               takes=("lounge",),
               support=0.47, infer_support=True),
    _furniture("Stool", (0.36, 0.76, 0.31), shape="stool", takes=("lounge",), support=1.0,
               infer_support=True,
               area=(-0.7, -0.7, 0.7, 0.7)),
    _furniture("TVStand", (1.20, 0.73, 0.60), shape="chest", materials=("Wood",)),
)  # fmt: skip
