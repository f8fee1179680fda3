"""Bundles: whole or refused, and proved before they are used."""

import dataclasses
import io
import pickle
import re
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.bundles import bundle, container
from controller.bundles.container import BundleError
from controller.bundles.inference.networks import Recognizer
from controller.bundles.inference.onnxruntime_engine import Network
from controller.recognition.touch_input import TouchInput
from controller.recognition.touch_position import PositionSpread
from controller.shared import npz

SHIPPED = bundle.default_path(10.0)


def parts_of(path: Path = SHIPPED) -> tuple[bytes, dict[str, bytes]]:
    """The manifest and the other parts, ready to be written again."""
    parts = container.unpack(path.read_bytes())
    return parts[container.MANIFEST], container.content(parts)


def test_shipped_bundle_knows_the_paper_s_five_classes_and_proves_itself() -> None:
    shipped = bundle.read(SHIPPED)
    assert shipped.labels == ("null", "press", "pinch", "twist_cw", "twist_ccw")
    assert (shipped.rows, shipped.columns, shipped.window, shipped.rate_hz) == (5, 5, 10, 10.0)
    probabilities = Recognizer(shipped).probabilities(shipped.golden.windows[0])
    assert probabilities.shape == (5,)
    assert probabilities.sum() == pytest.approx(1.0, abs=1e-5)


def test_each_bundle_that_ships_takes_less_than_a_megabyte() -> None:
    bundles = sorted(SHIPPED.parent.glob("*.orb"))
    assert [path.name for path in bundles] == ["orbtouch-10hz.orb", "orbtouch.orb"]
    assert max(path.stat().st_size for path in bundles) < 1_000_000
    slow, usual = map(bundle.read, bundles)
    assert (slow.rate_hz, usual.rate_hz) == (10.0, 40.0)
    assert (slow.labels, slow.mapping) == (usual.labels, usual.mapping)


def test_any_zip_tool_opens_a_bundle_and_its_sums_are_right() -> None:
    with zipfile.ZipFile(SHIPPED) as file:
        assert file.namelist() == [*container.PARTS[:-1], container.REHEARSAL, container.SUMS]
        assert file.testzip() is None


def test_same_parts_make_the_same_file(tmp_path: Path) -> None:
    manifest, parts = parts_of()
    copy = tmp_path / "copy.orb"
    bundle.write(copy, manifest=manifest, parts=parts)
    assert copy.read_bytes() == SHIPPED.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["copy.orb"]


