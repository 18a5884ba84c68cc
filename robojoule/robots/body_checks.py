"""The bodies that joints move: are their inertial figures usable?

A joint moves its child link and everything fixed to it. The sum of those links, not each link alone, needs a positive
mass and a positive definite inertia: small parts may well be published without figures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robojoule.errors import InputError
from robojoule.robots.rigid_body import RigidBody
from robojoule.robots.robot_file import JointFile, RobotFile

NO_MASS_KG = 1e-5  # vendors write 1e-6 kg for "nothing here"
# Smallest principal moment over the largest. Rounding of published figures leaves flat bodies above it.
FLATTEST = 1e-6


def check_moving_bodies(file: RobotFile, numbers: Mapping[str, int], bodies: Sequence[RigidBody], source: str) -> None:
    """Check the body behind every moving joint, before any payload is attached.

    Args:
        file: Robot file.
        numbers: For each link the number of the joint that moves it, 0 for none.
        bodies: What each joint moves.
        source: How messages name the file.

    Raises:
        InputError: A body has no inertial figures, no mass or an inertia that is not positive definite, and is not
            marked in `lumped_links`; or it is marked, but nothing gives its joint any inertia.
    """
    for number, (joint, body) in enumerate(zip(file.moving_joints, bodies, strict=True), start=1):
        links = [link for link, owner in numbers.items() if owner == number]
        if any(link in file.lumped_links for link in links):
            _check_lumped(file, joint, links, numbers, source)
            continue
        problem = _problem(file, links, body)
        if problem:
            raise InputError(
                f"joint '{joint.name}' moves {_listed(links)}, {problem}",
                file=source,
                key=f"links.{joint.child}",
                allowed="a body with positive mass and positive definite inertia, or a mark in lumped_links",
            )


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


def _check_lumped(file: RobotFile, joint: JointFile, links: list[str], numbers: Mapping[str, int], source: str) -> None:
    """Inertia lumped away leaves the joint only its rotor, and must have gone to a link nearer to the base."""
    for link in links:
        holder = file.lumped_links.get(link)
        if holder is None:
            continue
        figures = file.links[holder]
        if numbers[holder] >= numbers[link] or figures is None or figures.mass_kg <= NO_MASS_KG:
            raise InputError(
                f"'{link}' cannot be lumped into '{holder}'",
                file=source,
                key=f"lumped_links.{link}",
                allowed="a link with mass that is nearer to the base",
            )
    if file.drives.joints[joint.name].rotor_inertia_kg_m2 == 0:
        raise InputError(
            f"joint '{joint.name}' moves a lumped body, so it needs a rotor inertia above 0",
            file=source,
            key=f"drives.joints.{joint.name}.rotor_inertia_kg_m2",
        )


def _listed(links: list[str]) -> str:
    if len(links) == 1:
        return f"the link '{links[0]}'"
    return "the links " + ", ".join(f"'{link}'" for link in links)
