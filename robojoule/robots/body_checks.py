"""The bodies that joints move: are their inertial figures usable?

A joint moves its child link and everything fixed to it. The sum of those links, not each link alone, needs a positive
mass and a positive definite inertia: small parts may well be published without figures. What a link does state must be
possible: no principal moment exceeds the sum of the other two.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.robots.rigid_body import RigidBody
from robojoule.robots.robot_file import InertiaTensor, JointFile, RobotFile

NO_MASS_KG = 1e-5  # vendors write 1e-6 kg for "nothing here"
# Smallest principal moment over the largest. Rounding of published figures leaves flat bodies above it.
FLATTEST = 1e-6
# Largest principal moment over the sum of the others; more than 1 by rounding of published figures only.
TRIANGLE_ROUNDING = 1.01
_ALLOWED = "mass_kg, com_m and a positive definite inertia_kg_m2, or a mark in lumped_links"


def moving_body_errors(
    file: RobotFile, numbers: Mapping[str, int], bodies: Sequence[RigidBody], source: str
) -> Iterator[InputError]:
    """What is wrong with the bodies behind moving joints, before any payload is attached.

    Each needs inertial figures, a mass and an inertia that is positive definite, or a mark in `lumped_links`; if it has
    the mark, something must still give its joint inertia.

    Args:
        file: Robot file.
        numbers: For each link the number of the joint that moves it, 0 for none.
        bodies: What each joint moves.
        source: How messages name the file.
    """
    for number, (joint, body) in enumerate(zip(file.moving_joints, bodies, strict=True), start=1):
        links = [link for link, owner in numbers.items() if owner == number]
        is_lumped = any(link in file.lumped_links for link in links)
        if is_lumped:
            yield from _lumping_errors(file, joint, links, numbers, source)
        elif problem := _problem(file, links, body):
            problem = f"joint '{joint.name}' moves {_listed(links)}, {problem}"
            yield InputError(problem, file=source, key=f"links.{joint.child}", allowed=_ALLOWED)
            continue
        yield from _impossible_links(file, links, source)


def inertia_matrix(tensor: InertiaTensor) -> Array:
    """An inertia as a matrix of shape (3, 3). [kg m2]"""
    i = tensor
    return np.array([[i.ixx, i.ixy, i.ixz], [i.ixy, i.iyy, i.iyz], [i.ixz, i.iyz, i.izz]])


def _impossible_links(file: RobotFile, links: Sequence[str], source: str) -> Iterator[InputError]:
    """Links with figures that no sum with others can mend."""
    for name in links:
        figures = file.links[name]
        if figures is None or figures.mass_kg == 0.0:
            continue
        moments = np.linalg.eigvalsh(inertia_matrix(figures.inertia_kg_m2))
        shown = ", ".join(f"{moment:.3g}" for moment in moments)
        problem = None
        if moments[0] < -FLATTEST * moments[2] or moments[2] < 0:
            problem = f"the inertia of link '{name}' is not positive definite (principal moments {shown} kg m2)"
        elif figures.mass_kg > NO_MASS_KG and moments[2] > TRIANGLE_ROUNDING * (moments[0] + moments[1]):
            problem = (
                f"the inertia of link '{name}' is impossible: of its principal moments {shown} kg m2 one is larger"
            )
            problem += " than the other two together"
        if problem:
            yield InputError(problem, file=source, key=f"links.{name}", allowed="the inertia_kg_m2 of a solid body")


def _problem(file: RobotFile, links: list[str], body: RigidBody) -> str | None:
    if all(file.links[link] is None for link in links):
        return "which has no inertial figures" if len(links) == 1 else "none of which has inertial figures"
    if body.mass_kg <= NO_MASS_KG:
        return f"which has no mass ({body.mass_kg:g} kg)"
    moments = np.linalg.eigvalsh(body.inertia_kg_m2)
    if moments[0] <= FLATTEST * moments[2] or moments[2] <= 0:
        shown = ", ".join(f"{moment:.3g}" for moment in moments)
        return f"whose inertia is not positive definite (principal moments {shown} kg m2)"
    return None


def _lumping_errors(
    file: RobotFile, joint: JointFile, links: list[str], numbers: Mapping[str, int], source: str
) -> Iterator[InputError]:
    """Inertia lumped away leaves the joint only its rotor, and must have gone to a link nearer to the base."""
    for link in links:
        holder = file.lumped_links.get(link)
        if holder is None:
            continue
        figures = file.links[holder]
        if numbers[holder] >= numbers[link] or figures is None or figures.mass_kg <= NO_MASS_KG:
            yield InputError(
                f"'{link}' cannot be lumped into '{holder}'",
                file=source,
                key=f"lumped_links.{link}",
                allowed="a link with mass that is nearer to the base",
            )
    if file.drives.joints[joint.name].rotor_inertia_kg_m2 == 0:
        yield InputError(
            f"joint '{joint.name}' moves a lumped body, so it needs a rotor inertia above 0",
            file=source,
            key=f"drives.joints.{joint.name}.rotor_inertia_kg_m2",
        )


def _listed(links: list[str]) -> str:
    if len(links) == 1:
        return f"the link '{links[0]}'"
    return "the links " + ", ".join(f"'{link}'" for link in links)