def test_one_flipped_bit_anywhere_is_refused(tmp_path: Path) -> None:
    whole = SHIPPED.read_bytes()
    path = tmp_path / "flipped.orb"
    headers = [match.start() for match in re.finditer(rb"PK[\1-\6][\2-\6]", whole)]
    places = {0, len(whole) // 2, len(whole) - 1}
    places |= {start + offset for start in headers for offset in range(0, 46, 5)}
    places |= {int(p) for p in np.random.default_rng(1).integers(0, len(whole), 20)}
    for place in sorted(place for place in places if place < len(whole)):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << place % 8
        path.write_bytes(damaged)
        with pytest.raises(BundleError, match="damaged"):
            bundle.read(path)


def test_what_is_no_bundle_is_refused_in_one_sentence(tmp_path: Path) -> None:
    whole = SHIPPED.read_bytes()
    contents = {
        "empty": b"",
        "truncated": whole[:-1],
        "half": whole[: len(whole) // 2],
        "longer": whole + b"\0",
        "random": np.random.default_rng(2).bytes(5000),
    }
    for name, data in contents.items():
        path = tmp_path / name
        path.write_bytes(data)
        with pytest.raises(BundleError, match="is damaged"):
            bundle.read(path)
    with pytest.raises(BundleError, match="it is a folder"):
        bundle.read(tmp_path)
    with pytest.raises(BundleError, match="does not exist"):
        bundle.read(tmp_path / "absent.orb")


def test_a_file_that_is_too_large_is_not_even_read(tmp_path: Path) -> None:
    path = tmp_path / "large.orb"
    with path.open("wb") as file:
        file.truncate(container.MAX_BYTES + 1)
    with pytest.raises(BundleError, match="it has more than"):
        bundle.read(path)


def test_a_bundle_may_do_without_a_location_network(tmp_path: Path) -> None:
    manifest, parts = parts_of()
    golden = npz.unpack(parts["golden.npz"], container.MAX_BYTES)
    none = {name: golden[name][:0] for name in ("images", "touches")}
    parts |= {container.LOCATION: b""}
    parts["golden.npz"] = npz.pack({**golden, **none})
    with pytest.raises(BundleError, match="maps gestures by their place"):
        bundle.write(tmp_path / "new.orb", manifest=manifest, parts=parts)
    text = re.sub(r"press = \[.*?\n\]", 'press = "down"', manifest.decode(), flags=re.DOTALL)
    bundle.write(tmp_path / "new.orb", manifest=text.encode(), parts=parts)
    blind = bundle.read(tmp_path / "new.orb")
    assert not blind.locates
    assert Recognizer(blind).touch(golden["images"][0]) is None


def test_a_bundle_may_say_how_far_off_its_places_are(tmp_path: Path) -> None:
    manifest, parts = parts_of()
    plain = re.sub(r"\[location\]\n(\w.*\n)*", "", manifest.decode())
    for table, spread in (
        ("", None),
        ("\n[location]\nfloor = 0.07\nnoise = 3\n", PositionSpread(0.07, 3.0)),
    ):
        bundle.write(tmp_path / "new.orb", manifest=(plain + table).encode(), parts=parts)
        assert bundle.read(tmp_path / "new.orb").spread == spread
    for table, complaint in (
        ("\n[location]\nfloor = -1.0\nnoise = 3.0\n", "floor = -1.0 under .location."),
        ("\n[location]\nfloor = 1.0\n", "noise = None under .location.; expected is a number"),
    ):
        with pytest.raises(BundleError, match=complaint):
            bundle.write(tmp_path / "new.orb", manifest=(plain + table).encode(), parts=parts)


def test_a_location_network_of_a_crop_finds_touches_anywhere_on_a_large_grid() -> None:
    shipped = bundle.read(SHIPPED)
    plain = Recognizer(shipped)
    middle = np.abs(shipped.golden.touches - 2.0).max(axis=1).argmin()
    image, (x, y) = shipped.golden.images[middle], shipped.golden.touches[middle]
    large = np.ones((9, 12), dtype=np.float32)
    large[1:6, 4:9] = image  # three rows are nearer to the user, four columns further left
    golden = dataclasses.replace(
        shipped.golden, images=large[None], touches=np.array([[x + 4, y + 3]], dtype=np.float32)
    )
    touch = TouchInput(crop=5, level=shipped.touch.level)
    cropped = dataclasses.replace(shipped, touch=touch, golden=golden)
    assert Recognizer(cropped).touch(large) == pytest.approx((x + 4, y + 3), abs=1e-5)
    assert plain.touch(image) == pytest.approx((x, y), abs=1e-5)
    elsewhere = dataclasses.replace(golden, touches=golden.touches + np.float32(1.0))
    with pytest.raises(BundleError, match="location network answers differently"):
        Recognizer(dataclasses.replace(cropped, golden=elsewhere))
    with pytest.raises(BundleError, match=r"of \(5, 5\); the bundle wants \(2,\) of \(7, 7\)"):
        Recognizer(dataclasses.replace(cropped, touch=TouchInput(crop=7)))


@pytest.mark.parametrize("strength", [0.5, 2.0])
def test_places_at_one_level_do_not_depend_on_the_strength_of_a_touch(strength: float) -> None:
    shipped = bundle.read(SHIPPED)
    assert shipped.touch.level > 0.0
    image, place = shipped.golden.images[0], shipped.golden.touches[0]
    other = (1.0 + strength * (image - 1.0)).astype(np.float32)
    assert Recognizer(shipped).touch(other) == pytest.approx(place, abs=1e-4)


@pytest.mark.parametrize(
    ("line", "instead", "complaint"),
    [
        ("format", "format = 6", "this program reads 7; train or teach it again if it is older"),
        ("rows", "rows = 0", "a whole number from 1 to 30"),
        ("rows", "rows = true", "a whole number"),
        ("rows", "rows = 5.0", "a whole number"),
        ("columns", "", "columns = None"),
        ("rate_hz", "rate_hz = inf", "a number from 0.1"),
        ("rate_hz", "rate_hz = 20.0", "others under .preprocess."),
        ("labels", 'labels = ["press", "null"]', '"null" first'),
        ("labels", 'labels = ["null", "press", "press"]', "different names"),
        ("labels", 'labels = ["null", "Ünvar!"]', "small letters"),
        ("labels", "labels = [", "cannot be used: line 3: invalid value"),
        ("on", "on = nan", "on = nan"),
        ("on", "onn = 0.5", "the unknown key 'onn' under .debounce.; known are smoothing, on"),
        ("slow", 'slow = ["hop"]', "has a setting of a gesture 'hop' that it does not have"),
        ("slow", 'brisk = ["hop"]', "has a setting of a gesture 'hop' that it does not have"),
        ("crop", "crop = 2.5", "crop = 2.5 under .touch.; expected is a whole"),
        ("level", "level = -1.0", "level = -1.0 under .touch."),
        ("format", "format = 7\nmood = 1", "the unknown key 'mood'; known are labels"),
        ("pinch", 'pinhc = "drop"', "'pinhc' is unknown; known are press, pinch"),
    ],
)
def test_a_manifest_that_makes_no_sense_is_refused(
    tmp_path: Path, line: str, instead: str, complaint: str
) -> None:
    text, parts = parts_of()
    pattern = rf"^{line} = (\[[^\]]*\]|.*)$"
    changed = re.sub(pattern, instead, text.decode(), count=1, flags=re.MULTILINE)
    with pytest.raises(BundleError, match=complaint):
        bundle.write(tmp_path / "new.orb", manifest=changed.encode(), parts=parts)
    assert not list(tmp_path.iterdir())


def test_a_setting_that_a_manifest_does_not_have_takes_its_default(tmp_path: Path) -> None:
    text, parts = parts_of()
    manifest = re.sub(r"^(scale|gate|on) = .*\n", "", text.decode(), flags=re.MULTILINE)
    bundle.write(tmp_path / "new.orb", manifest=manifest.encode(), parts=parts)
    read = bundle.read(tmp_path / "new.orb")
    assert (read.preprocess.scale, read.preprocess.gate, read.debounce.on) == (1.0, 0.015, 0.8)


def test_golden_vectors_are_never_unpickled(tmp_path: Path) -> None:
    class Trap:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return pytest.fail, ("a pickle was loaded",)

    manifest, parts = parts_of()
    buffer = io.BytesIO()
    np.savez(buffer, windows=np.array([Trap()], dtype=object))
    fewer = npz.unpack(parts["golden.npz"], container.MAX_BYTES)
    fewer["touches"] = fewer["touches"][:-1]
    for golden, complaint in (
        (buffer.getvalue(), "pickled objects"),
        (pickle.dumps({}), "not a whole"),
        (npz.pack(fewer), "different numbers of golden"),
    ):
        changed = {**parts, "golden.npz": golden}
        with pytest.raises(BundleError, match=complaint):
            bundle.write(tmp_path / "x.orb", manifest=manifest, parts=changed)


def test_a_network_that_answers_differently_than_when_it_was_made_is_refused() -> None:
    shipped = bundle.read(SHIPPED)
    golden = shipped.golden
    far: dict[str, Any] = {"probabilities": golden.probabilities + np.float32(2e-4)}
    none: dict[str, Any] = {"touches": golden.touches * np.float32(np.nan)}
    for network, changes in (("gesture", far), ("location", none)):
        other = dataclasses.replace(shipped, golden=dataclasses.replace(golden, **changes))
        with pytest.raises(BundleError, match=f"{network} network answers differently"):
            Recognizer(other)


def test_reading_a_bundle_takes_memory_for_what_is_in_it_and_no_more() -> None:
    tracemalloc.start()
    try:
        bundle.read(SHIPPED)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 8 * SHIPPED.stat().st_size


def test_a_model_that_is_none_is_refused() -> None:
    shipped = bundle.read(SHIPPED)
    with pytest.raises(BundleError, match="embedding network is damaged"):
        Recognizer(dataclasses.replace(shipped, embedding_onnx=b"no model"))
    swapped = dataclasses.replace(shipped, location_onnx=shipped.embedding_onnx)
    with pytest.raises(BundleError, match=r"location network makes \(96,\) of \(10, 5, 5\)"):
        Recognizer(swapped)


def changed_head(**changes: np.ndarray) -> dict[str, bytes]:
    """The shipped parts with another head."""
    head = bundle.read(SHIPPED).head
    return {**parts_of()[1], container.HEAD: npz.pack({**head.arrays(), **changes})}


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"out_bias": np.zeros(6, np.float32)}, r"out of float32 \(5, 48\); expected .* \(6, 48\)"),
        ({"hidden_bias": np.full(48, np.nan, np.float32)}, "hidden_bias of float32"),
        ({"out": np.zeros((5, 48))}, "out of float64"),
        ({"more": np.zeros(1, np.float32)}, "has a head of .*, more, not hidden, hidden_bias, out"),
    ],
)
def test_a_head_that_makes_no_sense_is_refused(
    tmp_path: Path, changes: dict[str, np.ndarray], complaint: str
) -> None:
    with pytest.raises(BundleError, match=complaint):
        bundle.write(tmp_path / "x.orb", manifest=parts_of()[0], parts=changed_head(**changes))


