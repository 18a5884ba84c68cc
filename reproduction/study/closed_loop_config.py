"""Parameters of the study on hidden machines (`studies/params.yaml`, section `close_the_loop`)."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from robojoule.documents import Document

Range = tuple[float, float]
Count = Annotated[int, Field(ge=1)]


class MachineRanges(Document):
    """Ranges that the figures of hidden machines are drawn from, uniformly."""

    ramp_s: Range = Field(description="Velocity over acceleration limit of joints, from the wrist to the base. [s]")
    filter_s: Range = Field(description="Filter time of controllers with joint accelerations. [s]")
    slower: Range = Field(description="Velocity limits of the slower controller over the nominal ones. [-]")
    filter_factor: Range = Field(description="Filter time of another one over the nominal one. [-]")
    scaled_exponent: Range = Field(description="Power of the limit by which another one scales accelerations. [-]")
    odd_step_s: float = Field(gt=0, description="Step to which durations of the odd machine are rounded up. [s]")
    odd_dead_s: float = Field(ge=0, description="What each of its motions takes beyond that. [s]")
    direction: Range = Field(description="Acceleration limits of the other direction, asymmetric machine. [-]")
    filter_growth: Range = Field(description="Its filter time at full speed over that at none. [-]")
    dead_s: Range = Field(description="Its dead time. [s]")
    jitter_s: float = Field(ge=0, description="Standard deviation of durations of the machine that jitters. [s]")
    payload: Range = Field(description="Payload of plants that differ over the nominal one. [-]")
    friction: Range = Field(description="Their Coulomb and viscous friction over the nominal one, joint by joint. [-]")
    load_friction: Range = Field(description="Their friction over transmitted torque. [-]")


class CloseTheLoopParams(Document):
    """Hidden machines, trees, trials."""

    seed: int = Field(ge=0)
    robot: str
    payload_kg: float = Field(ge=0)
    trees: Count
    cycle_times_percent: list[Annotated[float, Field(ge=100, le=1000)]] = Field(min_length=1)
    noise_draws: Count
    stamp_s: float = Field(gt=0, description="Resolution of a trace's stamps. [s]")
    energy_noise: float = Field(ge=0, description="Of a motion's measured energy. [-]")
    stopwatch_s: float = Field(gt=0, description="Resolution of a stopwatch. [s]")
    stopwatch_draws: Count
    reserve_percent: float = Field(ge=0, lt=100)
    machines: MachineRanges
