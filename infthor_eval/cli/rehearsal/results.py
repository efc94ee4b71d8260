"""What a rehearsal finds, as it is printed and written as JSON."""

import msgspec


class Attention(msgspec.Struct, frozen=True):
    """Calls of attention to a context, of one kind.

    Attributes:
        of: what attends: frames, a question, a token of a reply, questions together.
        kernel: kernel that torch chooses.
        has_mask: whether the kernel is given a mask.
        head_size: numbers of a head.
        calls: number of calls, one for each layer and chunk.
    """

    of: str
    kernel: str
    has_mask: bool
    head_size: int
    calls: int


class Context(msgspec.Struct, frozen=True):
    """Memory of one context, in bytes.

    Attributes:
        tokens: its tokens.
        cache: keys and values, and states of linear layers.
        activations: most that is allocated beside weights and cache while it is encoded and
            answered.
        together: the same while questions are answered together; 0 where they are not.
        features: features of earlier frames.
        total: all of it, with the weights.
        with_flash: the total with flash-attn; None where the model cannot run with it.
    """

    tokens: int
    cache: int
    activations: int
    together: int
    features: int
    total: int
    with_flash: int | None


class Gpu(msgspec.Struct, frozen=True):
    """What fits on a GPU of so much memory.

    Attributes:
        gigabytes: its memory.
        tokens: the largest context; 0 if not even the weights fit.
        frames: frames of it; None where they cannot be counted.
        tokens_with_flash: the largest context with flash-attn; None as above.
        needed: GPUs that the longest context of the tasks needs if they share a model evenly.
    """

    gigabytes: int
    tokens: int
    frames: int | None
    tokens_with_flash: int | None
    needed: int


class Images(msgspec.Struct, frozen=True):
    """How fast frames are prepared here, and encoded by a GPU.

    Attributes:
        here: frames that are read and scaled here in a second of processor time, measured.
        measured: number of frames that were measured.
        flop: operations of a frame, of matrices and of attention in the middle of the longest
            trajectory.
        by_gpu: frames that a GPU encodes in a second, estimated.
    """

    here: float
    measured: int
    flop: float
    by_gpu: float


class Frames(msgspec.Struct, frozen=True):
    """The frames of a set.

    Attributes:
        source: where the numbers are from.
        trajectories: number of trajectories.
        longest: frames of the longest trajectory.
        most_clues: most clue frames of a question; None where the set is not here.
        total: number of all frames.
        size: width and height of a frame, pixels.
        disk: bytes of the files.
    """

    source: str
    trajectories: int
    longest: int
    most_clues: int | None
    total: int
    size: tuple[int, int]
    disk: int


class Task(msgspec.Struct, frozen=True):
    """The longest context of a task.

    Attributes:
        name: of the task.
        tokens: of its longest context; None where it is unknown.
    """

    name: str
    tokens: int | None


class Rehearsed(msgspec.Struct, frozen=True):
    """What was found of one model.

    Attributes:
        model: its name.
        checkpoint: folder or hub id.
        source: where its config is from.
        parameters: number of its parameters.
        weights: bytes of parameters and buffers by torch's type.
        limit: context limit of the config, or None.
        frame_tokens: tokens of a frame, with those around it; None where frames cannot be counted.
        problem: why they cannot; empty if they can.
        flash_problem: why the model cannot run with flash-attn; empty if it can.
        attention: calls of attention to a long context.
        contexts: memory of some contexts.
        gpus: what fits on kinds of GPUs.
        images: rates of frames; None where frames cannot be counted.
        frames: the set's frames.
        tasks: contexts of the tasks.
        commands: what to type on the machine with the GPU, in order.
    """

    model: str
    checkpoint: str
    source: str
    parameters: int
    weights: dict[str, int]
    limit: int | None
    frame_tokens: int | None
    problem: str
    flash_problem: str
    attention: list[Attention]
    contexts: list[Context]
    gpus: list[Gpu]
    images: Images | None
    frames: Frames
    tasks: list[Task]
    commands: list[str]