def test_a_head_is_for_the_labels_and_for_the_embedding(tmp_path: Path) -> None:
    manifest, parts = parts_of()
    head = bundle.read(SHIPPED).head
    more = manifest.replace(b'"twist_ccw",', b'"twist_ccw", "wave",', 1)
    with pytest.raises(BundleError, match="has 6 labels, and a head that knows 5"):
        bundle.write(tmp_path / "x.orb", manifest=more, parts=parts)
    narrow = changed_head(hidden=head.hidden[:, :60])
    bundle.write(tmp_path / "x.orb", manifest=manifest, parts=narrow)
    with pytest.raises(BundleError, match=r"embedding network makes \(96,\) of .* wants \(60,\)"):
        Recognizer(bundle.read(tmp_path / "x.orb"))


def test_an_answer_that_is_no_number_counts_as_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(answers: int) -> Network:
        return lambda question: np.full((1, answers), np.nan, dtype=np.float32)

    recognizer = Recognizer(bundle.read(bundle.default_path(10.0)))
    for network, answers in (("gesture ", 5), ("location", 2)):
        monkeypatch.setitem(recognizer._networks, network, nothing(answers))
    window = np.ones((10, 5, 5), dtype=np.float32)
    assert recognizer.probabilities(window).tolist() == [1.0, 0.0, 0.0, 0.0, 0.0]
    assert recognizer.touch(window[0]) is None
