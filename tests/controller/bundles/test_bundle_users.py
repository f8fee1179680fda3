"""Bundles with people in them: whole or refused, and proved before they are used."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from controller.bundles import bundle, container
from controller.bundles.container import BundleError
from controller.bundles.inference.networks import Recognizer
from controller.recognition.mapping import Rule
from controller.recognition.user_id import NO_USERS
from tests.support import user_bundles as enrolled


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return enrolled.write(tmp_path_factory.mktemp("people") / "two.orb")


def test_a_bundle_says_whom_it_knows_and_what_their_gestures_mean(path: Path) -> None:
    read = bundle.read(path)
    assert (read.users.names, list(read.taught), read.identifies) == (("ann", "bob"), ["ann"], True)
    assert read.users.mapping("bob", read.mapping).rules["pinch"] == (Rule("hold"),)
    assert read.users.mapping("ann", read.mapping) == read.mapping


def test_a_bundle_without_people_has_no_word_about_them() -> None:
    shipped = bundle.read(enrolled.SHIPPED)
    assert (shipped.users, shipped.identifies, shipped.taught) == (NO_USERS, False, {})
    assert Recognizer(shipped).people(shipped.golden.windows[0]) is None


def test_the_user_network_and_rows_of_a_user_are_asked(path: Path) -> None:
    read = bundle.read(path)
    recognizer = Recognizer(read)
    window = np.ones((10, 5, 5), dtype=np.float32)
    window[:, :, 4] = 0.8
    who = recognizer.people(window)
    assert who is not None
    assert who.argmax() == 2  # bob touches on the right
    assert recognizer.probabilities(window, "ann").argmax() == 2  # whatever ann does is a pinch
    assert recognizer.probabilities(window, "bob") == pytest.approx(
        recognizer.probabilities(window)
    )


def test_networks_that_answer_differently_or_are_of_another_shape_are_refused(path: Path) -> None:
    read = bundle.read(path)
    people = dataclasses.replace(read.golden, people=read.golden.people + np.float32(2e-4))
    for changes, complaint in (
        ({"golden": people}, "user network answers differently"),
        ({"user_onnx": read.embedding_onnx}, r"user network makes \(96,\) of \(10, 5, 5\)"),
    ):
        changed = dataclasses.replace(read, **changes)
        with pytest.raises(BundleError, match=complaint):
            Recognizer(changed)


def test_people_who_cannot_be_told_by_their_touch_may_still_have_a_bundle(tmp_path: Path) -> None:
    parts = enrolled.parts()
    del parts[container.USER]
    with pytest.raises(BundleError, match=r"has golden vectors .*, people, not"):
        bundle.write(tmp_path / "x.orb", manifest=enrolled.manifest(), parts=parts)
    parts[container.GOLDEN] = bundle.read(enrolled.SHIPPED).golden.pack()
    bundle.write(tmp_path / "x.orb", manifest=enrolled.manifest(), parts=parts)
    read = bundle.read(tmp_path / "x.orb")
    assert (read.users.names, read.identifies) == (("ann", "bob"), False)
    assert Recognizer(read).people(read.golden.windows[0]) is None


@pytest.mark.parametrize(
    ("line", "instead", "complaint"),
    [
        ("names", "names = []", "1 to 32 different names of letters"),
        ("names", 'names = ["ann", "../bob"]', "1 to 32 different names of letters"),
        ("names", 'names = ["ann", "Ann"]', "two of them alike"),
        ("names", "names = 2", "1 to 32 different names of letters"),
        ("names", 'names = ["ann", "eve"]', "'bob' is not among the names"),
        ("names", 'names = ["bob"]', "has rows of 'ann' in its head"),
        ("gestures", 'gestures = ["press", "wave"]', "'wave' among the gestures"),
        ("gestures", "gestures = []", "gestures = .*expected is a list of different words"),
        ("temperature", "temperature = 0.0", "a number from 0.01"),
        ("temperature", "temperature = nan", "a number from 0.01"),
        ("accept", "accept = 1.1", "from 0 to 1"),
        ("accept", "accept = true", "from 0 to 1"),
        ("forget_s", "forget_s = 30.0\nlock = true", "the unknown key 'lock' under .users."),
        ("pinch", 'pinhc = "hold"', "users.mapping.bob.* 'pinhc' is unknown"),
    ],
)
def test_wrong_people_are_refused(tmp_path: Path, line: str, instead: str, complaint: str) -> None:
    table, count = re.subn(rf"^{line} = .*$", instead, enrolled.TABLE, flags=re.MULTILINE)
    assert count == 1
    with pytest.raises(BundleError, match=complaint):
        enrolled.write(tmp_path / "new.orb", table)
    assert not list(tmp_path.iterdir())


def test_a_bundle_has_the_touch_strength_of_each_user_and_of_all_others(tmp_path: Path) -> None:
    assert bundle.read(enrolled.SHIPPED).strength == 1.0
    own = "\n[users.strength]\nann = 0.4\n"
    text = b"strength = 2.0\n" + enrolled.manifest(enrolled.TABLE + own)
    bundle.write(tmp_path / "new.orb", manifest=text, parts=enrolled.parts())
    read = bundle.read(tmp_path / "new.orb")
    assert [read.strength_of(name) for name in ("ann", "bob", "")] == [0.4, 2.0, 2.0]


@pytest.mark.parametrize(
    ("own", "complaint"),
    [
        ("eve = 0.4", r"\[users.strength\] .* a number for a name"),
        ("ann = 0.01", "ann = 0.01 .*from 0.25 to 2.5"),
        ("ann = nan", "ann = nan .*from 0.25 to 2.5"),
        ("ann = true", "ann = True .*from 0.25 to 2.5"),
        ('ann = "light"', "ann = 'light' .*from 0.25 to 2.5"),
    ],
)
def test_a_wrong_touch_strength_is_refused(tmp_path: Path, own: str, complaint: str) -> None:
    with pytest.raises(BundleError, match=complaint):
        enrolled.write(tmp_path / "new.orb", f"{enrolled.TABLE}\n[users.strength]\n{own}\n")


def test_parts_that_the_manifest_does_not_name_are_refused(tmp_path: Path) -> None:
    shipped = container.unpack(enrolled.SHIPPED.read_bytes())
    for name in ("user.onnx", "../../etc/passwd", "readme.txt"):
        parts = {**container.content(shipped), name: b"something"}
        with pytest.raises(BundleError, match="other parts than its manifest names"):
            bundle.write(tmp_path / "x.orb", manifest=shipped[container.MANIFEST], parts=parts)
    del parts[container.LOCATION]
    with pytest.raises(BundleError, match="has not the parts"):
        bundle.write(tmp_path / "x.orb", manifest=shipped[container.MANIFEST], parts=parts)


def test_parts_in_another_order_are_refused(path: Path) -> None:
    parts = container.unpack(path.read_bytes())
    last = list(parts)
    last[-2], last[-3] = last[-3], last[-2]
    with pytest.raises(BundleError, match="damaged"):
        bundle.parse(container.pack({name: parts[name] for name in last}))
