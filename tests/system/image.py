"""A small Debian with a real kernel and a real BlueZ, as three files that qemu boots.

    mmdebstrap ─► root.tar ─► pruned, with Python packages ─► root.squashfs
                     └──► vmlinuz            busybox and a few modules ─► initrd.gz

Nothing of the project is inside: the guest gets the working tree when it boots. So the image is
built once, and kept in the user's cache folder under the hash of what it is made from.
"""

from __future__ import annotations

import contextlib
import gzip
import hashlib
import io
import os
import platform
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import platformdirs


@dataclass(frozen=True)
class Suite:
    """A release of Debian."""

    python: str  # its Python
    glibc: int  # its C library, 2.x, which decides what wheels it takes


SUITES: Final = {"trixie": Suite("3.13", 41), "bookworm": Suite("3.11", 36)}
DEFAULT: Final = os.environ.get("ORBTOUCH_VM_DEBIAN", "trixie")
DAYS: Final = 30  # after which an image that nobody has booted is thrown away
PACKAGES: Final = """
    linux-image-amd64 bluez bluez-test-tools dbus python3 python3-evdev udev kmod iproute2
    procps busybox-static
"""
# Bumble by hand: its own list draws in USB libraries that nothing here needs.
WHEELS: Final = "numpy onnxruntime platformdirs pygame-ce pyserial smbus2 tomli-w dbus-fast"
BARE_WHEELS: Final = "bumble cryptography cffi pycparser pyee typing_extensions"
# linux-image-cloud-amd64 has no Bluetooth at all; this kernel has everything as modules. The
# kernel asks for the ciphers when a controller appears, and would give up while they load.
MODULES: Final = """
    virtio_pci virtio_blk virtio_rng squashfs overlay 9p 9pnet_virtio af_alg algif_hash
    algif_skcipher cmac ecb aes_generic ecdh_generic drbg ctr hmac sha256_generic sha512_generic
    ccm bluetooth rfcomm hidp bnep hci_vhci uinput uhid evdev joydev hid_generic
    dummy_hcd libcomposite usb_f_hid usbhid i2c_stub i2c_dev
"""
EARLY: Final = "virtio_pci virtio_blk squashfs overlay"  # what the root itself needs
TOOLS: Final = {
    "mmdebstrap": "mmdebstrap",
    "mksquashfs": "squashfs-tools",
    "qemu-system-x86_64": "qemu-system-x86",
}
LEFT_OUT: Final = (
    "./boot", "./vmlinuz", "./initrd", "./dev/", "./var/cache", "./var/lib/apt", "./var/lib/dpkg",
    "./usr/share/doc", "./usr/share/man", "./usr/share/locale", "./usr/share/i18n",
    "./usr/share/zoneinfo", "./usr/share/info", "./usr/share/bug", "./usr/lib/firmware",
    "./usr/lib/python3/dist-packages/numpy",
)  # fmt: skip
HERE: Final = Path(__file__).parent


class ImageError(OSError):
    """The image cannot be built; one sentence says why and what to do."""


def image(suite: str = DEFAULT) -> Path:
    """Return the folder of vmlinuz, initrd.gz and root.squashfs, 140 MB, built first if need be."""
    _check_tools()
    if suite not in SUITES:
        raise ImageError(f"there is no Debian {suite} here; there are {', '.join(SUITES)}")
    cache = platformdirs.user_cache_path("orbtouch") / "system"
    folder = cache / f"{suite}-{_key()}"
    if not folder.is_dir():
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=cache, prefix="building-") as name:
            done = Path(name) / "done"
            done.mkdir()
            _build(suite, Path(name), done)
            with contextlib.suppress(OSError):  # somebody else was quicker
                done.rename(folder)
    os.utime(folder)
    for old in cache.iterdir():
        if time.time() - old.stat().st_mtime > DAYS * 86_400:
            shutil.rmtree(old, ignore_errors=True)
    return folder


def _check_tools() -> None:
    if platform.machine() not in ("x86_64", "AMD64") or sys.platform != "linux":
        raise ImageError("the virtual machine is built on Linux on x86-64 only")
    missing = [package for tool, package in TOOLS.items() if not shutil.which(tool)]
    if missing:
        raise ImageError(f"install what is missing first: sudo apt install {' '.join(missing)}")


