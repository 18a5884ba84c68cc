import pytest

from reproduction.report import tables
from reproduction.report.labels import cell_label, column_label, key_label
from reproduction.report.results import Results, number
from tests.reproduction.report import toy


def test_table_6_1_has_robojoule_s_and_the_thesis_s_by_the_same_convention(toy_results: Results):
    saving, convention, gap = tables.table_6_1(toy_results)
    assert saving.head == ("method", "110 %", "200 %")
    rows = {row[0]: row[1:] for row in saving.rows}
    assert rows["predicted, three segments"] == ("30.00", "30.00")
    assert rows["thesis: predicted, trees of 4 segments"] == ("17.42", "32.04")  # Eq. 6.1, not the printed 47.17
    assert rows["thesis: KRC polynomial, trees of 6 segments"] == ("12.75", "")
    rows = {row[0]: row[1:] for row in convention.rows}
    assert rows["thesis: predicted, trees of 4 segments"] == ("17.42", "47.17")
    assert not gap.marked and all(len(row) == 3 for row in gap.rows)
    for table in (saving, convention):
        assert [row[0].startswith("thesis") for row in table.rows] == [
            i in table.marked for i in range(len(table.rows))
        ]


def test_subsets_of_trees_are_kept_apart(tmp_path, toy_results: Results):
    """Two subsets share the cycle times of 110 to 133 %; predicted profiles were tried on both."""
    (tmp_path / "reports/tables").mkdir(parents=True)
    rows = [
        {
            "subset": subset,
            "relaxation_percent": "110",
            "krc_segments": segments,
            "method": method,
            "saving_percent": saving,
            "saving_percent_published_convention": saving,
            "gap_to_optimum_percent": "1",
            "trees": 10,
        }
        for subset, method, segments, saving in (
            ("1-10", "krc_polynomial", 4, "1.5"),
            ("1-10", "predicted_three_segment", "", "2.5"),
            ("11-20", "krc_polynomial", 6, "3.5"),
            ("11-20", "predicted_three_segment", "", "4.5"),
        )
    ]
    toy.write_rows(tmp_path / "reports/tables/table_6_1_thesis.csv", rows)
    results = toy.results(tmp_path, toy_results.robot)
    saving = tables.table_6_1(results)[0]
    assert {("predicted, three segments, trees 1-10", "2.50"), ("KRC polynomial, 6 segments, trees 11-20", "3.50")} <= {
        row[:2] for row in saving.rows
    }
    table = tables.difference(results)
    assert table is not None
    rows_of = {row[0]: row for row in table.rows}
    assert (rows_of["110 %, 4 segments"][1], rows_of["110 %, 4 segments"][4]) == ("1.50", "2.50")
    assert (rows_of["110 %, 6 segments"][1], rows_of["110 %, 6 segments"][4]) == ("3.50", "4.50")


def test_table_5_1_has_every_target_error_and_model(toy_results: Results):
    table = tables.table_5_1(toy_results)
    assert table is not None and len(table.rows) == 3 * 2 * 3
    theirs = [row for place, row in enumerate(table.rows) if place in table.marked]
    assert theirs[0] == ("energy saving, absolute [J]", "thesis: random forest", "7.99", "17.38", "33.64", "132.72", "")
    assert theirs[1][2:] == ("4.50", "10.40", "20.70", "246.60", "18.50")
    assert theirs[2][2] == "0.014"  # seconds need three digits


def test_difference_is_robojoule_s_less_the_thesis_s(toy_results: Results):
    table = tables.difference(toy_results)
    assert table is not None
    row = dict(zip(table.head[1:], table.rows[0][1:], strict=True))
    assert row["KRC, robojoule"] == "10.00" and row["KRC, thesis"] == "13.37"
    assert table.rows[0][3] == "−3.37" and table.rows[0][6] == "12.58"
    assert table.rows[1][1] == ""  # 121 % was not among the cycle times


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("ec_d_min_j", "energy in it [J]"),
        ("d_min_s", "least cycle time d_min [s]"),
        ("saving_percent", "saving [%]"),
        ("steepness_j_per_s", "steepness [J/s]"),
        ("krc_polynomial_4_110_j", "KRC polynomial, 4 segments, 110 % [J]"),
        ("krc_110_j", "KRC polynomial, 110 % [J]"),
        ("abs_difference_p25", "absolute difference 25 % quantile"),
        ("trees", "trees"),
    ],
)
def test_column_labels_hold_the_unit(name: str, shown: str):
    assert column_label(name) == shown


