"""From operation trees to optimisation graphs."""

import pytest

from robojoule.errors import InputError
from robojoule.formats.tree_files import parse_tree
from robojoule.planning.graph import Arc, Collision, OptimizationGraph, Phase, Vertex, graph_of_tree, process_energy_j

TREE = {
    "format": "robojoule-operation-tree",
    "version": 1,
    "name": "glue",
    "start_rad": [0.0, 0.0],
    "operations": [
        {"type": "wait", "name": "part arrives", "duration_s": 0.5},
        {"type": "move", "name": "via", "target_rad": [0.1, 0.0], "zone": {"radius_m": 0.05}},
        {"type": "move", "name": "to glue", "target_rad": [0.2, 0.0], "wait_after_s": 0.25},
        {
            "type": "compound",
            "name": "glueing",
            "operations": [
                {"type": "process", "name": "open", "duration_s": 0.5, "power_w": 10.0},
                {"type": "process", "name": "harden", "duration_s": 1.0, "power_w": 40.0},
                {"type": "move", "name": "along", "target_rad": [0.4, 0.0], "wait_before_s": 0.125},
            ],
        },
        {"type": "move", "name": "home", "target_rad": [0.0, 0.0]},
        {"type": "wait", "name": "belt", "duration_s": 2.0},
    ],
}


def test_a_tree_becomes_a_ring_of_vertices_with_least_waits():
    graph = graph_of_tree(parse_tree(TREE, "tree"), "r1")
    assert [(v.name, v.moves, v.least_prior_wait_s, v.least_post_wait_s) for v in graph.vertices] == [
        ("to glue", ("via", "to glue"), 0.5, 1.75),
        ("along", ("along",), 0.125, 0.0),
        ("home", ("home",), 0.0, 2.0),
    ]
    assert graph.edges == (Arc("to glue", "along", 0), Arc("along", "home", 0), Arc("home", "to glue", 1))
    assert graph.robots == ("r1",)
    assert graph.links == graph.collisions == ()
    assert graph.least_cycle_s([1.0, 2.0, 3.0]) == pytest.approx(6.0 + 4.375)


def test_vertices_of_one_speed_group_have_one_leader():
    """Directly, or through a vertex that shares another group with both."""
    moves = [("a", "x"), ("b", None), ("c", "y"), ("d", "x"), ("e", "y"), ("f", None)]
    operations = [{"type": "move", "name": n, "target_rad": [0.1, 0.0], "speed_group": g} for n, g in moves]
    operations[3]["zone"] = {"path_share": 0.2}  # d and e are one vertex, which joins both groups
    graph = graph_of_tree(parse_tree(TREE | {"operations": operations}, "tied"))
    assert [v.name for v in graph.vertices] == ["a", "b", "c", "e", "f"]
    assert graph.leaders.tolist() == [0, 1, 0, 0, 4]


def test_a_change_of_payload_takes_no_time():
    operations = [*TREE["operations"], {"type": "payload", "name": "empty", "mass_kg": 0.0}]
    graph = graph_of_tree(parse_tree(TREE | {"operations": operations}, "tree"))
    assert graph.vertices[-1].least_post_wait_s == 2.0


def test_one_move_is_its_own_successor():
    single = TREE | {"operations": [{"type": "move", "name": "spin", "target_rad": [0.2, 0.0]}]}
    graph = graph_of_tree(parse_tree(single, "tree"))
    assert graph.edges == (Arc("spin", "spin", 1),)


def test_process_energy_is_the_processes_own():
    assert process_energy_j(parse_tree(TREE, "tree")) == pytest.approx(0.5 * 10.0 + 1.0 * 40.0)


def test_the_least_cycle_is_that_of_the_slowest_robot():
    graph = OptimizationGraph((Vertex("a", "r1"), Vertex("b", "r2"), Vertex("c", "r2")), ())
    assert graph.least_cycle_s([5.0, 2.0, 2.5]) == 5.0


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"vertices": (Vertex("a", "r1"), Vertex("a", "r1")), "edges": ()}, "'a' appears twice"),
        ({"edges": (Arc("a", "x"),)}, "'x' is not a vertex of the graph; allowed: a, b, c"),
        ({"edges": (Arc("a", "c"),)}, "the same robot"),
        ({"edges": (), "links": (Arc("a", "b"),)}, "different robots"),
        ({"edges": (), "collisions": (Collision("a", Phase.MOVE, "b", Phase.MOVE),)}, "different robots"),
    ],
    ids=["duplicate", "unknown", "edge between robots", "link within a robot", "collision within a robot"],
)
def test_inconsistent_graphs_are_refused(fields, message):
    with pytest.raises(InputError, match=message):
        OptimizationGraph(**{"vertices": (Vertex("a", "r1"), Vertex("b", "r1"), Vertex("c", "r2"))} | fields)
