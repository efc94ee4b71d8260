"""The text that tiny tokenizers are trained on: household words, so that prompts take few
tokens."""

__all__ = ["CORPUS"]

CORPUS = """\
Answer the question given the agent's views in time order. Do not include explanation or \
reasoning in the answer.
Answer with a single word or words. Question: Did you see a mug on the table? yes no
Question: What object did you put on the dresser? Question: Where was the apple before you put it \
in the fridge?
Question: How many plates did you see in the kitchen? Question: Which room has a sofa and a \
television?
Answer the question given the state and action sequence of the embodied agent. The description of \
the environment.
The agent's state is in the last image. The video shows the agent's trajectory over time.
Your main goal: put a clean mug in the coffee machine. Plan: go to the sink. Plan: pick up the mug.
Plan: open the microwave. Plan: close the fridge. Plan: heat the potato. Plan: slice the bread. \
Plan: toggle the lamp.
RotateLeft RotateRight MoveAhead LookUp LookDown OpenObject CloseObject PickupObject PutObject \
ToggleObjectOn
ToggleObjectOff SliceObject NoOp Cabinet Drawer Fridge Microwave CounterTop DiningTable SideTable \
CoffeeTable Shelf
GarbageCan SinkBasin StoveBurner CoffeeMachine Toaster ArmChair Sofa Bed Desk Dresser DeskLamp \
FloorLamp Television
the kitchen, the living room, the bedroom, the bathroom, on the counter top, in the garbage can, \
near the window
red green blue white black brown one two three four five six seven eight nine ten zero 0 1 2 3 4 \
5 6 7 8 9
You are a helpful assistant. system user assistant
What is the colour of the bowl that you picked up first? What did you do after you closed the \
cabinet?
candle, hand towel, soap bottle, toilet paper, spray bottle, cloth, key chain, credit card, cell \
phone, remote control
book, pen, pencil, newspaper, laptop, pillow, watch, vase, statue, box, basket ball, baseball \
bat, tennis racket
knife, fork, spoon, spatula, ladle, pan, pot, kettle, cup, glass bottle, wine bottle, egg, \
lettuce, tomato, potato
"""
