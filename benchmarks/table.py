"""The table of docs/performance.md from benchmarks/results.json. `python -m benchmarks.table` writes it anew."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robojoule.documents import read_document, write_text

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "benchmarks" / "results.json"
PAGE = ROOT / "docs" / "performance.md"
BEGIN, END = "<!-- measured: begin -->\n", "<!-- measured: end -->\n"

# Section, figure, what it is, target, and the absolute figures beside it.
ROWS: tuple[tuple[str, str, str, str, str], ...] = (
    (
        "simulation",
        "speedup_over_plain",
        "plain way over robojoule, energies of a motion at 10 speed limits",
        "at least 100",
        "{robojoule_ms_per_motion} ms against {plain_ms_per_motion} ms per motion, one core",
    ),
    (
        "simulation",
        "ratio_to_floor",
        "robojoule over the floor",
        "at most 3",
        "{floor_nodes} path nodes: {rnea_in_parallel_ms_per_motion} ms per motion by `rneaInParallel`, "
        "{recursion_ms_per_motion} ms by robojoule's recursion; Ruckig {ruckig_joints_ms_per_motion} ms",
    ),
    (
        "simulation",
        "ratio_to_least_floor",
        "robojoule over the floor with Ruckig on one axis only",
        "",
        "Ruckig {ruckig_path_ms_per_motion} ms per motion",
    ),
    (
        "simulation",
        "pinocchio_and_ruckig_over_own",
        "Pinocchio and Ruckig over robojoule's own engines, the same energies",
        "",
        "{pinocchio_and_ruckig_ms_per_motion} ms per motion",
    ),
    (
        "simulation",
        "cost_of_91_over_10_speed_limits",
        "91 speed limits over 10",
        "at most 10",
        "{robojoule_91_ms_per_motion} ms per motion",
    ),
    (
        "simulation",
        "max_energy_deviation",
        "largest deviation of an energy from samples at 4 kHz",
        "at most 0.001",
        "plain way: {max_plain_energy_deviation}; durations: {max_duration_deviation_s} s (target: 1e-9)",
    ),
    (
        "series",
        "ratio_to_bare_writer",
        "simulation and time series to Parquet over bare writing of the same rows",
        "",
        "{motions_per_s_on_two_cores} motions per second on two cores (target: 300), "
        "bare writer {bare_writer_motions_per_s_on_one_core} on one",
    ),
    (
        "series",
        "memory_of_8_shards_over_1",
        "peak memory of a worker, 8 shards over 1",
        "flat",
        "{peak_mib_of_a_worker} MiB",
    ),
    (
        "scale",
        "two_workers_over_one",
        "rate of two worker processes over one",
        "at least 1.8",
        "{motions_per_s_two_workers} motions per second with two",
    ),
    (
        "scale",
        "memory_last_over_the_one_before",
        "peak memory, largest set over a tenth of it",
        "flat",
        "{peak_mib} MiB in all processes (target: 2048); {ms_a_further_motion} ms for each further motion",
    ),
    (
        "planning",
        "rebuilt_over_sweep",
        "100 cycle times with models built anew over one model solved again",
        "",
        "model and solution {build_and_solve_ms} ms (target: 30), 100 cycle times {sweep_of_100_s} s (target: 1), "
        "500 motions {tree_of_500_s} s (target: 2)",
    ),
    (
        "commands",
        "profile_over_imports",
        "`robojoule profile` over bare imports of the packages that it loads",
        "at most 3",
        "{profile_s} s (target: 1.5) against {imports_s} s; `robojoule --help` {help_s} s (target: 0.3)",
    ),
    (
        "commands",
        "noop_make_over_dvc_repro",
        "`make repro` over `dvc repro`, nothing to do",
        "at most 1.3",
        "{noop_make_repro_s} s",
    ),
    (
        "starts",
        "flow_over_server",
        "`make flow`, nothing to do, over the start of Prefect's server",
        "at most 1.5",
        "{flow_s} s against {server_s} s at a load of {load}",
    ),
    (
        "starts",
        "scale_over_server",
        "`flows.scale` for 20 motions over the start of Prefect's server",
        "",
        "{scale_s} s against {server_s} s at a load of {load}",
    ),
    (
        "pipeline",
        "pipeline_over_bare_work",
        "`dvc repro -f` over bare writing and bare fits",
        "at most 2.5",
        "{pipeline_s} s (target: 90) against {bare_work_s} s; {peak_mib} MiB (target: 2048)",
    ),
)


def markdown(results: dict[str, Any]) -> str:
    """Machine, ratios with their targets, and the curve over the number of motions."""
    machine = results["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in results["versions"].items())
    lines = [
        f"On {machine['processor']}, {machine['cores']} cores, Python {machine['python']}; {versions}.",
        "",
        "| ratio | of | target | absolute |",
        "|---|---|---|---|",
    ]
    for section, figure, text, target, absolute in ROWS:
        found = {name: f"{x:.4g}" for name, x in results.get(section, {}).items() if not isinstance(x, list)}
        if figure in found:
            lines.append(f"| {found[figure]} | {text} | {target} | {absolute.format(**found)} |")
    lines += ["", "| motions | runs | time [s] | peak memory [MiB] |", "|---|---|---|---|"]
    for row in results["scale"]["curve"]:
        motions = int(row["motions"])
        lines.append(f"| {motions} | {10 * motions} | {row['seconds']:.1f} | {row['peak_mib']:.0f} |")
    return "\n".join(lines) + "\n"


def update() -> None:
    """Write the table into the page."""
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    write_text(PAGE, before + BEGIN + markdown(read_document(RESULTS)) + END + rest.split(END)[1])


if __name__ == "__main__":
    update()
