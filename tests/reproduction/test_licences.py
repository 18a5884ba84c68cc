"""The list of licences: every package that is installed, none without a licence."""

from importlib.metadata import version

from reproduction.licences import installed_licences


def test_every_package_states_its_licence():
    found = {name.lower(): (number, licence) for name, number, licence in installed_licences()}
    assert [name for name, (_, licence) in found.items() if licence == "not stated"] == []
    for name, licence in (("numpy", "BSD-3-Clause"), ("prefect", "Apache"), ("highspy", "MIT"), ("pyyaml", "MIT")):
        number, said = found[name]
        assert number == version(name) and licence in said
