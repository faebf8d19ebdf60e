"""The benchmark of hard grains counts events, and its gas rises as that of `drive_power` does in LIGGGHTS."""

import json

import numpy as np
import pytest

from benchmarks import hard_grains
from dembark.input_decks.drive_power.drive import sticking_block


def test_speed_is_printed_for_three_sizes(capsys):
    assert hard_grains.main(["speed", "--events", "2e4"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["1000", "4096", "10648"]
    assert all(float(line.split()[2]) > 0.0 for line in lines)


def test_a_gas_rises_as_in_a_soft_engine():
    """LIGGGHTS: 3.62 d, with an interval of 0.06 d; single packings of hard grains scatter by 0.09 d."""
    values = [hard_grains.shaken(16.0, seed)[0] - hard_grains.REST for seed in range(6)]
    assert np.mean(values) == pytest.approx(3.62, abs=0.15)
    # Negative control: nearly smooth grains.
    assert hard_grains.shaken(16.0, 0, beta=-0.6)[0] - hard_grains.REST > 4.0


def test_the_interval_is_printed(capsys):
    assert hard_grains.main(["plate", "--packings", "2", "--gamma", "12"]) == 0
    assert capsys.readouterr().out.startswith("rise ")


def test_the_map_compares_with_the_results_of_a_campaign(tmp_path, capsys):
    """Results of a soft engine that is 1.1 times as high and 0.9 times as strong as hard grains, with another spectrum."""
    factors = (1.1, 0.9, 0.8, 1.2, 1.3)
    values = np.mean([hard_grains.shaken(16.0, seed, count=16) for seed in range(4)], axis=0) * factors
    quantities = [{"name": name, "value": value, "interval": [0.99 * value, 1.01 * value]}
                  for name, value in zip(hard_grains.QUANTITIES, values, strict=True)]
    parameters = {"motion_gamma": 16.0, "grain_count": 16, "restitution": 0.9, "youngs_modulus": 4e7,
                  "cell_width": 0.02, "cell_depth": 0.02}
    folder = tmp_path / "drive_power" / "gas" / "lammps"
    folder.mkdir(parents=True)
    (folder / "metrics.json").write_text(json.dumps({"parameters": parameters, "quantities": quantities}))
    assert hard_grains.main(["map", "--campaign", str(tmp_path), "--packings", "4"]) == 0
    words = capsys.readouterr().out.splitlines()[1].split()
    assert words[:3] == ["16", "0.9", "16"]
    assert [float(word) for word in words[4::3]] == pytest.approx(factors, abs=1e-3)
    assert 0.01 <= float(words[6]) < 0.5


LAYER = {"grain_diameter": 0.005, "grain_diameter_spread": 0.1, "grain_density": 2500.0, "gravity": 9.81,
         "layer_length": 0.05, "layer_depth": 0.02, "layer_height": 2.0, "motion_frequency": 10.0, "motion_gamma": 3.0, "motion_ramp": 2.0,
         "run_in": 1, "periods": 8, "restitution": 0.5, "grain_friction": 0.5, "wall_friction": 0.5, "youngs_modulus": 2e7}


def test_a_layer_of_one_grain_bounces_on_the_plate_as_a_block_that_sticks():
    """At 2 g a grain that loses nearly all leaves and lands once a period: 0.584 M g V."""
    single = LAYER | {"layer_height": 0.05, "layer_length": 0.02, "motion_gamma": 2.0, "restitution": 0.01}
    height, power, *_ = hard_grains.layered(single, 0, beta=0.0, contact_duration=1e-5)
    assert power == pytest.approx(sticking_block(2.0).power, rel=0.01) and height > 0.5


def test_layers_are_compared_with_the_results_of_a_campaign(tmp_path, capsys):
    """Results of a soft engine that is 1.1 times as high and 0.9 times as strong as hard grains, without waves."""
    hard = np.array([hard_grains.layered(LAYER, seed, beta=0.0, contact_duration=1e-4) for seed in range(2)])
    values = hard.mean(axis=0) * (1.1, 0.9, 1.0, 0.0, 1.0)
    quantities = [{"name": name, "value": value, "interval": None if name == "wave_amplitude" else [0.99 * value, 1.01 * value]}
                  for name, value in zip(hard_grains.LAYER_QUANTITIES, values, strict=True)]
    folder = tmp_path / "vibrated_layer" / "waves" / "liggghts"
    folder.mkdir(parents=True)
    (folder / "metrics.json").write_text(json.dumps({"parameters": LAYER, "quantities": quantities}))
    assert hard_grains.main(["layer", "--campaign", str(tmp_path), "--packings", "2", "--contact-duration", "1e-4"]) == 0
    words = capsys.readouterr().out.splitlines()[1].split()
    assert words[:4] == ["2", "0.5", "3", "2.0e+07"]
    assert [float(words[4]), float(words[7])] == pytest.approx([1.1, 0.9], abs=1e-3)
    assert float(words[10]) == pytest.approx(float(words[13]), abs=1e-3) and words[16:19] == ["0.000", "±", "nan"]
