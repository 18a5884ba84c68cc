"""What a plan means in a year."""

import pytest

from robojoule.errors import InputError
from robojoule.year import Operation, countries, yearly


def test_a_year_by_hand():
    """100 J less in each of 3600 cycles an hour, for 1000 h: 0.36 GJ, or 100 kWh."""
    operation = Operation.of(shifts=1, days=125, price_per_kwh=0.3, co2_g_per_kwh=400)
    found = yearly(1.0, 1100.0, 1000.0, operation)
    assert operation.hours_per_year == 1000.0
    assert found.saved_kwh == pytest.approx(100.0)
    assert found.saved_cost == pytest.approx(30.0)
    assert found.saved_co2_kg == pytest.approx(40.0)
    assert found.energy_given_kwh - found.energy_kwh == pytest.approx(found.saved_kwh)


def test_figures_say_where_they_come_from():
    price, co2 = Operation.of(country="CZE").sources
    assert "Eurostat" in price
    assert "Czechia, 2023" in co2
    assert Operation.of(price_per_kwh=0.1, co2_g_per_kwh=1.0).sources == ("Price: as given", "CO2: as given")


def test_every_country_has_plausible_emissions():
    for code in countries():
        assert 10.0 < Operation.of(country=code).co2_g_per_kwh < 1000.0


@pytest.mark.parametrize(
    "wrong", [{"shifts": 4}, {"days": 400}, {"country": "DE"}, {"price_per_kwh": -1}, {"co2_g_per_kwh": float("nan")}]
)
def test_figures_out_of_range_are_refused(wrong):
    with pytest.raises(InputError):
        Operation.of(**wrong)
