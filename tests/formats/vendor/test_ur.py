"""URScript programs: what is read of each construct, and that plans change nothing but speeds and waits."""

import random
import re
from dataclasses import dataclass, field

import numpy as np
import pytest

from robojoule.api import optimize, simulate
from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.formats.vendor.trace import Beside
from robojoule.programs.operation_tree import CoarseZone, WaitOperation
from robojoule.programs.sections import unknown_operations
from robojoule.robots import load_robot
from robojoule.robots.inverse_kinematics import flange_placement
from tests.formats.vendor.checks import assert_plan_holds

ROBOT = load_robot("ur_ur10e", payload_kg=3)
A, B, C = [-1.6, -1.7, -2.2, -0.8, 1.6, 0.0], [-1.0, -1.5, -1.8, -1.2, 1.6, 0.3], [-0.5, -1.4, -2.0, -1.1, 1.5, 0.1]


def pose_text(joints) -> str:
    """The pose of the flange as a program says it."""
    place = flange_placement(ROBOT, joints)
    r = place.rotation
    turn = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine, cosine = np.linalg.norm(turn) / 2, (np.trace(r) - 1) / 2
    vector = turn / (2 * sine) * np.arctan2(sine, cosine)
    return f"p[{', '.join(f'{value:.12f}' for value in (*place.origin_m, *vector))}]"


@dataclass(frozen=True)
class Case:
    """Lines of a program, and what is to come out; `None` for a position: any."""

    body: str
    positions: list
    radii_m: list | None = None
    waits_s: list = field(default_factory=list)
    notes: list = field(default_factory=list)
    unknown: int = 0


