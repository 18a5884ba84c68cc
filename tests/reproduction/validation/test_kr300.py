import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from reproduction.validation.kr300 import (
    Kr300Model,
    Recording,
    counterbalance_nm,
    excerpt_path,
    kr300_energy_error_percent,
    load_excerpt,
    load_recording,
)
from robojoule.errors import InputError


@pytest.fixture(scope="module")
def model():
    return Kr300Model()


@pytest.fixture(scope="module")
def comparisons(model):
    return {run: model.compare(load_excerpt(run)) for run in ("a", "b")}


def dh_frames(figures, q):
    """Base to every Denavit-Hartenberg frame, by the textbook matrices."""
    frames = []
    at = np.diag([1.0, -1.0, -1.0, 1.0])
    dh = figures.dh
    for j in range(6):
        c, s = np.cos(q[j] + dh.offset_rad[j]), np.sin(q[j] + dh.offset_rad[j])
        ca, sa = np.cos(dh.alpha_rad[j]), np.sin(dh.alpha_rad[j])
        a, d = dh.a_m[j], dh.d_m[j]
        at = at @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
        frames.append(at)
    return frames


def potential_j(figures, q):
    """Potential energy of links, payload and gas spring."""
    frames = dh_frames(figures, q)
    bodies = [*zip(figures.mass_kg, figures.com_m, frames, strict=True)]
    bodies.append((figures.runs.payload_kg, figures.runs.payload_com_m, frames[-1]))
    heights = sum(mass * (frame @ [*com, 1.0])[2] for mass, com, frame in bodies)
    spring = figures.counterbalance
    far, near = spring.pivot_to_anchor_m, spring.pivot_to_rod_m
    delta = q[1] + np.radians(spring.zero_deg)
    stroke = np.sqrt(far**2 + near**2 - 2 * far * near * np.cos(delta)) - (far - near)
    area = np.pi / 4 * (spring.piston_diameter_m**2 - spring.rod_diameter_m**2)
    gas = spring.compressibility * spring.gas_constant_j_per_kg_k * spring.temperature_k * spring.nitrogen_kg
    return 9.81 * heights - gas * np.log(spring.volume_m3 - area * stroke)


def test_tool_stands_where_the_denavit_hartenberg_matrices_put_it(model):
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.5, 1.5, (10, 6))
    positions, _ = model.robot.tool_placements(q)
    for configuration, position in zip(q, positions, strict=True):
        np.testing.assert_allclose(position, dh_frames(model.figures, configuration)[-1][:3, 3], atol=1e-12)


def test_holding_torque_is_the_gradient_of_potential_energy(model):
    """Gravity and gas spring together; at rest friction leaves its asymmetry alone."""
    step = 1e-6
    asymmetry = np.array(model.figures.friction.asymmetry_nm)
    for q in np.random.default_rng(1).uniform(-1.2, 1.2, (8, 6)):
        torque = model.torque_nm(q[None], np.zeros((1, 6)), np.zeros((1, 6)))[0] - asymmetry
        gradient = [
            (potential_j(model.figures, q + step * axis) - potential_j(model.figures, q - step * axis)) / (2 * step)
            for axis in np.eye(6)
        ]
        np.testing.assert_allclose(torque, gradient, atol=2e-3)


def test_counterbalance_by_hand(model):
    """No lever at its zero; elsewhere odd round it, with the sign that lifts a leaning arm's weight."""
    spring = model.figures.counterbalance
    zero = -np.radians(spring.zero_deg)
    assert counterbalance_nm(spring, np.array([zero]))[0] == pytest.approx(0.0, abs=1e-9)
    lean = np.radians([10.0, 40.0])
    ahead, behind = counterbalance_nm(spring, zero + lean), counterbalance_nm(spring, zero - lean)
    np.testing.assert_allclose(ahead, -behind, rtol=1e-12)
    # A crank of 0.2 m at a right angle to a strut of sqrt(0.8^2 + 0.2^2) m
    right_angle = counterbalance_nm(spring, np.array([zero + np.pi / 2]))[0]
    strut = np.hypot(0.8, 0.2)
    area = np.pi / 4 * (0.055**2 - 0.030**2)
    pressure = 1.01 * 296.8 * 328 * 0.159 / (0.00096 - area * (strut - 0.6))
    assert right_angle == pytest.approx(pressure * area * 0.8 * 0.2 / strut, rel=1e-12)


