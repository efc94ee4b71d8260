"""A set as a Croissant file (mlcommons.org/croissant 1.1, with the responsible-AI fields 1.0)."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from infthor_eval.errors import wrap_errors
from infthor_eval.formats.packed.paths import table_configs
from infthor_eval.report.cards.facts import About, FileFact, SetFacts
from infthor_eval.report.cards.statements import description, statements

_PARQUET = "application/vnd.apache.parquet"
_CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "arrayShape": "cr:arrayShape",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "containedIn": "cr:containedIn",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "prov": "http://www.w3.org/ns/prov#",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isArray": "cr:isArray",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
_PAPER = "https://arxiv.org/abs/2505.16928"
# Of the benchmark, if its owner gives none for the set.
_CITATION = (
    "Bosung Kim and Prithviraj Ammanabrolu: Beyond Needle(s) in the Embodied Haystack: "
    "Environment, Architecture, and Training Considerations for Long Context Reasoning. "
    "arXiv:2505.16928, 2025"
)
# Columns of question files and what they hold (docs/formats.md); all are texts.
_COLUMNS = {
    "traj_id": "trajectory that the question is about: a folder of metadata/",
    "question": "the question",
    "gt_img_idx": "numbers of the frames that answer it, as a list",
    "answer": "gold answers, as a list; one of them is enough, or all, as the scorer says",
    "question_type": "type of the question",
    "absence": "frames that show that something is nowhere, as a list",
    "moment": "number of the frame after which it is asked; nothing is the end",
    "pair": "pair of twins; both worlds' questions have the same",
    "fact": "what the pair is about; questions on one fact are not independent",
}
_PAIR_FIELDS = {
    "id": "the pair",
    "kind": "kind of the edit",
    "seed": "seed of all that was drawn",
    "floor_plan": "scene",
}


def croissant(facts: SetFacts, about: About) -> dict[str, Any]:
    """Return a Croissant file as JSON values.

    Paths are relative to the file, which belongs beside the set's own.
    """
    url = about.url or "."
    document = {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": [
            "http://mlcommons.org/croissant/1.1",
            "http://mlcommons.org/croissant/RAI/1.0",
        ],
        "name": about.name,
        "description": description(facts),
        "license": f"https://spdx.org/licenses/{about.licence}",
        "url": url,
        "version": about.version,
        "datePublished": about.published,
        "citeAs": about.citation.strip() or _CITATION,
        "creator": [{"@type": "Person", "name": name} for name in about.creators] or None,
        "inLanguage": "en",
        "keywords": ["embodied AI", "long context", "episodic memory", "visual question answering"],
        "isLiveDataset": False,
        "distribution": list(_distribution(facts)),
        "recordSet": list(_record_sets(facts)),
        **{f"rai:{name}": text for name, text in statements(facts).items()},
        "rai:dataCollectionType": ["Software Collection"],
        "rai:hasSyntheticData": True,
        "prov:wasDerivedFrom": {"@id": _PAPER},
        "prov:wasGeneratedBy": _activities(facts),
    }
    return {name: value for name, value in document.items() if value is not None}


def _activities(facts: SetFacts) -> list[dict[str, Any]]:
    texts = statements(facts)
    names = {
        "generation and rendering": texts["dataCollection"],
        "questions": texts["dataAnnotationProtocol"],
    }
    by = (
        f"infthor-eval {facts.written_by}" if facts.written_by else "software that it does not name"
    )
    return [
        {
            "@type": "prov:Activity",
            "prov:label": name,
            "sc:description": text,
            "prov:wasAssociatedWith": {"@type": "prov:SoftwareAgent", "prov:label": by},
        }
        for name, text in names.items()
    ]


def _distribution(facts: SetFacts) -> Iterator[dict[str, Any]]:
    for file in facts.question_files:
        yield _file_object(file, "text/csv", "questions")
    if facts.pairs_file is not None:
        yield _file_object(facts.pairs_file, "application/jsonlines", "pairs of worlds")
    tables = table_configs(facts.data.directory)
    for table in tables:
        text = f"table of {table['config_name']}"
        yield _file_set(table["config_name"], _PARQUET, [table["data_files"]], text)
    if facts.contents.frames and not tables:
        folder = "frames/*.png" if facts.pairs_file else "metadata/*/*/*.*"
        yield _file_set("frames", "image/png", [folder], "frames of the trajectories")
        yield _file_set(
            "logs",
            "application/json",
            ["metadata/*/*.json"],
            "state of all objects at each step, and the actions",
        )


def _file_object(file: FileFact, encoding: str, text: str) -> dict[str, Any]:
    return _node(
        "FileObject",
        file.path,
        text,
        contentUrl=file.path,
        contentSize=f"{file.size} B",
        encodingFormat=encoding,
        sha256=file.sha256,
    )


def _file_set(name: str, encoding: str, includes: Sequence[str], text: str) -> dict[str, Any]:
    return _node("FileSet", name, text, encodingFormat=encoding, includes=list(includes))


def _node(kind: str, name: str, text: str, **more: Any) -> dict[str, Any]:
    return {"@type": f"cr:{kind}", "@id": name, "name": name, "description": text, **more}


def _record_sets(facts: SetFacts) -> Iterator[dict[str, Any]]:
    for file in facts.question_files:
        name = Path(file.path).stem
        fields = [
            _field(name, column, _COLUMNS.get(column, column), file, {"column": column})
            for column in _header(facts.data.directory / file.path)
        ]
        yield _node("RecordSet", name, "questions with their answers", field=fields)
    if facts.pairs_file is not None:
        fields = [
            _field("pairs", name, text, facts.pairs_file, {"column": name})
            for name, text in _PAIR_FIELDS.items()
        ]
        text = "pairs of worlds and what differs between them"
        yield _node("RecordSet", "pairs", text, key={"@id": "pairs/id"}, field=fields)


def _field(
    record_set: str, name: str, text: str, file: FileFact, extract: dict[str, str]
) -> dict[str, Any]:
    return {
        "@type": "cr:Field",
        "@id": f"{record_set}/{name}",
        "name": name,
        "description": text,
        "dataType": "sc:Text",
        "source": {"fileObject": {"@id": file.path}, "extract": extract},
    }


def _header(path: Path) -> list[str]:
    with (
        wrap_errors(f"{path}: cannot be read", "check its permissions"),
        path.open(encoding="utf-8-sig", newline="") as file,
    ):
        return next(csv.reader(file))
