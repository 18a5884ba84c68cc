"""URScript on grounds that nobody knows: what may move, leave or set something is said, and never taken as known."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.formats.vendor.running import DEEPEST_CALLS, MOST_STEPS
from robojoule.formats.vendor.trace import Beside, CycleStart, Load, Motion, Unknown, Wait
from robojoule.formats.vendor.ur.program import read_ur
from robojoule.formats.vendor.zones import ASSUMED_BLEND

A, B, C = ([value, -1.5, -1.8, -1.2, 1.6, 0.0] for value in (-1.6, -1.0, -0.5))
SIGNAL = "get_digital_in(1)"


def traced(tmp_path, body, **given):
    (tmp_path / "cycle.script").write_text(body)
    trace = read_ur(tmp_path / "cycle.script").trace(Beside(**given))
    return list(trace.events), [str(note) for note in trace.notes]


def order(events) -> str:
    """Events as letters: the target of a motion, ? for what is not known, . for a wait, ( for the cycle's beginning."""
    names = {tuple(A): "A", tuple(B): "B", tuple(C): "C"}
    marks = {Unknown: "?", Wait: ".", CycleStart: "(", Load: "L"}
    return "".join(
        (names.get(event.target.angles_rad, "x") if event.target is not None else "x")
        if isinstance(event, Motion)
        else marks[type(event)]
        for event in events
    )


MOVES = f"def a():\n  movej({A})\nend\n"
FLOW = {
    "a break that nobody knows": (
        f"movej({B})\ni=0\nwhile i<2:\n  if {SIGNAL}:\n    break\n  end\n  movej({A})\n  i=i+1\nend\nmovej({C})",
        "BAA?C",
    ),
    "a continue that nobody knows": (
        f"i=0\nwhile i<2:\n  i=i+1\n  if {SIGNAL}:\n    continue\n  end\n  movej({A})\nend\nmovej({C})",
        "AA?C",
    ),
    "a return that nobody knows": (
        f"def go():\n  if {SIGNAL}:\n    return 1\n  end\n  movej({A})\nend\nmovej({B})\ngo()\nmovej({C})",
        "BA?C",
    ),
    "a loop that only a signal ends": (
        f"movej({A})\nwhile True:\n  movej({B})\n  if {SIGNAL}:\n    break\n  end\n  movej({A})\nend\nmovej({C})",
        "A(BA",
    ),
    "a loop that waits for a signal": (
        f"movej({A})\nwhile True:\n  if {SIGNAL}:\n    break\n  end\n  sync()\nend\nmovej({B})",
        "A.B",
    ),
    "a loop on what never changes": (f"on=True\nmovej({A})\nwhile on:\n  movej({B})\n  movej({A})\nend", "A(BA"),
    "a loop that is counted out": (
        f"i=0\nwhile True:\n  movej({A})\n  i=i+1\n  if i==2:\n    break\n  end\n  if {SIGNAL}:\n    sync()\n  end\n"
        f"end\nmovej({B})",
        "AAB",
    ),
    "a loop that moves nothing": (f"movej({A})\nmovej({B})\nwhile 1==1:\nend", "AB"),
    "calls of calls": (f"{MOVES}def b():\n  a()\nend\nmovej({B})\nif {SIGNAL}:\n  b()\nend\nmovej({C})", "B?C"),
    "calls that are assigned": (
        f"{MOVES}def b():\n  a()\nend\nmovej({B})\nif {SIGNAL}:\n  ok=b()\nend\nmovej({C})",
        "B?C",
    ),
    "calls in conditions": (f"{MOVES}movej({B})\nif a():\n  sync()\nend\nmovej({C})", "B?C"),
    "calls in expressions": (f"{MOVES}movej({B})\nx = not a()\nmovej({C})", "B?C"),
    "calls of other files in expressions": (f"movej({B})\nx = my_move()\nmovej({C})", "B?C"),
    "calls of built-in functions": (f"movej({B})\nx = get_actual_tcp_pose()\nsocket_open_all()\nmovej({C})", "BC"),
    "a thread that calls what moves": (
        f"{MOVES}def b():\n  a()\nend\nthread T():\n  b()\nend\nmovej({B})\nrun T()\nmovej({C})",
        "B?C",
    ),
    "a thread that calls other files": (f"thread T():\n  pick()\nend\nmovej({B})\nh = run T()\nmovej({C})", "B?C"),
    "names that begin as those of built-in functions": (f"movej({B})\nget_part()\nto_home()\nmovej({C})", "B??C"),
    "no function of the language": (f"movej({B})\nmovex({A})\nmovej({C})", "B?C"),
}


@pytest.mark.parametrize("name", FLOW)
def test_what_nobody_knows_is_not_taken_as_known(tmp_path, name):
    body, wanted = FLOW[name]
    assert order(traced(tmp_path, body)[0]) == wanted


VALUES = {
    "parameters": (f"q={A}\ndef go(q):\n  movej(q)\nend\ngo({B})\nmovej(q)", "BA"),
    "locals": (f"q={A}\ndef go():\n  local q={B}\n  movej(q)\nend\ngo()\nmovej(q)", "BA"),
    "free names": (f"def go():\n  q={B}\n  movej(q)\nend\ngo()\nmovej(q)", "Bx"),
    "globals": (f"def go():\n  global q={B}\nend\ngo()\nmovej(q)", "B"),
    "shared names": (f"q={A}\ndef go():\n  q={B}\nend\ngo()\nmovej(q)", "B"),
    "what a skipped call sets": (f"q={A}\ndef go():\n  q={B}\nend\nif {SIGNAL}:\n  go()\nend\nmovej(q)", "x"),
    "what a call in an expression sets": (f"q={A}\ndef go():\n  q={B}\n  return 1\nend\nx=go()+1\nmovej(q)", "x"),
    "what a thread sets": (f"q={A}\nthread T():\n  q={B}\nend\nrun T()\nq={A}\nmovej(q)", "x"),
    "what a loop that may be left sets": (
        f"q={A}\ni=0\nwhile i<2:\n  i=i+1\n  if {SIGNAL}:\n    break\n  end\n  q={B}\nend\nmovej(q)",
        "x",
    ),
}


@pytest.mark.parametrize("name", VALUES)
def test_names_mean_what_the_controller_knows(tmp_path, name):
    body, wanted = VALUES[name]
    assert order(traced(tmp_path, body)[0]) == wanted


def test_a_tool_that_is_set_on_a_signal_is_not_known(tmp_path):
    body = f"set_tcp(p[0,0,0.1,0,0,0])\nmovel(p[0.5,0,0.5,0,0,0])\nif {SIGNAL}:\n  set_tcp(p[0,0,0.2,0,0,0])\nend\n"
    before, after = (e for e in traced(tmp_path, f"{body}movel(p[0.5,0,0.5,0,0,0])")[0] if isinstance(e, Motion))
    assert before.target.tool is not None and after.target.tool is None


def loads(tmp_path, body):
    events, notes = traced(tmp_path, body)
    return [event.payload for event in events if isinstance(event, Load)], notes


def test_a_payload_that_is_set_on_a_signal_is_not_known(tmp_path):
    found, _ = loads(tmp_path, f"set_payload(2, [0,0,0.1])\nif {SIGNAL}:\n  set_payload(5)\nend")
    assert found[0].mass_kg == 2 and found[1] is None


def test_the_payload_is_set_one_figure_at_a_time(tmp_path):
    body = "set_payload(2, [0,0,0.1])\nset_payload_mass(4)\nset_payload_cog([0,0.05,0.2])\nset_payload(3)\n"
    found, notes = loads(tmp_path, body)
    assert [(one.mass_kg, one.com_m) for one in found] == [
        (2, (0, 0, 0.1)),
        (4, (0, 0, 0.1)),
        (4, (0, 0.05, 0.2)),
        (3, (0, 0, 0)),
    ]
    assert notes == ["line 4: set_payload(3): its centre of mass is taken to be at the flange"]


def test_the_inertia_of_a_payload_is_read(tmp_path):
    (found, assumed), notes = loads(
        tmp_path,
        "set_target_payload(2, [0,0,0.1], [0.01,0.02,0.03,0.001,0.002,0.003])\nset_target_payload(2, [0,0,0.1], x)",
    )
    xx, xy, xz = found.inertia_kg_m2[0]
    assert (xx, xy, xz, found.inertia_kg_m2[2][2]) == (0.01, 0.001, 0.002, 0.03)
    assert assumed.inertia_kg_m2 is None and "its inertia is not known" in notes[0]


def test_a_radius_that_nobody_knows_is_assumed_and_told(tmp_path):
    events, notes = traced(tmp_path, f"movej({A})\nmovej({B}, r=get_analog_in(1))\nmovej({C})")
    assert events[1].blend is ASSUMED_BLEND
    assert notes == ["line 2: the program does not say how far its zone reaches: taken as half of the way"]


def test_a_function_that_others_call_is_not_the_program(tmp_path):
    helper, program = (
        f"def open_g():\n  movej({C})\nend\n",
        f"def main():\n  movej({A})\n  open_g()\n  movej({B})\nend\n",
    )
    events, notes = traced(tmp_path, helper + program)
    assert order(events) == "ACB"
    assert notes == [
        "line 4: there are no lines outside of functions: main() is planned, which no other function calls"
    ]
    assert traced(tmp_path, program)[1] == []
    events, notes = traced(tmp_path, helper + f"def other():\n  movej({A})\nend\n")
    assert order(events) == "C" and "open_g() is planned, the first function that no other one calls" in notes[0]


def test_a_loop_that_does_not_end_is_refused(tmp_path):
    with pytest.raises(InputError, match=f"line 2: the program does not end within {MOST_STEPS} steps"):
        traced(tmp_path, "n=0\nwhile n<1:\n  n=n-1\nend")


def test_a_chain_of_calls_is_followed_so_far(tmp_path):
    chain = "".join(f"def f{at}():\n  f{at + 1}()\nend\n" for at in range(400))
    events, _ = traced(tmp_path, f"{chain}def f400():\n  movej({B})\nend\nmovej({A})\nf0()\nmovej({C})")
    assert order(events) == "A?C"
    assert f"called within more than {DEEPEST_CALLS} other calls" in events[1].what


def test_a_thread_with_arguments_that_call_functions_is_read(tmp_path):
    events, _ = traced(tmp_path, f"thread T(x):\n  sync()\nend\nmovej({A})\nrun T(d2r(5))\nmovej({B})")
    assert order(events) == "AB"
    assert np.allclose(events[1].target.angles_rad, B)


def test_pose_add_adds_positions_and_turns_the_first_by_the_second_in_its_own_axes(tmp_path):
    """As the script manual says: p_3.P = p_1.P + p_2.P, p_3.R = p_1.R * p_2.R; two quarter turns do not commute."""
    quarter = np.pi / 2
    body = f"set_tcp(p[0,0,0,0,0,0])\nmovej(pose_add(p[1,2,3,{quarter},0,0],p[1,1,1,0,{quarter},0]))\n"
    events, _ = traced(tmp_path, body)
    target = events[-1].target
    assert np.allclose(target.position_m, (2, 3, 4))
    about_x, about_y = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    assert np.allclose(target.rotation, about_x @ about_y, atol=1e-12)


def test_what_a_line_that_is_not_understood_names_is_not_known_behind_it(tmp_path):
    body = f"x=1\ny=1\nmovej({A})\nx+=1\nif y==1:\n  movej({B})\nend\nif x==1:\n  movej({C})\nend\n"
    assert order(traced(tmp_path, body)[0]) == "AB?"
