import pytest

from evslip.config.loading import load_config
from evslip.config.sample import leaves
from evslip.config.units import tell, unit_of


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("width_m", 0.0538, "53.8 mm"),
        ("distance_m", 23.8, "23.8 m"),
        ("mass_kg", 0.0084, "8.4 g"),
        ("x_m", 0, "0 m"),
        ("density_kg_m3", 7850.0, "7,850 kg/m3"),
        ("luminance_cd_m2", 4.5e6, "4.5e6 cd/m2"),
        ("tilt_deg", -25.0, "-25 deg"),
        ("speed_m_s", 1.5, "1.5 m/s"),
        ("turn_deg_s", 20.0, "20 deg/s"),
        ("offset", 0.52, "0.52"),
        ("texture", "wood-0", "wood-0"),
    ],
)
def test_values_are_told_with_their_units(name, value, text):
    assert tell(name, value) == text


def test_every_key_that_ends_in_a_unit_is_known():
    names = {key.rpartition(".")[2] for key in leaves(load_config("simple"))}
    ends = {name.rpartition("_")[2] for name in names if len(name.rpartition("_")[2]) <= 3 and "_" in name}
    without = {name for name in names if name.rpartition("_")[2] in ends and not unit_of(name)}
    assert without <= {"mesh_fit"}
