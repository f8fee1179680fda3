"""Training how wide a contact is, on simulated contacts."""

from pathlib import Path

import pytest

from tests.support.fingerprint import fingerprint
from tests.support.model_commands import refused
from tests.support.pytest_types import Capture

pytest.importorskip("torch", reason="needs the [train] extra")

from controller.bundles import bundle
from models.training.contact_task import LABEL, PARTS, train_contacts
from models.training.request import Request

pytestmark = pytest.mark.train

SLOW = bundle.default_path(10.0)


def test_a_bundle_learns_it_and_an_interrupted_training_simulates_nothing_twice(
    tmp_path: Path,
) -> None:
    request = Request((), tmp_path / "wide.orb", "contact", epochs=1, command="models train")
    folder, said = tmp_path / "wide.orb.training", []

    def stop(line: str) -> None:
        said.append(line)
        if "10 of 25" in line:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_contacts(request, SLOW, stop, orbs=1)
    kept = {path: path.stat().st_mtime_ns for path in folder.glob("contacts-*.npz")}
    assert len(kept) >= 10
    result = train_contacts(request, SLOW, said.append, orbs=1)
    assert not folder.exists()
    assert int(result.split()[0]) > 50 * (PARTS - 1)  # contacts
    made, before = bundle.read(request.out), bundle.read(SLOW)
    assert made.radius is not None
    assert made.contact.labels == (LABEL,)
    assert "fingertips are refused" in made.card["contact"]
    assert fingerprint(made) != fingerprint(before)


def test_contacts_need_no_recordings(tmp_path: Path, capsys: Capture) -> None:
    out = "--out", tmp_path / "new.orb"
    words = refused(capsys, "train", tmp_path, "--task", "contact", *out)
    assert "contacts are simulated" in words
    assert "name folders of recordings" in refused(capsys, "train", *out)
