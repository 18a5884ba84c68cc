"""Plans in the speed limits that a controller takes: whole percents, or whole steps of another size.

A plan on continuous speed limits says where to look. Rounding each limit up would keep the cycle time, but waste what
all of them gain in sum. Instead, one of the possible speed limits of each motion is chosen so that the sum of durations
keeps within the cycle time and the energy is least (see `robojoule.planning.choice`), whatever the shape of the
profiles: those that the profiles above and below leave open are simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import PlanningError
from robojoule.formats.program import WAIT_STEP_S
from robojoule.inputs import as_number
from robojoule.planning.batch import TreeBatch
from robojoule.planning.choice import Indices, least_cost_choice, within_gap
from robojoule.planning.graph import process_energy_j
from robojoule.planning.schedule import Schedule
from robojoule.planning.standstills import Offer, Standstills, standstills_of
from robojoule.planning.tree_motions import closes
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.source import ProfileSource

SPEED_STEP_PERCENT = 1.0  # what controllers take: whole percents
CHOICE_GAP = 2e-6  # of a plan's energy, by which a better one may be missed
WAITS_PER_S = 1e9  # steps of waits as they are written
_STEP_BOUNDS_PERCENT = (0.01, 50.0)
_SAME_SHARE = 1e-9  # of a step: rounding of percents


@dataclass(frozen=True, eq=False)
class WholeSpeeds:
    """A schedule whose motions run at speed limits that the controller takes.

    Attributes:
        schedule: The schedule; `bound_j` bounds the energy of all such schedules.
        speed_limits: Speed limit of each motion, shape (V,), fractions in (0, 1].
    """

    schedule: Schedule
    speed_limits: Array


def check_speed_step(value: object) -> float:
    """A step of speed limits that can be planned with. [%]

    Raises:
        InputError: It is not a number, or out of range.
    """
    least, most = _STEP_BOUNDS_PERCENT
    return as_number(value, "speed_step", least=least, most=most, unit="%")


@dataclass(frozen=True)
class Pace:
    """How long motions take on the machine, where one figure is all that is known of it.

    Attributes:
        factor: Their durations over the simulated ones; what they take longer is taken at the idle power. [-]
        cycle_s: Cycle time of the machine; that of the plan if not given. [s]
    """

    factor: float = 1.0
    cycle_s: float | None = None

    def durations_s(self, simulated_s: list[Array]) -> list[Array]:
        """Durations on the machine, M arrays. [s]"""
        return [self.factor * one for one in simulated_s]

    def energies_j(self, simulated_j: list[Array], simulated_s: list[Array], idle_w: Array) -> list[Array]:
        """Energies on the machine, M arrays [J], from simulated ones, durations and idle powers at the ends [W]."""
        longer = self.factor - 1.0
        rows = zip(simulated_j, simulated_s, idle_w.tolist(), strict=True)
        return [energy + longer * power * seconds for energy, seconds, power in rows]


AS_SIMULATED = Pace()


def speed_choices(batch: TreeBatch, step_percent: float) -> list[Array]:
    """Speed limits from which each motion's may be chosen: whole steps in its range, and the highest, as it is given.

    Of those that give the fastest run the highest one stands for all.

    Args:
        batch: Trees.
        step_percent: Step of speed limits. [%]

    Returns:
        Fractions in (0, 1], rising, M arrays.
    """
    found = []
    for low, top, high in zip(batch.speed_range[0], batch.saturating_speed_limits, batch.speed_range[1], strict=True):
        first = int(np.ceil(100.0 * low / step_percent - _SAME_SHARE))
        last = int(np.floor(100.0 * min(top, high) / step_percent + _SAME_SHARE))
        # Nearest decimals, so that 29 % is written as 29.
        limits = np.array([round(step * step_percent, 9) / 100.0 for step in range(first, last + 1)])
        found.append(np.append(limits[limits < min(top, high) - _SAME_SHARE], high))
    return [limits if moves else limits[-1:] for limits, moves in zip(found, batch.planned.moving, strict=True)]


def whole_speed_plan(
    source: ProfileSource,
    batch: TreeBatch,
    plan: Schedule,
    *,
    step_percent: float = SPEED_STEP_PERCENT,
    reserve_s: float = 0.0,
    machine: Pace = AS_SIMULATED,
) -> WholeSpeeds:
    """The schedule with the least energy in whole speed limits, for the cycle time of a plan.

    Waits use the standby modes of the robot's controller, see `robojoule.planning.standstills`: the choice is made for
    each offer of a place where the rest of the cycle is waited, and the best one is taken.

    Args:
        source: Profiles that the plan was made on; simulated ones are simulated where they leave a choice open.
        batch: The one tree that was planned.
        plan: Plan with continuous speed limits.
        step_percent: Step of speed limits. [%]
        reserve_s: Further time that is waited at the end of the cycle. [s]
        machine: How the machine's durations differ from the simulated ones; the schedule is in its time.

    Raises:
        PlanningError: No choice keeps the cycle time.
    """
    limits = speed_choices(batch, step_percent)
    durations = _ragged(batch.planned.durations(_table(limits)), limits)
    required = np.array([[v.least_prior_wait_s, v.least_post_wait_s] for v in batch.graphs[0].vertices])
    required[-1, 1] += reserve_s
    idle = np.stack([source.idle_start_w, source.idle_end_w], axis=1)
    cycle_s = (plan.cycle_time_s if machine.cycle_s is None else machine.cycle_s) + reserve_s
    places = standstills_of(required, idle, batch.robot.standby, closed=closes(batch.trees[0]), step_s=WAIT_STEP_S)
    search = SpeedSearch(places, cycle_s, CHOICE_GAP * abs(plan.energy_j))

    known = [source.enclosure(motion) for motion in range(batch.planned.motions)]
    above = [_value(one.above, d) for one, d in zip(known, durations, strict=True)]
    offers = places.offers()
    best = search.best(offers, machine.durations_s(durations), machine.energies_j(above, durations, idle[:, 1]))
    if isinstance(source, AdaptiveProfiles):
        below = [_value(one.below, d) for one, d in zip(known, durations, strict=True)]
        at = [one[[k]] for one, k in zip(limits, best.motions, strict=True)]
        taken = [d[[k]] for d, k in zip(durations, best.motions, strict=True)]
        simulated = list(batch.planned.simulate(_table(at)).energy_j)
        reached = search.best(
            [best.offer], machine.durations_s(taken), machine.energies_j(simulated, taken, idle[:, 1])
        )
        least = machine.durations_s(durations), machine.energies_j(below, durations, idle[:, 1])
        open_ = {offer: search.within(offer, *least, reached.energy_j) for offer in offers}
        offers = [offer for offer in offers if offer == best.offer or all(left.size for left in open_[offer])]
        kept = [
            np.unique(np.concatenate([[k], *(open_[offer][motion] for offer in offers)])).astype(np.intp)
            for motion, k in enumerate(best.motions)
        ]
        limits, durations = ([one[k] for one, k in zip(of, kept, strict=True)] for of in (limits, durations))
        simulated = _ragged(batch.planned.simulate(_table(limits)).energy_j, limits)
        best = search.best(offers, machine.durations_s(durations), machine.energies_j(simulated, durations, idle[:, 1]))
    chosen_s = np.array([d[k] for d, k in zip(machine.durations_s(durations), best.motions, strict=True)])
    waits = best.waits_s(places, required, cycle_s - float(chosen_s.sum()))
    ends = np.cumsum(waits.sum(axis=1) + chosen_s)
    step_j = process_energy_j(batch.trees[0])
    schedule = replace(
        plan,
        cycle_time_s=float(ends[-1]),
        durations_s=chosen_s,
        prior_waits_s=waits[:, 0],
        post_waits_s=waits[:, 1],
        collision_waits_s=np.zeros(len(chosen_s)),
        starts_s=ends - waits[:, 1] - chosen_s,
        energy_j=best.energy_j + step_j,
        bound_j=best.bound_j + step_j,
    )
    return WholeSpeeds(schedule, np.array([one[k] for one, k in zip(limits, best.motions, strict=True)]))


@dataclass(frozen=True)
class FoundSpeeds:
    """The best choice of some offers: options of motions and of standstills, energy and bound over all of them.

    Attributes:
        offer: The offer that was taken.
        motions: Option of each motion.
        places: Option of each standstill.
        energy_j: Energy of motions and standstills. [J]
        bound_j: No choice takes less. [J]
    """

    offer: Offer
    motions: tuple[int, ...]
    places: tuple[int, ...]
    energy_j: float
    bound_j: float

    def waits_s(self, places: Standstills, required_s: Array, time_s: float) -> Array:
        """Waits of the choice before and after each motion, shape (V, 2). [s]

        Args:
            places: The standstills.
            required_s: Waits that are required, shape (V, 2). [s]
            time_s: What motions leave of the cycle. [s]
        """
        waits = required_s.copy()
        for place, option in enumerate(self.places):
            waits[places.written[place]] += float(places.times_s[place][option] - places.times_s[place][0])
        # Rounded down, as it is to be read by people.
        left_s = max(time_s - float(waits.sum()), 0.0)
        waits[places.written[self.offer.place]] += np.floor(left_s * WAITS_PER_S) / WAITS_PER_S
        return waits


@dataclass(frozen=True, eq=False)
class SpeedSearch:
    """Choices of speed limits and standstills for one cycle time.

    Attributes:
        places: The standstills.
        cycle_s: Cycle time. [s]
        tolerance_j: By how much a better choice may be missed. [J]
    """

    places: Standstills
    cycle_s: float
    tolerance_j: float

    def best(self, offers: Sequence[Offer], durations_s: list[Array], energies_j: list[Array]) -> FoundSpeeds:
        """The choice with the least energy over some offers.

        Raises:
            PlanningError: None keeps the cycle time.
        """
        found, bound_j = None, np.inf
        for offer in offers:
            times, costs = self._classes(offer, durations_s, energies_j)
            choice = least_cost_choice(times, costs, self.cycle_s, tolerance_j=self.tolerance_j)
            if choice is None:
                continue
            rest_j = offer.power_w * self.cycle_s
            bound_j = min(bound_j, choice.bound_j + rest_j)
            if found is None or choice.cost_j + rest_j < found.energy_j:
                motions, places = choice.options[: len(durations_s)], list(choice.options[len(durations_s) :])
                places[offer.place] = offer.option
                found = FoundSpeeds(offer, motions, tuple(places), choice.cost_j + rest_j, bound_j)
        if found is None:
            raise PlanningError("no speed limits of this step keep the cycle time")
        return replace(found, bound_j=bound_j)

    def within(self, offer: Offer, durations_s: list[Array], below_j: list[Array], energy_j: float) -> list[Indices]:
        """Options of motions that may be part of a choice of no more than an energy, with this offer. [J]"""
        times, costs = self._classes(offer, durations_s, below_j)
        if sum(float(one.min()) for one in times) > self.cycle_s + 1e-9:
            return [np.zeros(0, dtype=np.intp) for _ in durations_s]
        known_j = energy_j + self.tolerance_j - offer.power_w * self.cycle_s
        return within_gap(times, costs, self.cycle_s, cost_j=known_j)[: len(durations_s)]

    def _classes(
        self, offer: Offer, durations_s: list[Array], energies_j: list[Array]
    ) -> tuple[list[Array], list[Array]]:
        """Durations and costs of motions and standstills, where a second left costs what the offer says."""
        times, energies = [*self.places.times_s], [*self.places.energies_j]
        taken = slice(offer.option, offer.option + 1)
        times[offer.place] = times[offer.place][taken]
        energies[offer.place] = energies[offer.place][taken]
        each_s, each_j = [*durations_s, *times], [*energies_j, *energies]
        return each_s, [e - offer.power_w * d for e, d in zip(each_j, each_s, strict=True)]


def _table(limits: list[Array]) -> Array:
    """Rows of different lengths as one table, each filled up with its last value."""
    width = max(row.size for row in limits)
    return np.array([np.append(row, np.full(width - row.size, row[-1])) for row in limits])


def _ragged(table: Array, limits: list[Array]) -> list[Array]:
    """The rows of a table of `_table` in their own lengths."""
    return [row[: limit.size] for row, limit in zip(table, limits, strict=True)]


def _value(profile: PiecewiseLinearProfile, durations_s: Array) -> Array:
    """Energies of a profile, which leaves out runs nearer to others than rounding. [J]"""
    return profile.value(np.clip(durations_s, profile.d_min_s, profile.d_max_s))
