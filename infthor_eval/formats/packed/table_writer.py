"""Writing the Parquet tables of a packed set."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from infthor_eval.formats.packed.tables import SCHEMAS, shard_name

_SHARD_BYTES = 500_000_000
_ONE_PAGE = 2**30  # bytes; a page is what is compressed together


@dataclass(frozen=True)
class PackSettings:
    """How tables are written.

    Attributes:
        frames_per_group: frames that are compressed together, and read together.
        level: zstd's level of compression.
    """

    frames_per_group: int = 32
    level: int = 6


class TableWriter:
    """Writes the tables of a packed set, a row group at a time."""

    def __init__(self, out: Path, settings: PackSettings) -> None:
        self._out = out
        self.settings = settings
        self._files: dict[str, list[Path]] = {}
        self._open: dict[str, pq.ParquetWriter] = {}
        self._n_groups: dict[str, int] = {}

    def write(self, table: str, rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
        """Write a row group, and return its place."""
        files = self._files.setdefault(table, [])
        if files and files[-1].stat().st_size > _SHARD_BYTES:
            self._close(table)
        if table not in self._open:
            path = self._out / f".{table}-{len(files):05d}.partial"
            files.append(path)
            self._open[table] = self._writer(table, path)
            self._n_groups[table] = 0
        writer = self._open[table]
        writer.write_table(pa.Table.from_pylist(list(rows), writer.schema), len(rows))
        self._n_groups[table] += 1
        return {"shard": len(files) - 1, "row_group": self._n_groups[table] - 1}

    def close(self) -> None:
        """Finish all files, and give them their names."""
        for table, files in self._files.items():
            self._close(table)
            for at, path in enumerate(files):
                path.replace(self._out / shard_name(table, at, len(files)))

    def _close(self, table: str) -> None:
        if table in self._open:
            self._open.pop(table).close()

    def _writer(self, table: str, path: Path) -> pq.ParquetWriter:
        # Clue frames of several questions are written once: no reader of ours opens that table.
        return pq.ParquetWriter(
            path,
            _with_images(SCHEMAS[table]),
            compression="zstd",
            compression_level=self.settings.level,
            use_dictionary=table == "questions",
            dictionary_pagesize_limit=_ONE_PAGE,
            data_page_size=_ONE_PAGE,
            write_statistics=False,
        )


def _with_images(schema: pa.Schema) -> pa.Schema:
    """Return a schema that tells `datasets`, and so the hub, which columns are pictures."""
    from datasets import Features, Image, List

    features = Features.from_arrow_schema(schema)
    images = {"image": Image(), "clue_frames": List(Image())}
    features.update({name: image for name, image in images.items() if name in features})
    return schema.with_metadata(features.arrow_schema.metadata)