def _key() -> str:
    """Return what changes when the image would: this file, and what the guest runs first."""
    text = Path(__file__).read_bytes() + (HERE / "init.sh").read_bytes()
    return hashlib.sha256(text).hexdigest()[:16]


def _build(suite: str, work: Path, done: Path) -> None:
    def say(what: str) -> None:
        print(what, file=sys.stderr, flush=True)

    say(f"building the virtual machine's image of Debian {suite}, once: about three minutes")
    say("  fetching Python packages ...")
    packages, tar = work / "py", work / "root.tar"
    _install(SUITES[suite], packages)
    say("  installing Debian ...")
    _bootstrap(suite, packages, tar)
    say("  writing the root ...")
    _write(tar, done)


def _run(command: list[str], **options: object) -> None:
    """Run a step quietly and politely; say in one sentence what failed."""
    done = subprocess.run(
        ["nice", *command], capture_output=True, text=True, check=False, **options  # type: ignore[call-overload]
    )  # fmt: skip
    if done.returncode:
        lines = (done.stderr or done.stdout or "").strip().splitlines()
        last = next((line for line in reversed(lines) if line.strip()), "no message")
        raise ImageError(f"{command[0]} failed: {last}")


def _install(suite: Suite, into: Path) -> None:
    """Fetch wheels for the guest's Python, whatever Python this is."""
    pip = [
        sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check",
        "--target", str(into), "--python-version", suite.python, "--only-binary=:all:",
        "--implementation", "cp", "--abi", f"cp{suite.python.replace('.', '')}", "--abi", "abi3",
        "--abi", "none", "--no-compile", "--upgrade", "--platform", "manylinux2014_x86_64",
    ]  # fmt: skip
    for glibc in range(suite.glibc, 16, -1):  # pip matches each by its name
        pip += ["--platform", f"manylinux_2_{glibc}_x86_64"]
    _run([*pip, *WHEELS.split()])
    _run([*pip, "--no-deps", *BARE_WHEELS.split()])


def _bootstrap(suite: str, packages: Path, tar: Path) -> None:
    """Install a minimal Debian and the packages, compiled here: the guest would take a minute."""
    command = [
        "mmdebstrap", "--variant=minbase", f"--include={','.join(PACKAGES.split())}",
        '--aptopt=APT::Install-Recommends "false"',
        "--dpkgopt=path-exclude=/usr/share/doc/*", "--dpkgopt=path-exclude=/usr/share/man/*",
        "--dpkgopt=path-exclude=/usr/share/locale/*",
        f"--customize-hook=copy-in {packages} /opt",
        '--customize-hook=chroot "$1" python3 -m compileall -q '
        "--invalidation-mode unchecked-hash /opt/py || true",
        suite, str(tar),
    ]  # fmt: skip
    sources = Path("/etc/apt/sources.list.d/debian.sources")
    if sources.exists() and f"Suites: {suite}" in sources.read_text():
        command.append(str(sources))
    _run(command)


def _write(tar: Path, done: Path) -> None:
    """Split the tar into kernel, first file system and pruned root."""
    with tarfile.open(tar) as archive:
        members = {member.name: member for member in archive}
        kernel = next(name for name in members if name.startswith("./boot/vmlinuz-"))
        version = kernel.partition("vmlinuz-")[2]
        base = f"./usr/lib/modules/{version}"
        needed = _needed(_read(archive, f"{base}/modules.dep").decode())
        (done / "vmlinuz").write_bytes(_read(archive, kernel))
        early = [f"{base}/{name}" for name in _closure(needed, EARLY.split())]
        keep = {f"{base}/{name}" for name in _closure(needed, MODULES.split())}
        first = {name.rpartition("/")[2]: _read(archive, name) for name in early}
        busybox = _read(archive, "./usr/bin/busybox")
        (done / "initrd.gz").write_bytes(gzip.compress(_initrd(busybox, first)))
        command = ["mksquashfs", "-", str(done / "root.squashfs"), "-tar", "-comp", "zstd"]
        command += ["-Xcompression-level", "6", "-quiet", "-no-progress", "-noappend"]
        with subprocess.Popen(["nice", *command], stdin=subprocess.PIPE) as squash:
            assert squash.stdin is not None
            with tarfile.open(fileobj=squash.stdin, mode="w|", format=tarfile.GNU_FORMAT) as out:
                for name, member in members.items():
                    if _kept(name, keep):
                        data = archive.extractfile(member) if member.isreg() else None
                        out.addfile(member, data)
                _add(out)
        if squash.returncode:
            raise ImageError("mksquashfs failed; is the disk full?")


