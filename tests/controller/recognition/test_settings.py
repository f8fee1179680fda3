"""Settings in a bundle: what a key that is missing means, and the values that a file may give."""

from dataclasses import fields

import pytest

from controller.recognition.debounce import DebounceSettings
from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.touch_input import TouchInput
from controller.recognition.user_id import Users
from controller.shared import config

KINDS = {"debounce": DebounceSettings, "image": PreprocessSettings, "touch": TouchInput,
         "users": Users}  # fmt: skip
SETTINGS = """
debounce.smoothing  0.4   0.01  1
debounce.on         0.8   0     2
debounce.off        0.35  0     1
debounce.wait_s     0     0     10
debounce.late       1     0     1
debounce.least      2     0     2
debounce.brief_s    0     0     10
debounce.noise      0     0     10
debounce.patience_s 0     0     10
image.scale         1     1e-9  1e9
image.rate_hz       10    0.1   1000
image.window        10    1     250
image.start_s       1     0     100
touch.crop          0     0     30
touch.level         0     0     1
users.temperature   1     0.01  100
users.accept        0.9   0     1
users.stay          0.98  0     1
users.forget_s      30    0.1   1e6
"""


@pytest.mark.parametrize("line", SETTINGS.strip().splitlines(), ids=lambda line: line.split()[0])
def test_a_setting_has_a_usual_value_and_a_range_with_both_of_its_ends(line: str) -> None:
    place, usual, least, most = line.split()
    kind, _, key = place.partition(".")
    field = next(one for one in fields(KINDS[kind]) if one.name == key)
    number = int if isinstance(field.default, int) else float
    assert field.default == float(usual)
    for end, beyond in ((float(least), -1), (float(most), 1)):
        assert getattr(config.settings(KINDS[kind], {key: number(end)}), key) == end
        outside = number(end + beyond * max(1e-10, abs(end) / 1000 if number is float else 1))
        with pytest.raises(config.ConfigError, match=f"has {key} = "):
            config.settings(KINDS[kind], {key: outside})


def test_a_bundle_that_does_not_say_how_rest_is_followed_has_the_usual_way() -> None:
    usual = PreprocessSettings()
    assert (usual.follow_s, usual.settle_s, usual.adopt_s) == (2.0, 0.4, 30.0)
    assert (usual.gate, usual.gate_noise) == (0.015, 1.2)
