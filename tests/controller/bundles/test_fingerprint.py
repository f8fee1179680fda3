"""The fingerprint of a bundle: of its networks and settings, not of its file."""

import dataclasses
from pathlib import Path

import pytest

from controller.bundles import bundle, container
from controller.bundles.bundle import Bundle
from controller.bundles.fingerprint import fingerprint
from controller.recognition.mapping import Mapping, Rule

SHIPPED = bundle.default_path()


@pytest.fixture(scope="module")
def shipped() -> Bundle:
    return bundle.read(SHIPPED)


def test_a_file_written_again_with_another_card_and_no_rehearsal_keeps_it(
    shipped: Bundle, tmp_path: Path
) -> None:
    parts = container.unpack(SHIPPED.read_bytes())
    manifest, content = parts[container.MANIFEST], container.content(parts)
    del content[container.REHEARSAL]
    again = tmp_path / "again.orb"
    bundle.write(again, manifest=manifest.replace(b"by hand", b"with care"), parts=content)
    written = bundle.read(again)
    assert written.hash != shipped.hash
    assert fingerprint(written) == fingerprint(shipped)


@pytest.mark.parametrize("name", ["embedding_onnx", "location_onnx", "user_onnx"])
def test_another_network_changes_it(shipped: Bundle, name: str) -> None:
    other = dataclasses.replace(shipped, **{name: getattr(shipped, name) + b"\0"})
    assert fingerprint(other) != fingerprint(shipped)


def test_another_threshold_gate_mapping_or_head_changes_it(shipped: Bundle) -> None:
    head = shipped.head
    others = [
        dataclasses.replace(shipped, debounce=dataclasses.replace(shipped.debounce, off=0.51)),
        dataclasses.replace(shipped, preprocess=dataclasses.replace(shipped.preprocess, window=41)),
        dataclasses.replace(shipped, mapping=Mapping({"press": (Rule("drop"),)})),
        dataclasses.replace(shipped, taught={"ada": shipped.head}),
        dataclasses.replace(shipped, head=dataclasses.replace(head, out_bias=head.out_bias + 1.0)),
    ]
    assert len({fingerprint(one) for one in (shipped, *others)}) == 6


def test_the_two_bundles_that_ship_have_two(shipped: Bundle) -> None:
    assert fingerprint(bundle.read(bundle.default_path(10.0))) != fingerprint(shipped)
