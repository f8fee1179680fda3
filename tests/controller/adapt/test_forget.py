"""A forgotten gesture leaves nothing behind; one that is taught again replaces its old examples."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import tomli_w

from controller import adapt
from controller.adapt import AdaptedBundle, AdaptError, Example, lessons, process
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import gestures_of
from controller.recognition.mapping import Rule
from tests.controller.adapt.test_correction import SHIPPED, images
from tests.support import user_bundles

DATA = SHIPPED.read_bytes()


def examples(label: str, *touches: tuple[int, int]) -> list[Example]:
    return [Example(label, images(*touches) + np.float32(0.001 * k)) for k in range(2)]


def file_of(made: AdaptedBundle) -> bytes:
    return bundles.assembled(made.manifest, made.parts)


@cache
def taught() -> bytes:
    """Two lessons: a long touch, then two short ones."""
    first = adapt.teach(DATA, examples("swipe", (10, 16)), command="hold")
    return file_of(adapt.teach(file_of(first), examples("tap", (10, 12), (14, 16))))


def relearn(data: bytes, shown: list[Example], command: str = "") -> AdaptedBundle:
    """Teach in place of earlier examples."""
    return adapt.teach(data, shown, command=command, again=True)


def answers(data: bytes) -> tuple[Bundle, np.ndarray]:
    bundle = bundles.parse(data)
    return bundle, gestures_of(bundle)(bundle.golden.windows)


def test_what_is_forgotten_might_never_have_been_taught() -> None:
    without = file_of(adapt.forget(taught(), "swipe"))
    never = file_of(adapt.teach(DATA, examples("tap", (10, 12), (14, 16))))
    assert without == never


def test_when_the_last_one_is_forgotten_the_bundle_is_as_it_was_trained() -> None:
    data = taught()
    for label in ("tap", "swipe"):
        data = file_of(adapt.forget(data, label))
    (bundle, one), (shipped, other) = answers(data), answers(DATA)
    np.testing.assert_array_equal(one, other)
    assert bundle.settings == shipped.settings
    assert bundle.mapping == shipped.mapping
    assert bundle.card == shipped.card
    assert container.TAUGHT not in container.unpack(data)


def test_thresholds_that_were_chosen_after_a_lesson_stay() -> None:
    parts = container.unpack(taught())
    manifest = container.manifest(parts[container.MANIFEST])
    manifest["debounce"]["on"] = 0.875
    text = tomli_w.dumps(manifest).encode()
    data = bundles.assembled(text, container.content(parts))
    assert bundles.parse(file_of(adapt.forget(data, "tap"))).debounce.on == 0.875


def test_a_gesture_that_is_taught_again_forgets_its_old_examples() -> None:
    again = relearn(taught(), examples("swipe", (10, 20)), "pause")
    known = lessons.read(file_of(again))
    bundle = bundles.parse(file_of(again))
    assert [one.label for one in known.examples] == ["tap", "tap", "swipe", "swipe"]
    assert bundle.labels[-2:] == ("tap", "swipe")
    assert bundle.mapping.rules["swipe"] == (Rule("pause"),)
    assert bundle.card["added"] == ["tap from 2 examples", "swipe from 2 examples"]


def test_a_gesture_of_the_training_keeps_its_command_when_it_is_taught_again() -> None:
    data = file_of(process.set_command(DATA, "pinch", "hold"))
    for _ in range(2):
        data = file_of(relearn(data, examples("pinch", (10, 16)), "pause"))
    assert bundles.parse(data).mapping.command("pinch", None) == "hold"
    assert len(lessons.read(data).examples) == 2


def test_a_new_gesture_is_learned_beside_the_others() -> None:
    data = file_of(relearn(DATA, examples("swipe", (10, 16)), "hold"))
    assert lessons.read(data).taught == ("swipe",)
    assert bundles.parse(data).mapping.command("swipe", None) == "hold"


def test_progress_rises_to_the_end() -> None:
    shares: list[float] = []
    adapt.teach(DATA, examples("swipe", (10, 16)), progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_a_command_is_changed_and_nothing_else() -> None:
    made = process.set_command(DATA, "pinch", "hold")
    bundle, before = bundles.parse(file_of(made)), bundles.parse(DATA)
    assert bundle.mapping.rules == {**before.mapping.rules, "pinch": (Rule("hold"),)}
    assert bundle.settings == before.settings
    silent = bundles.parse(file_of(process.set_command(DATA, "pinch", "")))
    assert silent.mapping.command("pinch", None) is None


def test_two_changes_in_a_row_are_never_the_same_file() -> None:
    manifest = container.unpack(DATA)[container.MANIFEST]
    twice = process.counted(process.counted(manifest))
    assert container.manifest(twice)["card"]["changes"] == 2


@pytest.mark.parametrize("label", ["press", "null", "jump"])
def test_only_what_was_taught_can_be_forgotten(label: str) -> None:
    with pytest.raises(AdaptError, match="no gesture that was taught"):
        adapt.forget(taught(), label)


def test_a_users_command_is_changed_for_that_user_only_and_taken_back() -> None:
    data = bundles.assembled(user_bundles.manifest(), user_bundles.parts())
    made = file_of(process.set_command(data, "twist_cw", "drop", "bob"))
    before, after = bundles.parse(data), bundles.parse(made)
    assert after.mapping == before.mapping
    own = {"pinch": (Rule("hold"),), "twist_cw": (Rule("drop"),)}
    assert {name: mapping.rules for name, mapping in after.users.mappings.items()} == {"bob": own}
    first = bundles.parse(file_of(process.set_command(made, "press", "", "ann")))
    assert first.users.mapping("ann", first.mapping).command("press", None) is None
    back = bundles.parse(file_of(process.set_command(made, "", "", "bob")))
    assert back.users.mappings == {}
    with pytest.raises(AdaptError, match="no user 'cleo'"):
        process.set_command(data, "press", "drop", "cleo")


def test_the_touch_strength_of_all_or_of_one_user_is_set_and_taken_back() -> None:
    data = bundles.assembled(user_bundles.manifest(), user_bundles.parts())
    made = file_of(process.set_strength(file_of(process.set_strength(data, 2.0)), 0.4, "ann"))
    after = bundles.parse(made)
    assert [after.strength_of(name) for name in ("", "ann", "bob")] == [2.0, 0.4, 2.0]
    assert after.mapping == bundles.parse(data).mapping
    taught = bundles.parse(file_of(adapt.teach(made, examples("swipe", (10, 16)))))
    assert [taught.strength_of(name) for name in ("", "ann", "bob")] == [2.0, 0.4, 2.0]
    back = bundles.parse(file_of(process.set_strength(made, 0.0, "ann")))
    assert [back.strength_of(name) for name in ("", "ann")] == [2.0, 2.0]
    assert bundles.parse(file_of(process.set_strength(made, 0.0))).strength == 1.0
    with pytest.raises(AdaptError, match="no user 'cleo'"):
        process.set_strength(data, 0.4, "cleo")


def test_a_users_commands_stay_when_a_gesture_is_learned_anew_and_forgotten() -> None:
    pinch = [replace(one, user="bob") for one in examples("pinch", (9, 15))]
    data = file_of(relearn(file_of(adapt.teach(DATA, pinch)), examples("swipe", (10, 16))))
    for label in ("swipe", "pinch"):
        data = file_of(process.set_command(data, label, "hold", "bob"))
    data = file_of(relearn(data, examples("swipe", (10, 14))))
    assert set(bundles.parse(data).users.mappings["bob"].rules) == {"swipe", "pinch"}
    forgot = bundles.parse(file_of(adapt.forget(data, "swipe")))
    assert forgot.users.mappings["bob"].rules == {"pinch": (Rule("hold"),)}
