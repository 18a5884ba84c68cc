"""Licences of everything that is installed beside the project: `make licences`."""

from __future__ import annotations

import csv
import sys
from importlib.metadata import Distribution, distributions

COLUMNS = ("package", "version", "licence")
_CLASSIFIER = "License :: "


def installed_licences() -> list[tuple[str, str, str]]:
    """Name, version and licence of every installed package, by name; the licence as the package itself states it."""
    found = {one.name.lower(): (one.name, one.version, _licence(one)) for one in distributions() if one.name}
    return [found[name] for name in sorted(found)]


def _licence(package: Distribution) -> str:
    """SPDX expression, else classifiers, else the first line of the free text, else that of the file."""
    said = package.metadata
    if expression := said.get_all("License-Expression"):
        return str(expression[0])
    classified = [line.removeprefix(_CLASSIFIER) for line in said.get_all("Classifier") or [] if _CLASSIFIER in line]
    if classified:
        return "; ".join(line.rpartition(" :: ")[2] for line in classified)
    text = "".join(said.get_all("License") or [])
    if not text.strip():
        files = [
            path for path in package.files or [] if path.name.upper().startswith(("LICENSE", "LICENCE", "COPYING"))
        ]
        text = files[0].read_text() if files else ""
    return next((line.strip() for line in text.splitlines() if line.strip()), "not stated")[:80]


def main() -> None:
    """Print them as CSV."""
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(installed_licences())


if __name__ == "__main__":
    main()
