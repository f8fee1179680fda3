"""The virtual machine's image, against the tools that read it."""

from __future__ import annotations

import io
import shutil
import subprocess
import tarfile
from pathlib import Path

import pytest

from tests.system import image, vm


def test_modules_come_after_what_they_need() -> None:
    needed = image._needed(
        "kernel/a/rfcomm.ko: kernel/b/bluetooth.ko kernel/c/ecdh.ko\n"
        "kernel/b/bluetooth.ko: kernel/c/ecdh.ko\nkernel/c/ecdh.ko:\nkernel/d/other-one.ko:\n"
    )
    assert image._closure(needed, ["rfcomm", "other_one", "built_in"]) == [
        "kernel/c/ecdh.ko",
        "kernel/b/bluetooth.ko",
        "kernel/a/rfcomm.ko",
        "kernel/d/other-one.ko",
    ]


@pytest.mark.skipif(not shutil.which("cpio"), reason="needs cpio")
def test_cpio_unpacks_the_first_file_system(tmp_path: Path) -> None:
    archive = image._initrd(b"\x7fELF busybox", {"virtio.ko": b"module"})
    done = subprocess.run(
        ["cpio", "-id", "--quiet"], input=archive, cwd=tmp_path, capture_output=True, check=True
    )
    assert done.stderr == b""
    assert (tmp_path / "bin/busybox").read_bytes() == b"\x7fELF busybox"
    assert (tmp_path / "mods/virtio.ko").read_bytes() == b"module"
    assert (tmp_path / "init").stat().st_mode & 0o111
    assert (tmp_path / "new").is_dir()


def test_the_root_keeps_programs_and_the_modules_that_are_needed() -> None:
    base = "./usr/lib/modules/6.1"
    keep = {f"{base}/kernel/a/rfcomm.ko"}
    assert image._kept("./usr/bin/btvirt", keep)
    assert image._kept(f"{base}/modules.dep", keep)
    assert image._kept(f"{base}/kernel/a/rfcomm.ko", keep)
    assert not image._kept(f"{base}/kernel/z/zfs.ko", keep)
    assert not image._kept("./usr/share/doc/bluez/copyright", keep)
    assert not image._kept("./boot/vmlinuz-6.1", keep)


def test_the_first_script_and_the_mount_points_are_added() -> None:
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as out:
        image._add(out)
    packed.seek(0)
    with tarfile.open(fileobj=packed) as archive:
        entry = archive.getmember("./init.sh")
        assert (entry.uid, entry.gid) == (0, 0)
        assert entry.mode & 0o111
        assert archive.getmember("./out").isdir()


def test_every_case_is_found_by_its_file() -> None:
    assert {"radio", "rfcomm", "stranger", "comebacks", "keys"} <= set(vm.names())
