"""Waits within loops with fixed counts and subprograms count once a pass, those of plans too: random programs.

The expected sums follow from the structure from which the programs are written, not from the readers.
"""

import random
from dataclasses import dataclass

import numpy as np
import pytest

from robojoule.api import optimize, simulate
from robojoule.formats.program import load_program
from robojoule.programs.operation_tree import WaitOperation
from robojoule.robots import load_robot

SEEDS = range(12)
POINTS_DEG = ((0, 0, 0, 0, 0, 0), (25, 5, -10, 0, 10, 0), (50, -10, 10, 10, 20, 30), (-20, 10, 5, 5, -10, 10))


@dataclass(frozen=True)
class Move:
    point: int


@dataclass(frozen=True)
class Pause:
    seconds: float
    is_added: bool = False  # by an earlier plan


@dataclass(frozen=True)
class Loop:
    count: int
    body: tuple


@dataclass(frozen=True)
class Call:
    name: str


def random_body(rng: random.Random, depth: int, names: list[str]) -> tuple:
    """Moves, waits, loops and calls; loops are not nested more than three times."""
    found = []
    for _ in range(rng.randint(1, 4)):
        kind = rng.random()
        if kind < 0.4:
            found.append(Move(rng.randrange(len(POINTS_DEG))))
        elif kind < 0.6:
            found.append(Pause(rng.randint(5, 40) / 100))
        elif kind < 0.7 and found and isinstance(found[-1], Move):
            found.append(Pause(rng.randint(5, 40) / 100, is_added=True))
        elif kind < 0.85 and names:
            found.append(Call(rng.choice(names)))
        elif depth > 0:
            found.append(Loop(rng.randint(2, 3), random_body(rng, depth - 1, names)))
    return tuple(found)


def random_program(seed: int, *, subs_move: bool) -> tuple[tuple, dict[str, tuple]]:
    """A main body and subprograms, each of which calls later ones only."""
    rng = random.Random(seed)
    subs: dict[str, tuple] = {}
    for name in ("SUBC", "SUBB", "SUBA"):
        body = random_body(rng, 1, list(subs)) if subs_move else (Pause(rng.randint(5, 40) / 100),)
        subs[name] = body
    main = (Move(1), Loop(2, (Move(2), *random_body(rng, 2, list(subs)))), *random_body(rng, 2, list(subs)), Move(0))
    return main, subs


def seconds_of(body: tuple, subs: dict[str, tuple]) -> float:
    """What is waited in one run of a body."""
    total = 0.0
    for one in body:
        if isinstance(one, Pause):
            total += one.seconds
        elif isinstance(one, Loop):
            total += one.count * seconds_of(one.body, subs)
        elif isinstance(one, Call):
            total += seconds_of(subs[one.name], subs)
    return total


class Krl:
    """KUKA KRL."""

    robot, suffix, subs_move = load_robot("kuka_kr16_r2010_2", payload_kg=3), ".src", True
    home = np.array([0, -90, 90, 0, 20, 0])

    def lines(self, body, depth=0):
        for one in body:
            if isinstance(one, Move):
                axes = self.home + POINTS_DEG[one.point]
                yield "PTP {" + ",".join(f"A{axis} {value}" for axis, value in enumerate(axes, start=1)) + "}"
            elif isinstance(one, Pause):
                yield f"WAIT SEC {one.seconds:g}" + (" ;robojoule: wait added by a plan" if one.is_added else "")
            elif isinstance(one, Loop):
                yield f"FOR I{depth}=1 TO {one.count}"
                yield from self.lines(one.body, depth + 1)
                yield "ENDFOR"
            else:
                yield f"{one.name}()"

    def files(self, main, subs):
        text = ["DEF cell()", "BAS(#INITMOV,0)", "BAS(#VEL_PTP,60)", *self.lines((Move(0), *main)), "END"]
        for at, (name, body) in enumerate(subs.items()):
            text += [f"DEF {name}()", *self.lines(body, 4 + 4 * at), "END"]
        return {"cell.src": "\n".join(text) + "\n"}


class Rapid:
    """ABB RAPID, on an arm of the catalog."""

    robot, suffix, subs_move = load_robot("kuka_kr16_r2010_2", payload_kg=3), ".mod", True
    home = np.array([0, -90, 90, 0, 20, 0])

    def lines(self, body, depth=0):
        for one in body:
            if isinstance(one, Move):
                axes = ",".join(map(str, self.home + POINTS_DEG[one.point]))
                yield f"MoveAbsJ [[{axes}],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v1000\\T:=1.5,fine,tool0;"
            elif isinstance(one, Pause):
                yield f"WaitTime {one.seconds:g};" + (" !robojoule: wait added by a plan" if one.is_added else "")
            elif isinstance(one, Loop):
                yield f"FOR i{depth} FROM 1 TO {one.count} DO"
                yield from self.lines(one.body, depth + 1)
                yield "ENDFOR"
            else:
                yield f"{one.name};"

    def files(self, main, subs):
        text = ["MODULE cell", "PROC main()", *self.lines((Move(0), *main)), "ENDPROC"]
        for at, (name, body) in enumerate(subs.items()):
            text += [f"PROC {name}()", *self.lines(body, 4 + 4 * at), "ENDPROC"]
        return {"cell.mod": "\n".join([*text, "ENDMODULE", ""])}


