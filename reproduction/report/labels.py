"""Names for people: methods, features, targets, energy parts."""

from __future__ import annotations

import re

METHODS = {
    "unoptimized": "unoptimised",
    "uniform": "uniform speed limit",
    "greedy": "greedy by steepness",
    "krc_polynomial": "KRC polynomial",
    "predicted_three_segment": "predicted, three segments",
    "robojoule_predicted": "robojoule, predicted",
    "robojoule_simulated": "robojoule, simulated",
    "optimum": "proven optimum",
}

# Said beside the figures of the pipeline's plans, whose robot is the entry itself.
KNOWN_PLANT = (
    f"In this pipeline the robot is its catalog entry, so {METHODS['robojoule_predicted']}, knows it; only the studies "
    "test what a predictor cannot know."
)
STUDIED = f"{METHODS['robojoule_predicted']}, a robot that differs from its entry (study)"

# What only the studies compare.
CASES = {
    "robojoule_predicted_cautious": "robojoule, predicted, cautious",
    "nominal_physics": "nominal physics",
    "oracle": "oracle without a thermometer",
    "five_runs": "polynomial through five runs, six chords",
    "three_segments": "three segments",
    "dense": "as many pieces as it takes",
    "constant": "constant, that at HOME",
    "slope": "slope of the three segments",
    "configuration": "by configuration",
    "mean": "mean of the training motions",
    "random_forest": "random forest (thesis)",
}

TARGETS = {
    "energy_saving_j": ("energy saving", "J"),
    "optimal_duration_s": ("optimal duration", "s"),
    "energy_penalty_j": ("energy penalty at the lowest speed limit", "J"),
}

MODELS = {
    "random_forest": "random forest",
    "neural_network": "neural network",
    "robojoule_predicted": "physics-informed",
}

_SHORT = {
    "optimal_speed_limit_percent": "optimal speed limit",
    "optimal_duration_s": "optimal duration",
    "energy_saving_j": "energy saving",
    "energy_penalty_j": "energy penalty",
    "duration_slowest_s": "duration slowest",
    "duration_fastest_s": "duration fastest",
    "duration_penalty_s": "duration penalty",
    "steepness_j_per_s": "steepness",
    "theta_sum_rad": "theta sum",
    "rotation_angle_rad": "rotation angle",
    "euclidean_distance_m": "Euclidean distance",
    "vertical_distance_m": "vertical distance",
    "horizontal_distance_m": "horizontal distance",
}


def method_label(method: str, krc_segments: str | int | float | None = None) -> str:
    """Name of a method, with its number of linear segments where it has one."""
    label = METHODS.get(method, method.replace("_", " "))
    return f"{label}, {int(float(krc_segments))} segments" if krc_segments not in (None, "") else label


def key_label(key: str) -> str:
    """Name of a method, or of a case of a study, by its key in tables: `krc_polynomial_6`, `robojoule_predicted_50`."""
    counted = re.fullmatch(r"(krc_polynomial|robojoule_predicted)_(\d+)", key)
    if not counted:
        return METHODS.get(key) or CASES.get(key, key.replace("_", " "))
    if counted[1] == "krc_polynomial":
        return method_label(counted[1], counted[2])
    return f"{METHODS[counted[1]]}, {counted[2]} known motions"


_UNITS = {"_percent": "%", "_j_per_s": "J/s", "_kg": "kg", "_rad": "rad", "_w": "W", "_j": "J", "_s": "s", "_m": "m"}
_COLUMNS = {
    "d_min_s": "least cycle time d_min [s]",
    "ec_d_min_j": "energy in it [J]",
    "relaxation_percent": "cycle time [% of the least]",
    "above_unoptimized_percent": "trees above unoptimised [%]",
}
_PUBLISHED = {"wait": "unoptimised", "krc": "KRC polynomial", "pred": "predicted, three segments"}
_WORDS = {
    "abs": "absolute",
    "rel": "relative error",
    "p25": "25 % quantile",
    "p50": "median",
    "p75": "75 % quantile",
    "min": "least",
    "max": "largest",
    "krc": "KRC",
    "pearson": "Pearson's r",
    "spearman": "Spearman's rank correlation",
    "kendall": "Kendall's rank correlation",
    "unoptimized": "unoptimised",
}


def column_label(name: str) -> str:
    """Name of a column for people: words, and its unit in brackets."""
    if name in _COLUMNS:
        return _COLUMNS[name]
    if at := re.fullmatch(r"(\w+)_(\d{3})_j", name):  # energies of a method at a cycle time
        return f"{_PUBLISHED.get(at[1]) or key_label(at[1])}, {at[2]} % [J]"
    for suffix, unit in _UNITS.items():
        if name.endswith(suffix):
            return f"{_words(name.removesuffix(suffix))} [{unit}]"
    return _words(name)


def _words(name: str) -> str:
    return " ".join(_WORDS.get(word, word) for word in name.split("_"))


def cell_label(column: str, text: str) -> str:
    """What a cell of a column says, for people: keys of methods, models, features and columns in words."""
    if text in ("true", "false"):
        return "yes" if text == "true" else "no"
    if column == "robot":
        return text
    if column in ("method", "model", "other", "case"):
        return _key_label(text)
    return re.sub(r"\b[a-z]\w*_\w+", lambda key: _key_label(key[0]), _WORDS.get(text, text))


def _key_label(key: str) -> str:
    for names in (MODELS, _SHORT):
        if key in names:
            return names[key]
    label = key_label(key)
    return column_label(key) if label == key.replace("_", " ") else label


def feature_label(feature: str) -> str:
    """Short name of a feature's column."""
    if feature in _SHORT:
        return _SHORT[feature]
    joint = re.fullmatch(r"(j\d+)_(.*?)_difference_rad\w*", feature)
    if not joint:
        return feature.replace("_", " ")
    return f"{joint[1]} {joint[2].replace('_', ' ')}"