def test_net_mechanical_energy_within_four_percent(comparisons):
    for comparison in comparisons.values():
        assert abs(comparison.energy_error_percent) < 4.0
        assert abs(comparison.positive_error_percent) < 4.0
    assert abs(kr300_energy_error_percent()) < 4.0


def test_energies_are_those_of_the_published_comparison(comparisons):
    """The source's figures gave -3.5 % and -2.6 % net, -3.1 % and -0.8 % positive."""
    assert comparisons["a"].energy_error_percent == pytest.approx(-3.5, abs=0.1)
    assert comparisons["b"].energy_error_percent == pytest.approx(-2.6, abs=0.1)
    assert comparisons["a"].positive_error_percent == pytest.approx(-3.1, abs=0.1)
    assert comparisons["b"].positive_error_percent == pytest.approx(-0.8, abs=0.1)


def test_every_joints_torque_is_explained(comparisons):
    assert comparisons["a"].r2.min() > 0.82
    assert comparisons["b"].r2.min() > 0.80


def test_each_part_of_the_model_is_needed(model):
    """Without payload, counterbalance or friction the torques are explained clearly worse."""
    recording = load_excerpt("a")
    q = recording.position_rad + np.radians(model.figures.runs.position_zero_deg)
    comparison = model.compare(recording)
    residual = comparison.modelled_nm - comparison.measured_nm

    def rms(values):
        return np.sqrt((values**2).mean(axis=0))

    without_spring = residual[:, 1] - counterbalance_nm(model.figures.counterbalance, q[:, 1])
    assert rms(without_spring) > 2 * rms(residual[:, 1])
    without_friction = residual - model.friction_nm(recording.velocity_rad_s)
    assert np.all(rms(without_friction) > 1.2 * rms(residual))


def test_excerpt_is_small_and_says_where_it_comes_from():
    assert excerpt_path().stat().st_size < 100_000
    metadata = pq.read_schema(excerpt_path()).metadata
    assert b"JonasWeigand/Robot_Identification" in metadata[b"source"]
    assert b"MIT" in metadata[b"license"]


def test_recording_of_a_model_run_compares_to_nothing_left(model):
    """A recording made of the model's own torques: no error, R2 of 1."""
    time = np.linspace(0.0, 1.0, 251)
    q = np.outer(np.sin(2 * time), np.full(6, 0.2))
    qd = np.outer(2 * np.cos(2 * time), np.full(6, 0.2))
    zero = np.radians(model.figures.runs.position_zero_deg)
    torque = model.torque_nm(q + zero, qd, np.gradient(qd, time, axis=0))
    comparison = model.compare(Recording(time, q, qd, torque / np.array(model.figures.gear_ratio)))
    assert comparison.energy_error_percent == pytest.approx(0.0, abs=1e-9)
    assert comparison.r2 == pytest.approx(np.ones(6))


def test_bad_recordings(tmp_path):
    path = tmp_path / "run.parquet"
    with pytest.raises(InputError, match="there is no such file"):
        load_recording(path)
    path.write_bytes(b"no parquet")
    with pytest.raises(InputError, match=r"run\.parquet: the file cannot be read"):
        load_recording(path)
    pq.write_table(pa.table({"time_ms": [0, 4], "run": ["a", "a"]}), path)
    with pytest.raises(InputError, match="q1_mdeg: this column is missing"):
        load_recording(path)
    with pytest.raises(InputError, match="there is no run 'c'"):
        load_recording(path, "c")
