"""Fresh results held against committed ones: `make compare`, or `python -m reproduction.compare [COMMIT]`.

Machines of another architecture round differently, and forests and networks amplify that. Tables and metrics are in Git
and are compared number by number; of what DVC keeps, Git has hashes alone. A number may be off by one unit of its last
written digit, and beside that by what `tolerance` says.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml

from robojoule.errors import InputError

RELATIVE = 1e-6
POINTS = 0.01
COMPARED = ("reports", "studies/tables")
LOCKS = ("dvc.lock", "studies/dvc.lock")
SHOWN = 10  # numbers of a file that are named

_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Difference:
    """A place in which two versions of a file differ.

    Attributes:
        place: Line and column, or key.
        fresh: What is there now.
        committed: What was committed.
        beyond: Whether that is more than rounding.
    """

    place: str
    fresh: str
    committed: str
    beyond: bool

    def __str__(self) -> str:
        return f"{self.place}: {self.fresh}, committed {self.committed}"


def tolerance(name: str, value: float) -> float:
    """How far a number may be off: 0.01 points of a percentage, a millionth of anything else.

    Args:
        name: Column or key.
        value: The committed number.
    """
    return POINTS if name.endswith("_percent") else RELATIVE * abs(value)


def is_beyond(name: str, fresh: str, committed: str) -> bool:
    """Whether two texts differ by more than their numbers, or one of these by more than it may."""
    if _NUMBER.sub("#", fresh) != _NUMBER.sub("#", committed):
        return True
    for new, old in zip(_NUMBER.findall(fresh), _NUMBER.findall(committed), strict=True):
        allowed = max(tolerance(name, float(old)), _last_digit(old), _last_digit(new))
        if abs(float(new) - float(old)) > allowed * (1.0 + RELATIVE):
            return True
    return False


def _last_digit(number: str) -> float:
    """One unit of the last written digit; whole numbers count something and are exact."""
    digits, _, power = number.lower().partition("e")
    decimals = len(digits.partition(".")[2])
    return 10.0 ** (int(power or 0) - decimals) if decimals else 0.0


def differences(file: Path, fresh: str, committed: str) -> list[Difference]:
    """Places in which two versions of a CSV or JSON file differ.

    Args:
        file: The file.
        fresh: Its text now.
        committed: Its committed text.

    Raises:
        InputError: One of them is damaged.
    """
    read = _csv_places if file.suffix == ".csv" else _json_places
    try:
        new, old = list(read(fresh)), list(read(committed))
    except (ValueError, csv.Error) as error:
        raise InputError(f"the file is damaged ({error})", file=file) from None
    if [place for place, _, _ in new] != [place for place, _, _ in old]:
        return [Difference("rows, columns or keys", f"{len(new)} values", f"{len(old)} others", True)]
    return [
        Difference(place, one, other, is_beyond(column, one, other))
        for (place, column, one), (_, _, other) in zip(new, old, strict=True)
        if one != other
    ]


def _csv_places(text: str) -> Iterator[tuple[str, str, str]]:
    """Place, column and content of every cell."""
    header, *rows = list(csv.reader(io.StringIO(text))) or [[]]
    for number, row in enumerate(rows, start=2):
        for column, cell in zip(header, row, strict=True):
            yield f"line {number}, {column}", column, cell


def _json_places(text: str) -> Iterator[tuple[str, str, str]]:
    """Place, last key and content of every value."""

    def walk(place: str, key: str, value: object) -> Iterator[tuple[str, str, str]]:
        children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
        if children is None:
            yield place, key, json.dumps(value)
        else:
            for inner, child in children:
                name = key if isinstance(value, list) else str(inner)
                yield from walk(f"{place}.{inner}" if place else str(inner), name, child)

    return walk("", "", json.loads(text))


def compare_results(root: Path, commit: str = "HEAD") -> tuple[list[str], bool]:
    """What differs between the results in a folder and those of a commit.

    Args:
        root: Folder of the project.
        commit: The commit.

    Returns:
        Lines to show, and whether a difference is more than rounding.

    Raises:
        InputError: No such commit, or the pipeline has not run here.
    """
    lines, beyond = [], False
    for lock in LOCKS:
        fresh = _hashes(root / lock, _text(root / lock))
        committed = _hashes(Path(f"{commit}:{lock}"), _git(root, "show", f"{commit}:./{lock}"))
        if lock == LOCKS[0] and (missing := [path for path in fresh if not (root / path).exists()]):
            raise InputError("there is no fresh result; run `make repro` first", file=root / missing[0])
        lines += [f"{path}: other bytes" for path in fresh if fresh[path] != committed.get(path)]
    for name in _git(root, "ls-tree", "-r", "--name-only", commit, *COMPARED).splitlines():
        if not name.endswith((".csv", ".json")):
            continue
        found = [Difference("the file", "missing", "there", True)]
        if (root / name).exists():
            found = differences(root / name, _text(root / name), _git(root, "show", f"{commit}:./{name}"))
        serious = [one for one in found if one.beyond]
        beyond = beyond or bool(serious)
        if found:
            lines.append(f"{name}: {len(found)} values differ, {len(serious)} by more than rounding")
            lines += [f"  {one}" for one in (serious or found)[:SHOWN]]
    return lines, beyond


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"the file cannot be read ({error})", file=path) from None


def _hashes(file: Path, lock: str) -> dict[str, str]:
    """MD5 of every output that a lock file names."""
    try:
        stages = yaml.safe_load(lock)["stages"].values()
        return {out["path"]: out["md5"] for stage in stages for out in stage.get("outs", [])}
    except (yaml.YAMLError, TypeError, KeyError, AttributeError):
        raise InputError("this is not a lock file of DVC", file=file) from None


def _git(root: Path, *words: str) -> str:
    try:
        done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False, encoding="utf-8")
    except OSError as error:
        raise InputError(f"git cannot be started ({error})") from None
    if done.returncode:
        problem = next(iter(done.stderr.strip().splitlines()), f"exit code {done.returncode}")
        raise InputError(f"git {words[0]} failed ({problem.removeprefix('fatal: ')})", file=root)
    return done.stdout


def main() -> None:
    """Print what differs; exit code 1 if that is more than rounding."""
    parser = argparse.ArgumentParser(prog="python -m reproduction.compare", description=__doc__.splitlines()[0])
    parser.add_argument("commit", nargs="?", default="HEAD", help="commit to compare with (default: HEAD)")
    parser.add_argument("--root", type=Path, default=Path(), help="folder of dvc.lock (default: .)")
    arguments = parser.parse_args()
    try:
        lines, beyond = compare_results(arguments.root, arguments.commit)
    except InputError as error:
        print(f"compare: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    verdict = "some results differ by more than rounding" if beyond else "all results agree to rounding"
    print("\n".join([*lines, verdict if lines else "all results are the same, byte for byte"]))
    raise SystemExit(1 if beyond else 0)


if __name__ == "__main__":
    main()