TCP = "set_tcp(p[0,0,0,0,0,0])\n"
CASES = {
    "by name": Case(f"movej({A}, a=1.4, v=1.05)\nmovej({B}, v=0.5, a=1.4, t=0, r=0)", [A, B]),
    "by place": Case(f"movej({A}, 1.4, 1.05, 0, 0)\nmovej({B}, 1.4, 0.8)", [A, B]),
    "defaults": Case(f"movej({A})\nmovej({B})\nmovej({A}, 1.2)\nmovej({B}, a=1.2)", [A, B, A, B]),
    "by duration": Case(f"movej({A})\nmovej({B}, a=1.4, v=1.05, t=2.5)", [A, B]),
    "named points": Case(f"global W_q={A}\nV={B}\nmovej(W_q, v=1)\nmovej(V, v=1)", [A, B]),
    "arithmetic": Case(
        f"V={A}\nmovej({B})\nV[0]=V[0]+d2r(90)/3\nmovej(V)\nmovej(V)",
        [B, [A[0] + np.pi / 6, *A[1:]], [A[0] + np.pi / 6, *A[1:]]],
    ),
    "a variable speed": Case(f"fast=1.5\nmovej({A}, v=fast)\nmovej({B}, v=fast)\nmovej({A}, v=fast/2)", [A, B, A]),
    "a main loop": Case(f"while (True):\n  movej({A})\n  movej({B})\n  sync()\nend", [B, A, B]),
    "a counted loop": Case(
        f"movej({A})\ni=0\nwhile i<2:\n  movej({B})\n  movej({A})\n  i=i+1\nend", [A, B, A, B, A], notes=["2 times"]
    ),
    "a loop that is left": Case(f"movej({A})\nwhile True:\n  movej({B})\n  break\nend\nmovej({A})", [A, B, A]),
    "branches on constants": Case(
        f"n=2\nmovej({A})\nif n==1:\n  movej({C})\nelif n==2:\n  movej({B})\nelse:\n  movej({C})\nend\nmovej({A})",
        [A, B, A],
    ),
    "a branch that nobody knows": Case(
        f"movej({A})\nmovej({B})\nif get_digital_in(1):\n  movej({C})\nend\nmovej({B})\nmovej({A})",
        [A, B, A],
        notes=["whether this runs is not known"],
        unknown=1,
    ),
    "a branch without motions": Case(
        f"movej({A})\nif get_digital_in(1):\n  set_digital_out(1, True)\nend\nmovej({B})", [A, B], notes=["it is kept"]
    ),
    "functions": Case(f"def go(q, v=1.0):\n  movej(q, v=v)\nend\nmovej({A})\ngo({B})\nmovej({A})", [A, B, A]),
    "a program of PolyScope": Case(
        f"def prog():\n  {TCP}  global W1_p={pose_text(A)}\n  global W1_q={A}\n  global W2_p={pose_text(B)}\n"
        f'  global W2_q={B}\n  while (True):\n    $ 2 "Robot Program"\n    $ 3 "MoveJ"\n'
        "    movej(get_inverse_kin(W1_p, qnear=W1_q), a=1.4, v=1.05)\n"
        "    movej(get_inverse_kin(W2_p, qnear=W2_q), a=1.4, v=1.05)\n  end\nend",
        [B, A, B],
    ),
    "places": Case(
        f"{TCP}movej({A})\nmovej({pose_text(B)})\nmovej(get_inverse_kin({pose_text(A)}), v=1)\nmovej({C})", [A, B, A, C]
    ),
    "places without a TCP": Case(
        f"movej({A})\nmovej(get_inverse_kin({pose_text(B)}, qnear={B}))\nmovej({A})",
        [A, B, A],
        notes=["the TCP is not in the file"],
    ),
    "pose_trans": Case(
        f"set_tcp(p[0,0,0.1,0,0,0])\nmovej({A})\nmovej(pose_trans({pose_text(B)}, p[0,0,0.1,0,0,0]))", [A, B]
    ),
    "linear": Case(
        f"{TCP}movej({A})\nmovel(pose_trans({pose_text(A)}, p[0,0,-0.05,0,0,0]), a=1.2, v=0.25)\n"
        f"movel({pose_text(A)}, v=0.1)\nmovej({B})",
        [A, None, A, B],
        notes=["the linear motion keeps its speed"],
    ),
    "a circle": Case(
        f"{TCP}movej({A})\nmovec(pose_trans({pose_text(A)}, p[0.02,0,-0.02,0,0,0]), "
        f"pose_trans({pose_text(A)}, p[0.04,0,0,0,0,0]), v=0.1)\nmovej({B})",
        [A, None, B],
        notes=["the circular motion keeps its speed"],
    ),
    "streams": Case(
        f"movej({A})\nmovej({B})\nservoj({C}, t=0.1)\nmovej({B})\nmovej({A})",
        [A, B, A],
        notes=["servoj() is a stream"],
        unknown=1,
    ),
    "waits": Case(f"movej({A})\nmovej({B})\nsleep(0.5)\nmovej({A})", [A, B, A], waits_s=[0.5]),
    "waits for signals": Case(
        f"movej({A})\nmovej({B})\nwhile (get_digital_in(2) == False):\n  sync()\nend\nmovej({A})",
        [A, B, A],
        notes=["while (get_digital_in(2) == False)"],
        unknown=1,
    ),
    "outputs between": Case(
        f'movej({A})\nset_digital_out(1, True)\nmovej({B})\ntextmsg("a # b")\nmovej({A})', [A, B, A]
    ),
    "comments": Case(f"# movej({C})\nmovej({A}) # movej({C})\nmovej({B})", [A, B]),
    "blends": Case(
        f"movej({A})\nmovej({B}, r=0.05)\nmovej({C}, 1.4, 1.0, 0, 0.02)\nmovej({A}, r=0.03)",
        [A, B, C, A],
        radii_m=[0.05, 0.02, 0],
    ),
    "payload": Case(f"set_payload(2.5, [0,0,0.05])\nmovej({A})\nmovej({B})", [A, B]),
    "threads": Case(
        f"thread T():\n  while True:\n    sync()\n  end\nend\nh = run T()\nmovej({A})\nmovej({B})\nkill h", [A, B]
    ),
    "a thread that moves": Case(
        f"thread T():\n  movej({C})\nend\nmovej({A})\nmovej({B})\nrun T()\nmovej({B})\nmovej({A})",
        [A, B, A],
        notes=["thread T may move the robot"],
        unknown=1,
    ),
    "something unknown": Case(
        f"movej({A})\nmovej({B})\nrobotiq_magic(3)\nmovej({B})\nmovej({A})",
        [A, B, A],
        notes=["robotiq_magic() is not in this file"],
        unknown=1,
    ),
    "what is not understood": Case(
        f"movej({A})\n@decorated\nmovej({B})", [A, B], notes=["not understood and kept: @decorated"]
    ),
    "the end": Case(f"movej({A})\nmovej({B})\nhalt\nmovej({C})", [A, B]),
}


def read(folder, body, **settings):
    (folder / "cycle.script").write_text(body)
    return load_program(folder / "cycle.script", ROBOT, **settings)


@pytest.mark.parametrize("name", CASES)
def test_each_construct_is_read(tmp_path, name):
    case = CASES[name]
    program = read(tmp_path, case.body)
    found = program.tree.configurations_rad()
    assert len(found) == len(case.positions)
    for row, wanted in zip(found, case.positions, strict=True):
        assert wanted is None or np.allclose(row, wanted, atol=1e-6)
    if case.radii_m is not None:
        assert [m.zone.radius_m if isinstance(m.zone, CoarseZone) else 0 for m in program.moves] == case.radii_m
    assert [one.duration_s for one in program.tree.atomic() if isinstance(one, WaitOperation)] == case.waits_s
    assert len(unknown_operations(program.tree)) == case.unknown
    for text in case.notes:
        assert any(text in note for note in program.notes), program.notes


@pytest.mark.parametrize("name", CASES)
def test_what_is_saved_as_it_is_keeps_every_byte(tmp_path, name):
    content = CASES[name].body.replace("\n", "\r\n").encode() + b" # Gr\xfc\xdfe"
    (tmp_path / "cycle.script").write_bytes(content)
    load_program(tmp_path / "cycle.script", ROBOT).save(tmp_path / "copy.script")
    assert (tmp_path / "copy.script").read_bytes() == content


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.radii_m is None])
def test_each_construct_is_planned_and_written(tmp_path, name):
    program = read(tmp_path, CASES[name].body)
    assert_plan_holds(program, ROBOT, tmp_path / "new.script")


