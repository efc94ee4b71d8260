"""A data set card in Markdown, with the front matter that the Hugging Face hub reads."""

from collections.abc import Iterator, Mapping

import yaml

from infthor_eval.formats.packed.paths import table_configs
from infthor_eval.nieh.guessing.audit_tables import guessers_table
from infthor_eval.report.cards.facts import About, SetFacts
from infthor_eval.report.cards.statements import RAI_FIELDS, description, statements
from infthor_eval.report.exporting import export_tables
from infthor_eval.tables import Column, Row, Table

_PAPER = "[Beyond Needle(s) in the Embodied Haystack](https://arxiv.org/abs/2505.16928)"


def card(facts: SetFacts, about: About, pictures: Mapping[str, str]) -> str:
    """Return the card.

    Args:
        facts: what is in the set.
        about: what its owner says.
        pictures: captions of pictures by their path beside the card.
    """
    parts = [
        _front_matter(facts, about),
        f"# {about.name}",
        description(facts),
        *(f"![{caption}]({path})\n\n*{caption}*" for path, caption in pictures.items()),
        *_counts(facts),
        *_sections(facts),
        "## Files and versions",
        *_files(facts, about),
    ]
    return "\n\n".join(parts) + "\n"


def _front_matter(facts: SetFacts, about: About) -> str:
    size = next((name for limit, name in _SIZES if facts.n_questions < limit), "n>10K")
    in_csv = {"config_name": "default", "data_files": [file.path for file in facts.question_files]}
    fields = {
        "license": about.licence.lower(),
        "language": ["en"],
        "pretty_name": about.name,
        "task_categories": ["visual-question-answering"],
        "size_categories": [size],
        "tags": ["embodied-ai", "long-context", "episodic-memory", "ai2-thor"],
        "configs": table_configs(facts.data.directory) or [in_csv],
    }
    return f"---\n{yaml.safe_dump(fields, sort_keys=False, allow_unicode=True)}---"


_SIZES = ((1_000, "n<1K"), (10_000, "1K<n<10K"))


def _counts(facts: SetFacts) -> Iterator[str]:
    contents = facts.contents
    numbers = {
        "questions": facts.n_questions,
        "trajectories": facts.n_bases or contents.n_trajectories,
        "worlds": contents.n_trajectories if facts.kinds else 0,
        "frames": facts.n_frames,
        "scenes": len(facts.scenes),
        "pairs of questions": facts.n_pairs,
        "facts that the pairs are about": facts.n_facts,
    }
    yield "## What is in it"
    yield _table("", "what", "number", {name: n for name, n in numbers.items() if n})
    if facts.kinds:
        yield _table("Pairs by kind of edit", "kind", "pairs", facts.kinds)
    yield _table("Questions by form", "form", "questions", facts.forms)


def _table(title: str, what: str, number: str, counts: Mapping[str, int]) -> str:
    ordered = sorted(counts.items(), key=lambda one: (-one[1], one[0])) if title else counts.items()
    rows = tuple(Row((name, f"{count:,}")) for name, count in ordered)
    table = Table(title, (Column(what, False), Column(number)), rows)
    return export_tables([table], "markdown").strip()


def _sections(facts: SetFacts) -> Iterator[str]:
    texts = statements(facts)
    for field, heading in RAI_FIELDS.items():
        yield f"## {heading}"
        yield texts[field]
        if field == "dataBiases":
            yield export_tables([guessers_table(facts.audited)], "markdown").strip()


def _files(facts: SetFacts, about: About) -> Iterator[str]:
    names = [f"`{file.path}`" for file in facts.question_files]
    if facts.pairs_file is not None:
        names.append(f"`{facts.pairs_file.path}`")
    tables = [config["config_name"] for config in table_configs(facts.data.directory)]
    folders = " and `metadata/` (frames, logs)" if facts.contents.frames else ""
    if tables:
        folders = (
            f" and the same in Parquet ({', '.join(tables)}), which "
            '`datasets.load_dataset(FOLDER, "questions")` loads and `infthor-eval` runs on'
        )
    yield f"{', '.join(names)}{folders}; `croissant.json` describes them."
    by = f", written by infthor-eval {facts.written_by}" if facts.written_by else ""
    lines = [f"- Version {about.version} of {about.published}{by}", f"- Licence: {about.licence}"]
    if about.url:
        lines.append(f"- Published at {about.url}")
    if about.creators:
        lines.append(f"- Made by {', '.join(about.creators)}")
    lines.append(f"- The benchmark is that of {_PAPER}")
    if facts.frames is not None:
        lines.append(f"- Frames are version {facts.frames} of the embedded simulator's drawing")
    if facts.seeds:
        lines.append(f"- Scenes and seeds: {', '.join(facts.seeds)}")
    yield "\n".join(lines)
    if about.citation:
        yield f"```bibtex\n{about.citation.strip()}\n```"
