"""A small kitchen made by hand, for tests that need no simulator."""

from infthor_eval.thor.view import Box, Vector
from tests.thor.views import thing, view

SIZE = Box(Vector(), Vector(1.0, 1.0, 1.0))
COUNTER = thing("CounterTop|+00.00|+00.90|+00.00", receptacle=True, axis_aligned_bounding_box=SIZE)
TABLE = thing("DiningTable|+03.00|+00.90|+00.00", receptacle=True, axis_aligned_bounding_box=SIZE)
FRIDGE = thing("Fridge|+01.00|+00.00|+00.00", receptacle=True, openable=True)
MICROWAVE = thing("Microwave|+02.00|+00.90|+00.00", receptacle=True, openable=True, toggleable=True)
BASIN = thing("Sink|+00.50|+00.90|+00.00|SinkBasin", receptacle=True)
FAUCET = thing("Faucet|+00.50|+01.00|+00.00", toggleable=True)
LAMP = thing("DeskLamp|+03.00|+01.00|+00.20", toggleable=True)


def item(object_id, parent, **fields):
    return thing(object_id, pickupable=True, parent_receptacles=[parent.object_id], **fields)


APPLE = item("Apple|+01.00|+00.90|+00.10", FRIDGE, sliceable=True)
APPLE_TWO = item("Apple|+03.10|+00.90|+00.10", TABLE, sliceable=True)
KNIFE = item("Knife|+00.10|+00.90|+00.00", COUNTER)
MUG = item("Mug|+00.20|+00.90|+00.00", COUNTER, receptacle=True)
PLATE = item("Plate|+03.20|+00.90|+00.10", TABLE, receptacle=True)
SPOON = item("Spoon|+00.20|+00.95|+00.00", MUG)

KITCHEN = view(
    *(COUNTER, TABLE, FRIDGE, MICROWAVE, BASIN, FAUCET, LAMP),
    *(APPLE, APPLE_TWO, KNIFE, MUG, PLATE, SPOON),
)
