"""The fingerprint of a bundle: of its networks and settings, not of its file."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from controller.bundles import bundle, container
from controller.bundles.bundle import Bundle
from controller.recognition.debounce import DebounceSettings
from controller.recognition.mapping import Mapping, Rule
from controller.recognition.user_id import Users
from tests.support.fingerprint import fingerprint

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Later(Bundle):
    """A bundle as a later program knows it."""

    later: float = 1.0


@dataclass(frozen=True, slots=True)
class LaterDebounce(DebounceSettings):
    later: tuple[str, ...] = ()


def test_a_setting_that_a_later_program_knows_changes_it_only_where_it_is_set(
    shipped: Bundle,
) -> None:
    def known(debounce: DebounceSettings, **own: Any) -> Later:
        given = {one.name: getattr(shipped, one.name) for one in dataclasses.fields(Bundle)}
        return Later(**given | {"debounce": debounce} | own)

    plain = LaterDebounce(**dataclasses.asdict(shipped.debounce))
    assert fingerprint(known(plain)) == fingerprint(shipped)
    assert fingerprint(known(plain, later=1.1)) != fingerprint(shipped)
    assert fingerprint(known(dataclasses.replace(plain, later=("press",)))) != fingerprint(shipped)


def test_touch_strength_changes_it_only_where_it_is_set(shipped: Bundle) -> None:
    light = dataclasses.replace(shipped, strength=1.2)
    ada = dataclasses.replace(shipped, users=Users(("ada",)))
    ours = dataclasses.replace(shipped, users=Users(("ada",), strengths={"ada": 1.2}))
    plain = dataclasses.replace(shipped, strength=1.0)
    assert fingerprint(plain) == fingerprint(shipped)
    assert len({fingerprint(one) for one in (shipped, light, ada, ours)}) == 4


def test_the_two_bundles_that_ship_have_two(shipped: Bundle) -> None:
    assert fingerprint(bundle.read(bundle.default_path(10.0))) != fingerprint(shipped)