class UrScript:
    """URScript."""

    robot, suffix, subs_move = load_robot("ur_ur10e", payload_kg=3), ".script", True
    home = np.array([0, -70, 90, -100, -80, 0])

    def lines(self, body, depth=0):
        for one in body:
            if isinstance(one, Move):
                axes = ", ".join(f"{value:.6f}" for value in np.radians(self.home + POINTS_DEG[one.point]))
                yield f"movej([{axes}], a=1.4, v=0.8)"
            elif isinstance(one, Pause):
                yield f"sleep({one.seconds:g})" + (" # robojoule: wait added by a plan" if one.is_added else "")
            elif isinstance(one, Loop):
                yield f"i{depth} = 0"
                yield f"while i{depth} < {one.count}:"
                yield from (f"  {line}" for line in self.lines(one.body, depth + 1))
                yield f"  i{depth} = i{depth} + 1"
                yield "end"
            else:
                yield f"{one.name}()"

    def files(self, main, subs):
        text = ["def cell():"]
        for at, (name, body) in enumerate(subs.items()):
            text += [f"  def {name}():", *(f"    {line}" for line in self.lines(body, 4 + 4 * at)), "  end"]
        text += [f"  {line}" for line in self.lines((Move(0), *main))]
        return {"cell.script": "\n".join([*text, "end", ""])}


class TeachPendant:
    """FANUC TP, whose subprograms are files that only wait."""

    robot, suffix, subs_move = load_robot("fanuc_m20_25_18d", payload_kg=3), ".ls", False
    home = np.array([0, 10, 10, 0, -60, 0])

    def lines(self, body, depth=0):
        for one in body:
            if isinstance(one, Move):
                yield f"J P[{one.point + 1}] 60% FINE"
            elif isinstance(one, Pause):
                if one.is_added:
                    yield "  !Wait added by robojoule"
                yield f"  WAIT   {one.seconds:.2f}(sec)"
            elif isinstance(one, Loop):
                yield f"  FOR R[{depth + 1}]=1 TO {one.count}"
                yield from self.lines(one.body, depth + 1)
                yield "  ENDFOR"
            else:
                yield f"  CALL {one.name}"

    def listing(self, name, lines, positions):
        numbered = [f"{number:4}:{line} ;" for number, line in enumerate(lines, start=1)]
        head = [f"/PROG  {name}", "/ATTR", f"LINE_COUNT\t= {len(numbered)};", "DEFAULT_GROUP\t= 1,*,*,*,*;", "/MN"]
        return "\n".join([*head, *numbered, "/POS", *positions, "/END", ""])

    def files(self, main, subs):
        positions = []
        for number, point in enumerate(POINTS_DEG, start=1):
            joints = [f"J{axis}= {value:.3f} deg" for axis, value in enumerate(self.home + point, start=1)]
            positions += [f"P[{number}]{{", "   GP1:", "\tUF : 0, UT : 0,", f"\t{','.join(joints)}", "};"]
        found = {"cell.ls": self.listing("CELL", list(self.lines((Move(0), *main))), positions)}
        return found | {f"{name.lower()}.ls": self.listing(name, list(self.lines(b)), []) for name, b in subs.items()}


LANGUAGES = {"KRL": Krl(), "RAPID": Rapid(), "URScript": UrScript(), "FANUC TP": TeachPendant()}


def waited_s(tree) -> float:
    """All waits of a tree."""
    of_its_own = sum(one.duration_s for one in tree.atomic() if isinstance(one, WaitOperation))
    return of_its_own + sum(move.all_before_s + move.all_after_s for move in tree.moves())


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", LANGUAGES)
def test_waits_in_loops_count_once_a_pass(tmp_path, name, seed):
    language = LANGUAGES[name]
    main, subs = random_program(seed, subs_move=language.subs_move)
    for file, text in language.files(main, subs).items():
        (tmp_path / file).write_text(text)
    path = tmp_path / f"cell{language.suffix}"
    program = load_program(path, language.robot)
    assert waited_s(program.tree) == pytest.approx(seconds_of(main, subs), abs=1e-9)
    given_s = simulate(program, language.robot).cycle_time_s
    for share in (1.0, 1.25):
        plan = optimize(program, language.robot, cycle_time=given_s * share)
        assert plan.cycle_time_s <= given_s * share + 1e-6
        (tmp_path / "planned").mkdir(exist_ok=True)
        for file, text in language.files(main, subs).items():
            (tmp_path / "planned" / file).write_text(text)
        target = tmp_path / "planned" / path.name
        plan.save(target)
        again = load_program(target, language.robot)
        run = simulate(again, language.robot)
        assert run.cycle_time_s == pytest.approx(plan.cycle_time_s, abs=1e-6)
        assert run.energy_j == pytest.approx(plan.energy_j, rel=1e-9)
        assert waited_s(again.tree) == pytest.approx(waited_s(plan.program.tree), abs=1e-9)
