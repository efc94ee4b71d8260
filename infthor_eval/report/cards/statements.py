"""The sentences of a card: how a set was made, what it is for, what is wrong with it.

They are the responsible-AI fields of Croissant, which the card in Markdown has as sections.
"""

from collections.abc import Iterator

from infthor_eval.report.cards.facts import SetFacts

# Names of the fields in Croissant's responsible-AI vocabulary 1.0, and headings in the card.
RAI_FIELDS = {
    "dataCollection": "How it was made",
    "dataPreprocessingProtocol": "What was done to the frames",
    "dataAnnotationProtocol": "Where the answers come from",
    "dataUseCases": "What it is for",
    "dataLimitations": "What it is not for",
    "dataBiases": "Biases",
    "personalSensitiveInformation": "Personal and sensitive information",
    "dataSocialImpact": "Social impact",
    "dataReleaseMaintenancePlan": "Upkeep",
}
_SIMULATORS = {
    "embedded": "the embedded simulator of infthor-eval (AI2-THOR's protocol, procedural homes)",
    "unity": "AI2-THOR in Unity",
}


def description(facts: SetFacts) -> str:
    """Return what is in the set, in a paragraph."""
    n_frames = facts.n_frames
    frames = f"{n_frames:,} egocentric frames" if n_frames else "no frames"
    needles = (
        "What answers a question lies in one, two or many frames of a trajectory (Needle(s) in the "
        "Embodied Haystack, ∞-THOR)."
    )
    if not facts.kinds:
        return (
            f"{facts.n_questions} questions on {facts.contents.n_trajectories} long trajectories "
            f"of a household robot, with {frames}. {needles}"
        )
    return (
        f"{facts.n_pairs} pairs of questions on {facts.n_bases} long trajectories of a household "
        f"robot, in {facts.contents.n_trajectories} worlds with {frames}. Both questions of a pair "
        "have the same words, and another answer in another world, in which one thing is changed; "
        f"a pair counts if both are right. {needles}"
    )


def statements(facts: SetFacts) -> dict[str, str]:
    """Return the text of each of `RAI_FIELDS`."""
    return {
        "dataCollection": _collection(facts),
        "dataPreprocessingProtocol": _preprocessing(facts),
        "dataAnnotationProtocol": _annotation(facts),
        "dataUseCases": _use_cases(facts),
        "dataLimitations": " ".join(_limitations(facts)),
        "dataBiases": " ".join(_biases(facts)),
        "personalSensitiveInformation": "None: frames and texts are of simulated homes, and no "
        "person is shown, named or asked.",
        "dataSocialImpact": "Memory of a home is what household robots need, and what could be "
        "used to watch people who live in one. The set has no data of real homes.",
        "dataReleaseMaintenancePlan": _upkeep(facts),
    }


def _collection(facts: SetFacts) -> str:
    simulator = _SIMULATORS.get(
        facts.data.simulator or "", "a simulator that the set does not name"
    )
    scenes = f" in {len(facts.scenes)} scenes" if facts.scenes else ""
    twins = (
        " Twins are the same episode replayed in a world with one thing changed: the agent's pose "
        "is the same at each step, and frames are equal wherever the change is not in view."
        if facts.kinds
        else ""
    )
    return (
        "A planner carries out household tasks that are drawn one after the other (∞-THOR, "
        f"Algorithm 1){scenes}; frames and the state of all objects are logged at each step. They "
        f"were rendered by {simulator}.{twins}"
    )


def _preprocessing(facts: SetFacts) -> str:
    if not facts.contents.image_sizes:
        return "The set has no frames."
    sizes = ", ".join(f"{width}x{height}" for width, height in facts.contents.image_sizes)
    colours = facts.manifest.get("colors")
    reduced = f", reduced to {colours} colours" if colours else ""
    return f"Frames have {sizes} pixels{reduced}."


def _annotation(facts: SetFacts) -> str:
    twice = (
        " Answers of pairs are found a second time by a solver that shares no code with the rules."
        if facts.kinds
        else ""
    )
    return (
        "Questions, answers and the numbers of the frames that answer them are written by rules "
        f"from the logged states (∞-THOR, Table 3). No person annotated anything.{twice}"
    )


def _use_cases(facts: SetFacts) -> str:
    pairs = " Read pairs first: who does not see what was changed has none." if facts.kinds else ""
    return (
        "Evaluation of how well vision-language models remember what they saw over long episodes, "
        f"with infthor-eval or any reader of its files.{pairs}"
    )


def _limitations(facts: SetFacts) -> Iterator[str]:
    if facts.data.simulator == "embedded":
        yield (
            "The embedded simulator's geometry is calibrated, its looks are not: scores are not "
            "comparable with those on AI2-THOR's own frames."
        )
    yield "Simulated homes, English questions, one robot without people around it."
    yield "It says nothing about real homes, and is not meant for training models that it tests."
    left_out = sum(facts.contents.left_out.values()) + sum(facts.contents.malformed.values())
    if left_out:
        yield f"{left_out} rows of its files cannot be asked, and are left out."


def _biases(facts: SetFacts) -> Iterator[str]:
    yield (
        f"Without a frame, the baseline blind has {facts.blind:.1f} % of the answers, guessed from "
        "questions on other trajectories."
    )
    whole = facts.audited.groups("file")
    if facts.kinds:
        best = max((max(group.pair_means(), default=0.0) for group in whole), default=0.0)
        yield f"Of pairs, {100 * best:.1f} %."
    yield (
        "Objects, furniture and tasks are those of AI2-THOR, whose homes are North American; "
        "common objects are asked about more often."
    )


def _upkeep(facts: SetFacts) -> str:
    if facts.manifest:
        return (
            "`infthor-eval bundle manifest.json` makes the same files again, with the version of "
            "infthor-eval that wrote them; the manifest has their digests."
        )
    return "Errors are corrected in a new version; earlier versions stay as they are."
