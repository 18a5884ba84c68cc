"""What energy per cycle means in a year: kilowatt hours, their cost, and the CO2 of making them.

Prices and emissions differ by country, contract and year. The table `year-factors.json` holds defaults with year and
source; who knows their own says so.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from robojoule.errors import InputError
from robojoule.inputs import as_number, shown, unknown_name

COUNTRY = "DEU"
SHIFT_H = 8.0
_FILE = Path(__file__).with_name("year-factors.json")
_J_PER_KWH = 3.6e6


@cache
def _table() -> dict[str, Any]:
    return dict(json.loads(_FILE.read_text(encoding="utf-8")))


def countries() -> tuple[str, ...]:
    """Codes (ISO 3166-1 alpha-3) of the countries whose emissions are known."""
    return tuple(_table()["countries"])


@dataclass(frozen=True)
class Operation:
    """How much a robot works in a year, and what its electricity costs.

    Attributes:
        hours_per_year: Hours of cycles after cycles. [h]
        price_per_kwh: Price of electricity, in `currency`. [1/kWh]
        currency: Of the price.
        co2_g_per_kwh: Emissions of making electricity. [g/kWh]
        sources: Where price and emissions come from, a sentence each.
    """

    hours_per_year: float
    price_per_kwh: float
    currency: str
    co2_g_per_kwh: float
    sources: tuple[str, ...]

    @classmethod
    def of(
        cls,
        *,
        shifts: float = 2.0,
        days: float = 250.0,
        country: str = COUNTRY,
        price_per_kwh: float | None = None,
        co2_g_per_kwh: float | None = None,
    ) -> Operation:
        """A year's work with the table's figures where none are given.

        Args:
            shifts: Shifts of eight hours a day, up to 3.
            days: Working days a year.
            country: Code of the country for emissions, such as DEU, CZE or USA.
            price_per_kwh: Price of electricity. [EUR/kWh]
            co2_g_per_kwh: Emissions of making it. [g/kWh]

        Raises:
            InputError: A number is out of range, or the country is not in the table.
        """
        table = _table()
        hours = SHIFT_H * as_number(shifts, "shifts", least=0.0, most=3.0, unit="shifts a day")
        hours *= as_number(days, "days", least=0.0, most=366.0, unit="days a year")
        if not isinstance(country, str):
            raise InputError(f"{shown(country)} is not a country", key="country", allowed=f"a code such as {COUNTRY}")
        if country not in table["countries"]:
            raise unknown_name("country", country, table["countries"])
        price, of_country = table["price"], table["countries"][country]
        if price_per_kwh is None:
            eur, said = float(price["eur_per_kwh"]), f"Price: {price['of']} ({price['source']})"
        else:
            eur = as_number(price_per_kwh, "price", least=0.0, most=100.0, unit="EUR/kWh")
            said = "Price: as given"
        if co2_g_per_kwh is None:
            grams = float(of_country["co2_g_per_kwh"])
            told = f"CO2: {of_country['name']}, {of_country['year']} ({table['co2_source']})"
        else:
            grams = as_number(co2_g_per_kwh, "co2", least=0.0, most=5000.0, unit="g/kWh")
            told = "CO2: as given"
        return cls(hours, eur, "EUR", grams, (said, told))


@dataclass(frozen=True)
class Yearly:
    """What a plan means in a year.

    Attributes:
        operation: How much the robot works, and what electricity costs.
        cycles: Cycles a year.
        energy_given_kwh: Energy with the program as given. [kWh]
        energy_kwh: Energy with the plan. [kWh]
        saved_kwh: What the plan saves. [kWh]
        saved_cost: What that costs, in the operation's currency.
        saved_co2_kg: CO2 saved. [kg]
    """

    operation: Operation
    cycles: float
    energy_given_kwh: float
    energy_kwh: float
    saved_kwh: float
    saved_cost: float
    saved_co2_kg: float

    def to_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        flat = asdict(self)
        operation = flat.pop("operation")
        return {**operation, "sources": list(self.operation.sources), **flat}


def yearly(cycle_time_s: float, energy_given_j: float, energy_j: float, operation: Operation) -> Yearly:
    """What two energies per cycle of the same length mean in a year.

    Args:
        cycle_time_s: Length of the cycle. [s]
        energy_given_j: Energy of a cycle of the program as given. [J]
        energy_j: Energy of a cycle of the plan. [J]
        operation: How much the robot works.
    """
    cycles = operation.hours_per_year * 3600.0 / cycle_time_s if cycle_time_s > 0.0 else 0.0
    given, planned = (cycles * energy / _J_PER_KWH for energy in (energy_given_j, energy_j))
    saved = given - planned
    return Yearly(
        operation=operation,
        cycles=cycles,
        energy_given_kwh=given,
        energy_kwh=planned,
        saved_kwh=saved,
        saved_cost=saved * operation.price_per_kwh,
        saved_co2_kg=saved * operation.co2_g_per_kwh / 1000.0,
    )