@pytest.mark.parametrize(
    ("column", "text", "shown"),
    [
        ("held", "true", "yes"),
        ("method", "optimum", "proven optimum"),
        ("model", "robojoule_predicted_50", "robojoule, predicted, 50 known motions"),
        ("measure", "spearman", "Spearman's rank correlation"),
        ("target", "median error of energy_saving_j", "median error of energy saving"),
        ("target", "late_percent, mean", "late [%], mean"),
        ("robot", "kuka_kr16_r2010_2", "kuka_kr16_r2010_2"),
        ("tree_id", "experiment-01", "experiment-01"),
    ],
)
def test_keys_in_cells_are_words(column: str, text: str, shown: str):
    assert cell_label(column, text) == shown


def test_decimals_of_a_column_are_alike_where_its_values_are_of_one_size():
    rows = [{"mean": "0.5023"}, {"mean": "-0.0667"}, {"mean": "12.25"}]
    assert [row[0] for row in tables._plain(rows, "x", frozenset()).rows] == ["0.50", "\u22120.07", "12.25"]
    rows = [{"mean": "0.0023"}, {"mean": "1579.3"}]
    assert [row[0] for row in tables._plain(rows, "x", frozenset()).rows] == ["0.0023", "1579"]


def test_metrics_are_flattened():
    table = tables.metrics_table({"plans": {"optimum": {"110": {"saving_percent": 12.3456789}}}, "n": 3})
    assert table.rows == (("plans.optimum.110.saving_percent", "12.3457"), ("n", "3"))


def test_tables_that_no_stage_wrote_are_left_out(tmp_path, toy_results: Results):
    (tmp_path / "reports/tables").mkdir(parents=True)
    empty = toy.results(tmp_path, toy_results.robot)
    assert tables.table_6_1(empty) == [] and tables.table_5_1(empty) is None and tables.difference(empty) is None
    assert tables.plain(empty, "retrace", "x") is None


def test_published_rows_are_marked():
    table = tables.published_plain("table_6_3", "x")
    assert table.marked == frozenset(range(10)) and number(table.rows[0][3]) == 6388


def test_gaps_stand_with_their_interval_worst_tree_and_runs(toy_results: Results):
    table = tables.gap_table(toy_results.table("gaps"), "Trees")
    assert table.head == ("method", "runs a new motion", "110 %", "200 %", "trees above unoptimised [%]")
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["KRC polynomial, 4 segments"] == ("2", *["0.400 (0.300 to 0.600), 0.900"] * 2, "0")
    duels = tables.win_table(toy_results.table("wins"), "Trees")
    assert duels.head[1:] == tuple(row[0] for row in duels.rows)
    assert duels.rows[1][1:3] == ("4 : 2", "")  # two cycle times together


def test_study_tables_are_shown_where_there_is_a_study(tmp_path, toy_results: Results):
    captions = [table.caption for table in tables.study_tables(toy_results)]
    assert captions[0].startswith("(a) The same robot, new motions")
    assert sum(caption.startswith("What each step brings") for caption in captions) == 3
    assert tables.study_tables(toy.results(tmp_path, toy_results.robot)) == []


@pytest.mark.parametrize(
    ("key", "label"),
    [
        ("krc_polynomial_6", "KRC polynomial, 6 segments"),
        ("robojoule_predicted_50", "robojoule, predicted, 50 known motions"),
        ("robojoule_predicted", "robojoule, predicted"),
        ("five_runs", "polynomial through five runs, six chords"),
        ("something_new", "something new"),
    ],
)
def test_methods_of_tables_have_names_for_people(key, label):
    assert key_label(key) == label


def test_payloads_are_those_of_the_rows():
    rows = [{"payload_kg": one} for one in ("16.0", "all", "0.0", "10.0", "16.0")]
    assert tables._payloads(rows) == "0, 10 and 16 kg"
    assert tables._payloads(rows[:2]) == "16 kg"
