"""What the stages of the studies share: where results go, the command line, tables."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from reproduction.study.config import StudyParams


@dataclass(frozen=True)
class StudyLayout:
    """Files of the studies below the project's folder.

    Attributes:
        root: Folder of the project.
    """

    root: Path

    @property
    def params(self) -> Path:
        """Parameters of the studies."""
        return self.root / "studies" / "params.yaml"

    @property
    def tables_dir(self) -> Path:
        """Small result tables, kept in Git."""
        return self.root / "studies" / "tables"

    @property
    def data_dir(self) -> Path:
        """Every single plan and error, kept by DVC."""
        return self.root / "studies" / "data"


Stage = Callable[["StudyParams", StudyLayout], None]


def write_parquet(path: Path, rows: Sequence[dict[str, object]]) -> None:
    """Write rows as Parquet; `payload_kg` may be a number or a word and is kept as text."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    from robojoule.documents import atomic_path

    path.parent.mkdir(parents=True, exist_ok=True)
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    if "payload_kg" in columns:
        columns["payload_kg"] = [str(value) for value in columns["payload_kg"]]
    with atomic_path(path) as temporary:
        pq.write_table(pa.table(columns), temporary, compression="zstd")


def run(name: str, stage: Stage) -> None:
    """Run a stage from the command line; bad input ends with exit code 2."""
    parser = argparse.ArgumentParser(prog=f"python -m stages.{name}", description=stage.__doc__)
    parser.add_argument("--root", type=Path, default=Path(), help="folder of the project (default: .)")
    layout = StudyLayout(parser.parse_args().root)
    one_thread()
    from reproduction.study.config import load_study_params
    from robojoule.errors import InputError

    try:
        stage(load_study_params(layout.params), layout)
    except InputError as error:
        print(f"{name}: {error}", file=sys.stderr)
        raise SystemExit(2) from None


def one_thread() -> None:
    """Keep matrix products to one thread: the products are small, and sums must not depend on the machine."""
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[variable] = "1"


def say(name: str) -> Callable[[str], None]:
    """Progress lines of a stage."""
    return lambda text: print(f"{name}: {text}", flush=True)