def test_the_velocity_is_that_of_the_leading_axis(tmp_path):
    """Its definition in the script manual: v is reached by the joint that turns farthest."""
    program = read(tmp_path, "movej([0,-1.5,1.5,0,0,0])\nmovej([1.0,-1.5,1.5,0,0,0.5], v=0.6)")
    share = 0.6 / ROBOT.velocity_rad_s[0]
    assert program.moves[0].speed_limit_percent == pytest.approx(100 * share, abs=1e-3)
    faster = read(tmp_path, "movej([0,-1.5,1.5,0,0,0])\nmovej([1.0,-1.5,1.5,0,0,0.5], v=60)")
    assert faster.moves[0].speed_limit_percent == 100.0


def test_a_duration_overrules_the_velocity(tmp_path):
    program = read(tmp_path, f"movej({A})\nmovej({B}, 1.4, 0.1, 0.9, 0)")
    assert simulate(program, ROBOT).cycle_time_s == pytest.approx(0.9, abs=1e-3)
    plan = optimize(program, ROBOT, cycle_time="+20%")
    plan.save(tmp_path / "new.script")
    text = (tmp_path / "new.script").read_text()
    assert float(re.search(r", 1\.4, 0\.1, ([\d.]+), 0\)", text)[1]) == pytest.approx(
        plan.moves[0].duration_s, abs=1e-5
    )
    assert plan.moves[0].duration_s > 1.0


def test_a_speed_is_added_where_there_is_none(tmp_path):
    program = read(tmp_path, f"movej({A})\nmovej({B})\nmovej({A}, 1.2)\nmovej({B}, a=1.2)")
    optimize(program, ROBOT, cycle_time="+50%").save(tmp_path / "new.script")
    lines = (tmp_path / "new.script").read_text().splitlines()
    assert lines[0] == f"movej({A})"  # from an unknown position: kept
    assert re.fullmatch(rf"movej\({re.escape(str(B))}, v=[\d.]+\)", lines[1])
    assert re.fullmatch(rf"movej\({re.escape(str(A))}, 1\.2, [\d.]+\)", lines[2])
    assert re.fullmatch(rf"movej\({re.escape(str(B))}, a=1\.2, v=[\d.]+\)", lines[3])


def test_waits_take_their_length_from_beside(tmp_path):
    body = CASES["waits for signals"].body
    program = read(tmp_path, body, beside=Beside(waits_s={3: 0.7}))
    assert [one.duration_s for one in program.tree.atomic() if isinstance(one, WaitOperation)] == [0.7]


def test_functions_that_move_nothing_are_named_beside(tmp_path):
    body = f"movej({A})\nmovej({B})\nrq_open()\nif get_digital_in(1):\n  rq_open()\nend\nmovej({A})"
    program = read(tmp_path, body, beside=Beside(still=frozenset(["RQ_OPEN"])))
    assert np.allclose(program.tree.configurations_rad(), [A, B, A]) and not unknown_operations(program.tree)


def test_without_a_robot_positions_alone_are_not_enough(tmp_path):
    (tmp_path / "a.script").write_text(f"movej({A})\nmovej({B})")
    program = load_program(tmp_path / "a.script")
    with pytest.raises(InputError, match=r"a\.script, line 2: the speed is not a share of the robot's own"):
        program.tree  # noqa: B018
    assert optimize(program, ROBOT, cycle_time="+10%").saving_percent > 0


@pytest.mark.parametrize("seed", range(6))
def test_any_damage_is_read_or_refused_and_never_changed(tmp_path, seed):
    """Characters lost, doubled and swapped in a program: it is refused in one sentence, or saved as it was."""
    chance = random.Random(seed)
    for number in range(12):
        text = list(chance.choice(list(CASES.values())).body)
        for _ in range(chance.randint(1, 12)):
            place = chance.randrange(len(text))
            text[place] = chance.choice(["", text[place] * 2, chance.choice(' []()",=\n#:-'), text[place - 1]])
        content = "".join(text).encode()
        (tmp_path / f"c{number}.script").write_bytes(content)
        try:
            program = load_program(tmp_path / f"c{number}.script", ROBOT)
        except InputError as error:
            assert "\n" not in str(error)
            continue
        program.save(tmp_path / f"d{number}.script")
        assert (tmp_path / f"d{number}.script").read_bytes() == content


def test_a_branch_that_sleeps_has_no_length(tmp_path):
    path = tmp_path / "cycle.script"
    path.write_text(f"movej({A})\nmovej({B})\nif get_digital_in(2):\n  sleep(1)\nend\nmovej({A})\n")
    assert len(unknown_operations(load_program(path, ROBOT).tree)) == 1
