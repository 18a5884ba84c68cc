import errno
import hashlib
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from reproduction.config import load_params
from reproduction.layout import Layout
from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.robots import load_robot
from stages.generate_trees import generate_trees

PARAMS = Path(__file__).parents[2] / "params.yaml"


def params(**changes):
    loaded = load_params(PARAMS)
    small = {"trees": 12, "experiment_trees": 6, "test_fraction": 0.25, "budget_rad": (0.8, 4.0), **changes}
    return loaded.model_copy(update={"generate_trees": loaded.generate_trees.model_copy(update=small)})


def digests(root: Path) -> dict[str, str]:
    files = sorted(path for path in root.rglob("*") if path.is_file())
    return {str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    root = tmp_path_factory.mktemp("trees")
    generate_trees(params(), Layout(root))
    return Layout(root)


def test_files_and_columns(written):
    assert sorted(path.name for path in written.trees_dir.iterdir()) == [f"experiment-0{n}.yaml" for n in range(1, 7)]
    table = pq.read_table(written.trees)
    joints = [f"q{joint}_rad" for joint in range(1, 7)]
    assert table.column_names == ["tree_id", "split", "complexity", "budget_rad", "point", *joints]
    assert [str(t) for t in table.schema.types] == ["string"] * 3 + ["double", "int32"] + ["double"] * 6
    assert table.num_rows == (12 + 6) * 11
    assert sum(column.null_count for column in table.columns) == 0


def test_older_trees_go_when_the_new_ones_are_there(tmp_path, monkeypatch):
    layout = Layout(tmp_path)
    layout.trees_dir.mkdir(parents=True)
    old = [layout.trees_dir / f"experiment-{number}.yaml" for number in ("01", "77")]
    for path in old:
        path.write_text("of an older run", encoding="utf-8")
    full = {"text": 3}  # a disk that is full at the third one

    def write(path, content):
        full["text"] -= 1
        if not full["text"]:
            raise OSError(errno.ENOSPC, "No space left on device")
        return whole(path, content)

    whole = Path.write_bytes
    with monkeypatch.context() as disk:
        disk.setattr(Path, "write_bytes", write)
        with pytest.raises(InputError, match="No space left"):
            generate_trees(params(), layout)
    assert sorted(layout.trees_dir.iterdir()) == old
    assert {path.read_text(encoding="utf-8") for path in old} == {"of an older run"}
    generate_trees(params(), layout)
    assert not old[1].exists() and len(list(layout.trees_dir.iterdir())) == 6


def test_trees_of_each_split(written):
    frame = pq.read_table(written.trees).to_pandas()
    trees = frame.groupby("tree_id")
    assert trees.split.nunique().max() == 1
    assert trees.split.first().value_counts().to_dict() == {"train": 9, "test": 3, "experiment": 6}
    assert all(tree_id.startswith(split) for tree_id, split in trees.split.first().items())
    assert all(points.tolist() == list(range(11)) for _, points in trees.point)


def test_budgets_are_graded_evenly(written):
    frame = pq.read_table(written.trees).to_pandas()
    first = frame.drop_duplicates("tree_id")
    learning = first[first.split != "experiment"].budget_rad
    np.testing.assert_allclose(np.sort(learning), np.linspace(0.8, 4.0, 12))
    np.testing.assert_allclose(first[first.split == "experiment"].budget_rad, np.linspace(0.8, 4.0, 6))


def test_complexity_follows_joint_travel(written):
    frame = pq.read_table(written.trees).to_pandas()
    joints = [f"q{joint}_rad" for joint in range(1, 7)]
    for _, group in frame.assign(group=frame.split == "experiment").groupby("group"):
        travel = {t: np.abs(np.diff(rows[joints], axis=0)).sum() for t, rows in group.groupby("tree_id")}
        complexity = group.groupby("tree_id").complexity.first()
        by_class = {name: [travel[t] for t in complexity.index[complexity == name]] for name in complexity.unique()}
        assert max(by_class["simple"]) <= min(by_class["medium"])
        assert max(by_class["medium"]) <= min(by_class["complex"])
        assert len({len(values) for values in by_class.values()}) == 1


def test_experiment_files_hold_the_same_trees(written):
    robot = load_robot("kuka_kr16_r2010_2")
    frame = pq.read_table(written.trees).to_pandas()
    joints = [f"q{joint}_rad" for joint in range(1, 7)]
    for path in written.trees_dir.iterdir():
        program = load_program(path)
        program.check(robot)
        assert program.name == path.stem
        np.testing.assert_array_equal(program.tree.configurations_rad(), frame[frame.tree_id == path.stem][joints])


def test_no_tree_stands_in_two_splits(written):
    frame = pq.read_table(written.trees).to_pandas()
    points = frame[frame.point.between(1, 5)]
    assert not points.duplicated([f"q{joint}_rad" for joint in range(1, 7)]).any()


def test_same_seed_same_bytes_and_old_files_go(written, tmp_path):
    (tmp_path / "data" / "trees").mkdir(parents=True)
    (tmp_path / "data" / "trees" / "experiment-07.yaml").write_text("old")
    generate_trees(params(), Layout(tmp_path))
    assert digests(tmp_path) == digests(written.root)


def test_other_seed_other_trees(written, tmp_path):
    generate_trees(params(seed=1), Layout(tmp_path))
    assert digests(tmp_path)["data/trees.parquet"] != digests(written.root)["data/trees.parquet"]


def test_progress_is_printed(tmp_path, capsys):
    generate_trees(params(trees=3, experiment_trees=3), Layout(tmp_path))
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith("generate_trees: 6 of 6 trees")


def test_failure_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("reproduction.trees.generate.MOST_DRAWS", 1)
    with pytest.raises(InputError, match=r"generate_trees\.budget_rad: no collision-free point"):
        generate_trees(params(budget_rad=(50.0, 60.0)), Layout(tmp_path))
    assert not list(tmp_path.rglob("*"))
