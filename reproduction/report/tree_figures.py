"""Figures of operation trees: thesis Figures 3.1 and 4.1b."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from reproduction.report.drawing import Drawing
from reproduction.report.results import Results
from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.planning.graph import graph_of_tree
from robojoule.plots.style import BLUE, GREY, ORANGE, RED, Style
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.collision import CollisionModel, path_points_rad


def example_tree(results: Results) -> str:
    """Name of the experiment tree that examples use: the one of median joint travel."""
    joints = range(1, results.robot.joint_count + 1)
    travel = " + ".join(f"abs(end_q{joint}_rad - start_q{joint}_rad)" for joint in joints)
    rows = results.query(
        f"SELECT tree_id, sum({travel}) AS travel FROM motions WHERE split = 'experiment'"
        " GROUP BY tree_id ORDER BY round(travel, 9), tree_id"
    )
    names = rows["tree_id"]
    if not len(names):
        raise InputError("there are no experiment trees", file=results.layout.motions)
    return str(names[(len(names) - 1) // 2])


def optimization_graph(results: Results, style: Style) -> Drawing:
    """Figure 3.1: the optimisation graph of one experiment tree."""
    name = example_tree(results)
    graph = graph_of_tree(_tree(results, name), results.robot.name)
    motions = results.query('SELECT motion_id, idle_power_end_w FROM motions WHERE tree_id = ? ORDER BY "order"', name)
    count = len(graph.vertices)
    per_row = max(-(-count // 2), 1)
    figure, ax = style.figure(0.46)
    ax.set_axis_off()
    places = [(v, 1.0) if v < per_row else (count - 1 - v, 0.0) for v in range(count)]
    for vertex, (x, y), motion, idle in zip(
        graph.vertices, places, motions["motion_id"], motions["idle_power_end_w"], strict=True
    ):
        profile = results.profile(motion)
        ax.text(
            x,
            y,
            f"{vertex.name}\n{profile.durations_s[0]:.2f}–{profile.durations_s[-1]:.2f} s\n{idle:.0f} W",
            ha="center",
            va="center",
            fontsize=7.5,
            bbox={"boxstyle": "round,pad=0.45", "facecolor": "#eaf1fa", "edgecolor": BLUE},
            zorder=3,
        )
    for arc in graph.edges:
        tail, head = places[graph.index[arc.tail]], places[graph.index[arc.head]]
        color = RED if arc.cycle_shift else GREY
        bend = "arc3,rad=0.25" if arc.cycle_shift and count <= 2 else "arc3"
        ax.annotate(
            "",
            head,
            xytext=tail,
            arrowprops={"arrowstyle": "-|>", "color": color, "shrinkA": 30, "shrinkB": 30, "connectionstyle": bend},
        )
        if arc.cycle_shift:
            middle = ((tail[0] + head[0]) / 2 - 0.06, (tail[1] + head[1]) / 2)
            ax.text(*middle, "next cycle\nh = 1", ha="right", va="center", color=RED, fontsize=8)
    ax.set(xlim=(-0.75, per_row - 0.35), ylim=(-0.4, 1.4))
    return Drawing(
        figure,
        f"Optimisation graph of {name}: {count} vertices with their least and longest duration and the idle power at "
        "their end; arrows are the edges E, the red one closes the cycle. One robot: no links L, no collisions CR.",
        f"A ring of {count} boxes joined by arrows, each a movement with its range of durations and its idle power; "
        "the last arrow leads back to the first box.",
    )


def operation_tree(results: Results, style: Style) -> Drawing:
    """Figure 4.1b: a random operation tree in space."""
    name, robot = example_tree(results), results.robot
    points = _tree(results, name).configurations_rad()
    figure = style.blank(0.8)
    ax = figure.add_subplot(projection="3d")
    count = max((len(points) + 1) // 2, 1)  # the way back is the same path
    path = np.concatenate([path_points_rad(a, b) for a, b in pairwise(points[:count])])
    tool, _ = robot.tool_placements(path)
    ax.plot(*tool.T, color=RED, linewidth=1.8, zorder=6, label="path of the tool")
    stops, _ = robot.tool_placements(points[:count])
    ax.plot(*stops[1:].T, "o", color=RED, markersize=4, zorder=7)
    ax.plot(*stops[:1].T, "s", color="black", markersize=5, zorder=8, label="HOME")
    for place, stop in enumerate(stops[1:]):
        ax.text(*stop, f" p{place}", fontsize=8, zorder=9)
    capsules = CollisionModel(robot)
    farthest = int(np.argmax(np.linalg.norm(stops - stops[0], axis=1)))
    _draw_arm(ax, capsules, points[0], GREY, 0.9, "arm at HOME")
    if farthest:
        _draw_arm(ax, capsules, points[farthest], ORANGE, 0.35, f"arm at p{farthest - 1}")
    _equal_axes(ax)
    ax.legend(loc="upper left")
    return Drawing(
        figure,
        f"{name}: the tool's path from HOME through {count - 1} random points (and back the same way), and the arm at "
        "HOME and at the farthest point.",
        f"Three-dimensional view of the robot arm as thick lines and of the tool's curved path through {count - 1} "
        "points.",
    )


def _tree(results: Results, name: str) -> OperationTree:
    program = load_program(results.layout.trees_dir / f"{name}.yaml")
    program.check(results.robot)
    return program.tree


def _draw_arm(ax: Any, capsules: CollisionModel, q: Any, color: str, alpha: float, label: str) -> None:
    segments = capsules.segments_m(q)[:, :, 0]
    for place, ends in enumerate(segments):
        ax.plot(
            *ends.T,
            color=color,
            alpha=alpha,
            linewidth=5.0,
            solid_capstyle="round",
            zorder=2,
            label=label if place == 0 else None,
        )
    joints = np.array([[a[1], b[0]] for a, b in pairwise(segments)])
    for ends in joints:  # a thin line where one link's capsule ends and the next one's begins elsewhere
        ax.plot(*ends.T, color=color, alpha=alpha, linewidth=2.0, zorder=2)


def _equal_axes(ax: Any) -> None:
    limits = np.array([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()])
    limits[2, 0] = min(limits[2, 0], 0.0)
    ax.set_box_aspect(np.ptp(limits, axis=1))
    for axis, (low, high) in zip("xyz", limits, strict=True):
        ax.set(**{f"{axis}lim": (low, high), f"{axis}label": f"{axis} [m]"})
