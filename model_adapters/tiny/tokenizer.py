"""Byte-level BPE tokenizers trained on the spot, so that tiny models need no download."""

from collections.abc import Iterable, Mapping, Sequence

from tokenizers import (
    Regex,
    Tokenizer,
    decoders,
    models,
    normalizers,
    pre_tokenizers,
    processors,
    trainers,
)
from transformers import PreTrainedTokenizerFast

# Splits letters, single digits, punctuation and white space, as current byte-level tokenizers do.
_SPLIT = r"""[^\r\n\p{L}\p{N}]?\p{L}+|\p{N}| ?[^\s\p{L}\p{N}]+[\r\n]*|\s*[\r\n]+|\s+(?!\S)|\s+"""
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


def train_tokenizer(
    special: Sequence[str],
    *,
    end: str,
    pad: str,
    begin: str | None = None,
    named: Mapping[str, str],
    corpus: Iterable[str] = tuple(CORPUS.splitlines()),
    n_merged: int = 600,
) -> PreTrainedTokenizerFast:
    """Train a tokenizer.

    Args:
        special: special tokens, including those below; their ids follow those of the trained tokens
            in this order.
        end: token that ends a turn.
        pad: padding token.
        begin: token that begins every text, or None.
        named: attribute names of tokens that processors look up, such as `image_token`.
        corpus: texts to train on; by default the package's.
        n_merged: number of trained tokens, including the 256 bytes.
    """
    tokenizer = Tokenizer(models.BPE())
    tokenizer.normalizer = normalizers.NFC()
    tokenizer.pre_tokenizer = pre_tokenizers.Sequence(
        [
            pre_tokenizers.Split(Regex(_SPLIT), behavior="isolated"),
            pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=False),
        ]
    )
    tokenizer.decoder = decoders.ByteLevel()
    trainer = trainers.BpeTrainer(
        vocab_size=n_merged,
        initial_alphabet=sorted(pre_tokenizers.ByteLevel.alphabet()),
        show_progress=False,
    )
    tokenizer.train_from_iterator(corpus, trainer)
    tokenizer.add_special_tokens(list(special))
    if begin is not None:
        tokenizer.post_processor = processors.TemplateProcessing(
            single=f"{begin} $A", special_tokens=[(begin, tokenizer.token_to_id(begin))]
        )
    return PreTrainedTokenizerFast(
        tokenizer_object=tokenizer,
        bos_token=begin,
        eos_token=end,
        pad_token=pad,
        extra_special_tokens=dict(named),
        clean_up_tokenization_spaces=False,
    )
