"""Compare the processor time of questions at moments with that of as many at the end.

Of one trajectory of `nieh_mini`, 120 questions on all its frames: three at each of 40 moments,
evenly spaced, and all at the end. The replies at moments are compared with those of a model that
encodes every prompt as a whole.

    python benchmarks/moments.py [--model qwen2.5-vl-nano] [--rounds 3]
"""

import argparse
import statistics
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from infthor_eval.cli.options.run import RunOptions
from infthor_eval.cli.options.values import ModelSpec
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.paths import frame_sources
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.household.wording import noun
from infthor_eval.runs import execute, prepare
from infthor_eval.storage.folders import packaged_folder

_MOMENTS, _EACH = 40, 3


def write_sets(root: Path) -> dict[str, Path]:
    """Write the set with moments and that without, and return their folders by name."""
    bundled = packaged_folder("sets/nieh_mini")
    data = NiehSet(bundled)
    traj_id = data.questions[0].traj_id
    steps = read_steps(data.folder(traj_id))
    types = sorted(TrajectoryHistory(traj_id, steps).all_object_types)
    words = [f"Is there any {noun(name)} in this room?" for name in types]
    last = len(steps) - 1
    questions = [
        Question(traj_id, words[number % len(words)], (0,), ("yes",), moment=moment)
        for at in range(_MOMENTS)
        for moment in [last * (at + 1) // _MOMENTS]
        for number in range(_EACH * at, _EACH * (at + 1))
    ]
    # Each once: at the end the words of a question are asked again with another answer.
    at_end = [
        replace(question, moment=None, answers=(f"yes {number}",))
        for number, question in enumerate(questions)
    ]
    folders = {}
    for name, asked in (("moments", questions), ("end", at_end)):
        folders[name] = root / name
        folders[name].mkdir()
        for source in frame_sources(bundled):
            (folders[name] / source.name).symlink_to(source)
        write_questions(root / name / "qa_set.csv", asked)
    return folders


def ask(model: str, data: Path, output: Path, shared: bool = True) -> tuple[float, dict[str, str]]:
    """Return the processor seconds of answering all questions of a set, and the replies."""
    models = (ModelSpec(model, {"share_prefix": str(shared).lower()}),)
    ((request, suite),) = RunOptions(models, ("nieh_full",), data, output).requests()
    prepared = prepare(request, suite)
    start = time.process_time()
    records = execute(prepared).records
    return time.process_time() - start, {it.id: it.payload.reply or it.failure for it in records}


def main() -> None:
    """Print both times, their ratio and whether the replies are equal."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", default="qwen2.5-vl-nano")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    seconds: dict[str, list[float]] = {"moments": [], "end": []}
    shared: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        sets = write_sets(Path(folder))
        ask(options.model, sets["end"], Path(folder) / "first")  # loads what all rounds use
        for number in range(options.rounds):
            for name, data in sets.items():
                taken, replies = ask(options.model, data, Path(folder) / f"{name}-{number}")
                seconds[name].append(taken)
                shared = replies if name == "moments" else shared
        _, alone = ask(options.model, sets["moments"], Path(folder) / "alone", shared=False)
    moments, end = (statistics.median(seconds[name]) for name in ("moments", "end"))
    n_equal = sum(alone[name] == reply for name, reply in shared.items())
    print(f"{len(shared)} questions: {moments:.2f} s at moments, {end:.2f} s at the end: ", end="")
    print(f"{moments / end:.2f}; {n_equal} replies as those of prompts encoded as a whole")


if __name__ == "__main__":
    main()
