"""Speeds and waits written into random KRL programs: what is read again is what was wished, and the way back works."""

import random
from dataclasses import replace

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.formats.program import Program, load_program
from tests.formats.vendor.krl_text import DAT, HOME, inline, spline

POINTS, SPEEDS, DATA = ["HOME", "P1", "P2"], [100, 80, 50], ["PDEFAULT", "PPDAT1"]


def lines(chance: random.Random, depth: int = 0) -> list[str]:
    """A statement, or a block of some."""
    kind = chance.randint(0, 13)
    if kind == 4:
        return inline(chance.choice(POINTS), chance.choice(SPEEDS), data=chance.choice(DATA)).splitlines()
    if kind == 5:
        return spline(chance.choice(POINTS), chance.choice(SPEEDS), chance.choice(DATA)).splitlines()
    if kind in (6, 7):
        return [f"BAS(#VEL_PTP,{chance.choice([100, 70, 30])})"]
    if kind == 8:
        return ["PDAT_ACT=PPDAT1", "BAS(#PTP_DAT)"]
    if kind in (9, 10) and depth < 2:
        head, end = ("FOR I=1 TO 2", "ENDFOR") if kind == 9 else ("IF $IN[1] THEN", "ENDIF")
        return [head, *(line for _ in range(chance.randint(1, 3)) for line in lines(chance, depth + 1)), end]
    if kind == 11:
        return [chance.choice(["WAIT FOR $IN[2]", "WAIT SEC 0.1"])]
    return [f"PTP {{A{chance.choice([1, 4, 5, 6])} {chance.randint(-20, 20)}}}"]


def written(program: Program, tree, folder, name: str) -> Program:
    replace(program, tree=tree).save(folder / f"{name}.src")
    return load_program(folder / f"{name}.src")


@pytest.mark.parametrize("seed", range(60))
def test_what_is_wished_is_read_again(tmp_path, seed):
    chance = random.Random(seed)
    body = [line for _ in range(chance.randint(3, 10)) for line in lines(chance)]
    text = "\n".join(["DEF c( )", "INT I", "BAS(#INITMOV,0)", f"PTP {HOME}", *body, "END", ""])
    (tmp_path / "c.src").write_text(text)
    (tmp_path / "c.dat").write_text(DAT)
    try:
        program = load_program(tmp_path / "c.src")
    except InputError:  # nothing moves between known positions
        return
    repeated = program.source.resolution.repeated
    speeds, waits = {}, {}
    for move in program.moves:
        is_free = not move.fixed and move.name not in repeated
        slower = float(chance.randint(5, int(move.speed_limit_percent)))
        speeds[move.name] = chance.choice([slower, move.speed_limit_percent]) if is_free else move.speed_limit_percent
        waits[move.name] = chance.choice([0.0, 0.0, 0.5]) if move.name not in repeated and move.is_fine else 0.0
    new = written(program, program.tree.with_plan(speeds, added_waits_after_s=waits), tmp_path, "n")
    assert np.array_equal(new.tree.configurations_rad(), program.tree.configurations_rad())
    assert [move.speed_limit_percent for move in new.moves] == list(speeds.values())
    assert [move.added_wait_after_s for move in new.moves] == list(waits.values())
    given = {move.name: old.speed_limit_percent for move, old in zip(new.moves, program.moves, strict=True)}
    back = written(new, new.tree.with_plan(given, added_waits_after_s=dict.fromkeys(given, 0.0)), tmp_path, "b")
    assert [move.speed_limit_percent for move in back.moves] == list(given.values())
    assert "robojoule" not in back.text


def test_a_variable_keeps_its_value_where_it_says_a_speed(tmp_path):
    """It may be used elsewhere, as in a wait."""
    text = f"DEF cycle( )\nDECL INT V\nV=60\nPTP {HOME}\ngo(V)\nWAIT SEC V/60\ngo(50)\nEND\n"
    sub = "DEF go(S:IN)\nINT S\nBAS(#VEL_PTP,S)\nPTP {A1 30}\nPTP {A1 -30}\nEND\n"
    (tmp_path / "cycle.src").write_text(text.replace("go(50)", "BAS(#VEL_PTP,V)\nPTP {A1 20}") + sub)
    program = load_program(tmp_path / "cycle.src")
    tree = program.tree.with_plan({move.name: 40.0 for move in program.moves})
    new = written(program, tree, tmp_path, "slow.src")
    assert "\nV=60\n" in new.source.program.sources[0].text and "go(V)" in new.source.program.sources[0].text
    assert [move.speed_limit_percent for move in new.moves] == [40.0, 40.0, 40.0]


AXES = "".join(f"$VEL_AXIS[{axis}]=30\n" for axis in range(1, 7))
A, B = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n", "PTP {A1 30}\n"


@pytest.mark.parametrize(
    "between", ["$VEL_AXIS[7]=10\n", "$VEL_AXIS[1]=30\n", "FOR I=1 TO 3\n$VEL_AXIS[I]=30\nENDFOR\n"]
)
def test_speeds_of_single_axes_leave_those_of_the_others(tmp_path, between):
    """What a plan writes for the motion before them does not reach the motion behind them."""
    (tmp_path / "cycle.src").write_text(f"DEF cycle( )\n{A}{AXES}{B}{between}{A}END\n")
    program = load_program(tmp_path / "cycle.src")
    first, _ = program.moves
    new = written(program, program.tree.with_plan({first.name: 20.0}), tmp_path, "slow.src")
    assert [move.speed_limit_percent for move in new.moves] == [20.0, 30.0]


def test_a_motion_whose_axes_differ_keeps_all_their_speeds(tmp_path):
    loops = "FOR I=1 TO 6\n$VEL_AXIS[I]=30\nENDFOR\n", "FOR I=1 TO 3\n$VEL_AXIS[I]=50\nENDFOR\n"
    (tmp_path / "cycle.src").write_text(f"DEF cycle( )\n{A}{loops[0]}{B}{loops[1]}{A}END\n")
    program = load_program(tmp_path / "cycle.src")
    first, second = program.moves
    assert second.fixed
    new = written(program, program.tree.with_plan({first.name: 20.0}), tmp_path, "slow.src")
    assert [move.speed_limit_percent for move in new.moves] == [20.0, 30.0]