def _kept(name: str, modules: set[str]) -> bool:
    if "/lib/modules/" in name and "/kernel/" in name and name.endswith((".ko", ".ko.xz")):
        return name in modules
    return not name.startswith(LEFT_OUT)


def _add(out: tarfile.TarFile) -> None:
    """Add what Debian does not have: the first script, and mount points."""
    for folder in ("./repo", "./out", "./project"):
        entry = tarfile.TarInfo(folder)
        entry.type, entry.mode = tarfile.DIRTYPE, 0o755
        out.addfile(entry)
    script = (HERE / "init.sh").read_bytes()
    entry = tarfile.TarInfo("./init.sh")
    entry.size, entry.mode = len(script), 0o755
    out.addfile(entry, io.BytesIO(script))


def _read(archive: tarfile.TarFile, name: str) -> bytes:
    file = archive.extractfile(name)
    assert file is not None, name
    return file.read()


def _needed(text: str) -> dict[str, list[str]]:
    """Return modules.dep as path → paths that must be loaded before, in the file's order."""
    lines = (line.partition(":") for line in text.splitlines())
    return {path: others.split() for path, _, others in lines}


def _closure(needed: dict[str, list[str]], names: list[str]) -> list[str]:
    """Return the paths of modules, none built in, and of all that they need, in loading order."""
    paths = {path.rpartition("/")[2].partition(".")[0].replace("-", "_"): path for path in needed}
    order: list[str] = []
    for name in names:
        if name in paths:
            path = paths[name]
            order += [each for each in (*reversed(needed[path]), path) if each not in order]
    return order


def _initrd(busybox: bytes, modules: dict[str, bytes]) -> bytes:
    """Return the first file system as a cpio archive: it loads modules and mounts the root."""
    script = f"""#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
for m in {" ".join(modules)}; do insmod /mods/$m || echo "insmod $m failed"; done
for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15; do [ -b /dev/vda ] && break; sleep 0.2; done
mount -t squashfs -o ro /dev/vda /ro || echo "there is no root"
mount -t tmpfs -o size=70% tmpfs /rw; mkdir /rw/upper /rw/work
mount -t overlay -o lowerdir=/ro,upperdir=/rw/upper,workdir=/rw/work overlay /new
for d in proc sys dev; do mount --move /$d /new/$d; done
exec switch_root /new /init.sh
"""
    files: list[tuple[str, int, bytes]] = [
        (folder, 0o040755, b"")
        for folder in ("bin", "mods", "proc", "sys", "dev", "ro", "rw", "new")
    ]
    files += [("bin/busybox", 0o100755, busybox), ("init", 0o100755, script.encode())]
    files += [(f"mods/{name}", 0o100644, data) for name, data in modules.items()]
    return b"".join(_cpio(files))


def _cpio(files: list[tuple[str, int, bytes]]) -> Iterator[bytes]:
    """Yield a cpio archive in the kernel's "newc" format (its early-userspace documentation)."""
    for number, (name, mode, data) in enumerate([*files, ("TRAILER!!!", 0, b"")], start=1):
        fields = (number, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(name) + 1, 0)
        head = b"070701" + b"".join(b"%08X" % field for field in fields) + name.encode() + b"\0"
        yield head + bytes(-len(head) % 4)
        yield data + bytes(-len(data) % 4)


if __name__ == "__main__":
    print({p.name: f"{p.stat().st_size / 1e6:.0f} MB" for p in image().iterdir()})
