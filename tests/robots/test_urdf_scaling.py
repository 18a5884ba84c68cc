"""Drive files for URDFs by the scaling laws, against entries of the catalog that the same laws made."""

import numpy as np
import pytest

from robojoule.documents import write_document
from robojoule.errors import InputError, each_of
from robojoule.robots import load_robot, load_robot_file
from robojoule.robots.urdf import write_urdf
from robojoule.robots.urdf_scaling import roles_of, scaled_drive_file
from tests.robots.arms import arm_file
from tests.robots.test_urdf import TWO_JOINTS


def urdf_of(folder, file, **changes):
    """A URDF without its drive file; changes are of its joints' limits."""
    joints = [j if j.type == "fixed" else j.model_copy(update=changes) for j in file.joints]
    write_urdf(file.model_copy(update={"joints": joints}), folder / "arm.urdf")
    (folder / "arm.drives.json").unlink()
    return folder / "arm.urdf"


def scaled_robot(path, rated_payload_kg, **options):
    data, lacking = scaled_drive_file(path, rated_payload_kg, **options)
    assert not lacking
    write_document(path.with_suffix(".drives.yaml"), data)
    return load_robot(path)


def assert_same_drives(robot, other):
    for key, values in vars(robot.drives).items():
        np.testing.assert_allclose(values, getattr(other.drives, key), rtol=2e-3, err_msg=key)


@pytest.mark.parametrize("name", ["kuka_kr10_r1100_2", "kuka_kr210_r2700_2", "ur_ur10e", "ur_ur3e"])
def test_an_arm_of_the_catalog_gets_the_drives_that_it_has(tmp_path, name):
    entry = load_robot(name)
    path = urdf_of(tmp_path, entry.file)
    robot = scaled_robot(path, entry.file.rated_payload_kg, cobot=name.startswith("ur_"), tool=entry.file.tool.parent)
    assert_same_drives(robot, entry)
    assert robot.file.provenance["drives"].kind == "scaled"
    assert robot.file.provenance["effort"].kind == "stated"
    assert robot.file.drives.provenance.startswith("scaled from")


@pytest.mark.parametrize("effort_nm", [1000.0, 1e-5])
def test_placeholder_efforts_are_scaled(tmp_path, effort_nm):
    """The entry's own efforts are scaled, too, as its source has placeholders."""
    entry = load_robot("fanuc_m10_12_14d")
    path = urdf_of(tmp_path, entry.file, effort_nm=effort_nm, peak_effort_nm=None)
    robot = scaled_robot(path, 12.0, tool=entry.file.tool.parent)
    np.testing.assert_allclose(robot.effort_nm, entry.effort_nm, rtol=5e-3)
    assert robot.file.provenance["effort"].kind == "scaled"
    assert_same_drives(robot, entry)


def test_speeds_that_are_missing_are_those_of_arms_of_this_payload(tmp_path):
    """An arm of the catalog is within a factor of 1.6 of the power law over all."""
    entry = load_robot("kuka_kr50_r2500")
    path = urdf_of(tmp_path, entry.file)
    path.write_text(path.read_text().replace("velocity=", "speed="))
    robot = scaled_robot(path, 50.0)
    assert np.abs(np.log(robot.velocity_rad_s / entry.velocity_rad_s)).max() < np.log(1.6)
    assert "speeds" in robot.file.provenance["limits"].note


def test_continuous_joints_get_a_turn_each_way(tmp_path):
    (tmp_path / "arm.urdf").write_text(TWO_JOINTS)
    robot = scaled_robot(tmp_path / "arm.urdf", 2.0)
    assert robot.joint_names == ("shoulder", "elbow")
    np.testing.assert_allclose([robot.lower_rad[1], robot.upper_rad[1]], [-2 * np.pi, 2 * np.pi])
    assert robot.file.provenance["limits"].kind == "assumed"
    assert robot.file.tool.parent == "fore"  # no link has the name of a tool


def test_arms_of_other_numbers_of_joints(tmp_path):
    robot = scaled_robot(urdf_of(tmp_path, arm_file(7)), 1.0)
    assert robot.joint_count == 7
    assert roles_of(7) == [0, 1, 2, 2, 3, 4, 5]
    assert roles_of(6) == [0, 1, 2, 3, 4, 5]
    for count in range(1, 12):
        assert len(roles_of(count)) == count
        assert roles_of(count) == sorted(roles_of(count))


def test_what_no_law_gives_is_told(tmp_path):
    entry = load_robot_file("kuka_kr10_r1100_2")
    links = {**entry.links, "link_3": None}
    path = urdf_of(tmp_path, entry.model_copy(update={"links": links}))
    data, lacking = scaled_drive_file(path, 10.0)
    assert [error.key for error in lacking] == ["links.link_3"]
    data["links"] = {"link_3": entry.links["link_3"].model_dump()}
    write_document(path.with_suffix(".drives.json"), data)
    assert load_robot(path).joint_count == 6


def test_an_arm_without_efforts_and_inertia_is_refused_with_all_that_is_missing(tmp_path):
    entry = load_robot_file("kuka_kr10_r1100_2")
    path = urdf_of(tmp_path, entry.model_copy(update={"links": dict.fromkeys(entry.links)}))
    path.write_text(path.read_text().replace("effort=", "force="))
    with pytest.raises(InputError) as caught:
        scaled_drive_file(path, 10.0)
    assert len(each_of(caught.value)) == 12  # six limits, six bodies


@pytest.mark.parametrize(
    "options, words",
    [({"tool": "hook"}, "--tool: there is no link 'hook'"), ({"freeze": {"knee": 0}}, "--freeze: there is no joint")],
)
def test_unknown_names_are_refused(tmp_path, options, words):
    (tmp_path / "arm.urdf").write_text(TWO_JOINTS)
    with pytest.raises(InputError, match=words):
        scaled_drive_file(tmp_path / "arm.urdf", 2.0, **options)
