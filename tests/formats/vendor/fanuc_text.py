"""Small teach pendant programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

HOME = (0, 0, 0, 0, -90, 0)
PLACES = {
    1: HOME,
    2: (60, 10, -10, 20, -60, 0),
    3: (90, 30, -30, 20, -60, 50),
    4: (20, 0, -10, 10, -70, 10),
}


def joints(number: int, degrees: Sequence[float], name: str = "", more: str = "") -> str:
    """A position by joint angles of the pendant."""
    rows = [", ".join(f"\tJ{j + 1}= {degrees[j]:.3f} deg" for j in part) for part in (range(3), range(3, 6))]
    text = ",\n".join(rows)
    label = f"{number}:{name}" if name else f"{number}"
    return f"P[{label}]{{\n   GP1:\n\tUF : 0, UT : 1,\t\n{text}{more}\n}};\n"


def place(number: int, xyzwpr: Sequence[float], config: str = "N U T, 0, 0, 0", uf: str = "0", ut: str = "1") -> str:
    """A position by the place of the tool."""
    x, y, z, w, p, r = xyzwpr
    return (
        f"P[{number}]{{\n   GP1:\n\tUF : {uf}, UT : {ut},\t\tCONFIG : '{config}',\n"
        f"\tX = {x:.3f}  mm,\tY = {y:.3f}  mm,\tZ = {z:.3f}  mm,\n"
        f"\tW = {w:.3f} deg,\tP = {p:.3f} deg,\tR = {r:.3f} deg\n}};\n"
    )


def listing(
    body: Sequence[str],
    positions: Mapping[int, Sequence[float]] | str = PLACES,
    *,
    name: str = "CYCLE",
    group: str = "1,*,*,*,*",
) -> str:
    """A program of numbered instructions: a motion stands right behind its number, all others behind two spaces."""
    rows = []
    for number, code in enumerate(body, start=1):
        gap = "" if code[:1] in "JLCAS" and code[1:2] == " " else "  "
        rows.append(f"{number:4d}:{gap}{code} ;")
    if not isinstance(positions, str):
        positions = "".join(joints(number, degrees) for number, degrees in positions.items())
    return (
        f'/PROG  {name}\n/ATTR\nOWNER\t\t= MNEDITOR;\nCOMMENT\t\t= "";\nLINE_COUNT\t= {len(body)};\n'
        f"PROTECT\t\t= READ_WRITE;\nDEFAULT_GROUP\t= {group};\nCONTROL_CODE\t= 00000000 00000000;\n/MN\n"
        + "".join(f"{row}\n" for row in rows)
        + f"/POS\n{positions}/END\n"
    )


def written(folder: Path, text: str | bytes, name: str = "cycle.ls") -> Path:
    """A file with a text."""
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path
