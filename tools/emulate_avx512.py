"""Runs a command on an emulated machine that has AVX-512, for where the real one has none.

    tools/emulate_avx512.py build/src/base/kanuka_base_test
    tools/emulate_avx512.py .venv/bin/python -m kanuka render scenes/cornell.rib -o out/cornell.exr --resolution 16x16

Bochs emulates the machine, one core of a Skylake server, some 40 million instructions a second: a hundred times slower
than a real one. It starts Debian's kernel, whose disk has what the command may need: this checkout's package, scenes,
tests, shaders and the files that the command names, Python, and the libraries of all that. What the command writes
under out/ comes back; its exit status is this program's. --show FILE keeps all that the machine said.

Debian packages: bochs bochsbios bochs-term isolinux syslinux-common genisoimage busybox-static cpio kmod
e2fsprogs; the kernel is fetched by `apt-get download` once, into build/emulated.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
KEPT = ROOT / "build/emulated"
NEEDED = {
    "bochs": "bochs",
    "genisoimage": "genisoimage",
    "cpio": "cpio",
    "/sbin/depmod": "kmod",
    "/sbin/mke2fs": "e2fsprogs",
    "/usr/sbin/debugfs": "e2fsprogs",
    "/bin/busybox": "busybox-static",
    "/usr/lib/ISOLINUX/isolinux.bin": "isolinux",
    "/usr/lib/syslinux/modules/bios/ldlinux.c32": "syslinux-common",
    "/usr/share/bochs/BIOS-bochs-latest": "bochsbios",
    "/usr/share/bochs/VGABIOS-lgpl-latest": "bochsbios",
}
# Of the kernel: the disk and its file system; the rest is built in.
MODULES = ("ata_piix", "sd_mod", "crc32c_generic", "ext4")
# Of the checkout, if they are there.
CARRIED = ("python", "shaders", "scenes", "tests")
# Linux does not believe the size that Bochs tells of XSAVE's compacted area, and leaves AVX off: so no such area.
KERNEL_LINE = "console=ttyS0 loglevel=4 mitigations=off nokaslr nosmp panic=-1 noxsaves clearcpuid=321"

INIT = """#!/bin/busybox sh
/bin/busybox mount -t proc proc /proc
/bin/busybox mount -t devtmpfs dev /dev
for module in /modules/*; do /bin/busybox insmod $module; done
until [ -b /dev/sda ]; do /bin/busybox sleep 0.1; done
/bin/busybox mount -t ext4 /dev/sda /new
for each in proc dev; do /bin/busybox mount --move /$each /new/$each; done
exec /bin/busybox switch_root /new /start
"""

START = """#!/bin/busybox sh
/bin/busybox mount -t sysfs sys /sys
cd {folder}
{exports}
echo BEGIN; {command}
/bin/busybox echo "END $?"
/bin/busybox umount -r / 2>/dev/null; /bin/busybox sync
/bin/busybox sleep 1
/bin/busybox poweroff -f
"""

MACHINE = """cpu: model=corei7_skylake_x, count=1, ips=100000000, reset_on_triple_fault=0
memory: guest=2048, host=2048
romimage: file=/usr/share/bochs/BIOS-bochs-latest
vgaromimage: file=/usr/share/bochs/VGABIOS-lgpl-latest
ata0: enabled=1, ioaddr1=0x1f0, ioaddr2=0x3f0, irq=14
ata0-master: type=disk, path=disk, mode=flat
ata1: enabled=1, ioaddr1=0x170, ioaddr2=0x370, irq=15
ata1-master: type=cdrom, path=start.iso, status=inserted
boot: cdrom
com1: enabled=1, mode=file, dev=said
display_library: rfb, options="timeout=0"
log: bochs.log
panic: action=fatal
clock: sync=none
"""


def call(*command: object, **more) -> str:
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **more)
    if done.returncode:
        sys.exit(f"{shlex.join(map(str, command))} failed:\n{done.stderr}")
    return done.stdout


def check_needed() -> None:
    missing = {package for what, package in NEEDED.items() if not (Path(what).exists() or shutil.which(what))}
    if missing:
        sys.exit(f"not there: {' '.join(sorted(missing))} (apt-get install them)")


def kernel() -> Path:
    """A folder with boot/vmlinuz-* and lib/modules."""
    folder = KEPT / "kernel"
    if not list(folder.glob("boot/vmlinuz-*")):
        folder.mkdir(parents=True, exist_ok=True)
        (package,) = re.findall(r"Depends: (linux-image-\S+)", call("apt-cache", "depends", "linux-image-amd64"))
        call("apt-get", "download", package, cwd=KEPT)
        call("dpkg", "-x", next(KEPT.glob(f"{package}_*.deb")), folder)
        call("/sbin/depmod", "-b", folder, package.removeprefix("linux-image-"))
    return folder


def modules(folder: Path) -> list[Path]:
    """Those of MODULES, each after what it needs."""
    (place,) = (folder / "lib/modules").iterdir()
    needs = dict(line.split(":") for line in (place / "modules.dep").read_text().splitlines())
    by_name = {Path(path).stem: path for path in needs}
    ordered = [path for name in MODULES for path in (*reversed(needs[by_name[name]].split()), by_name[name])]
    return [place / path for path in dict.fromkeys(ordered)]


def make_start(folder: Path, kernel: Path) -> None:
    """start.iso: what the machine starts from."""
    first, iso = folder / "first", folder / "iso"
    for name in ("bin", "modules", "proc", "sys", "dev", "new"):
        (first / name).mkdir(parents=True)
    for i, module in enumerate(modules(kernel)):
        shutil.copy(module, first / f"modules/{i:02}-{module.name}")
    shutil.copy("/bin/busybox", first / "bin")
    (first / "init").write_text(INIT)
    (first / "init").chmod(0o755)
    (iso / "isolinux").mkdir(parents=True)
    call("bash", "-c", "find . | cpio -o -H newc | gzip -1 > ../iso/first.gz", cwd=first)
    shutil.copy(next(kernel.glob("boot/vmlinuz-*")), iso / "vmlinuz")
    for path in (what for what in NEEDED if what.endswith(("isolinux.bin", "ldlinux.c32"))):
        shutil.copy(path, iso / "isolinux")
    (iso / "isolinux/isolinux.cfg").write_text(
        f"default linux\nprompt 0\nlabel linux\n kernel /vmlinuz\n append initrd=/first.gz {KERNEL_LINE}\n"
    )
    boot = ["-b", "isolinux/isolinux.bin", "-c", "isolinux/boot.cat", "-no-emul-boot", "-boot-load-size", "4"]
    call("genisoimage", "-quiet", "-o", "start.iso", *boot, "-boot-info-table", "iso", cwd=folder)


def copy(path: Path, disk: Path, skip: tuple[str, ...] = ()) -> None:
    """The file or folder to its own place on the disk."""
    target = disk / path.relative_to("/")
    if path.is_dir():
        shutil.copytree(path, target, symlinks=True, dirs_exist_ok=True, ignore=shutil.ignore_patterns(*skip))
    elif not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)


def is_program(path: Path) -> bool:
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(4) == b"\x7fELF"


def copy_libraries(disk: Path) -> None:
    """Of all programs and libraries on the disk, under the names that they are loaded by."""
    told = set()
    for path in [path for path in disk.rglob("*") if is_program(path)]:
        listed = subprocess.run(["ldd", "/" / path.relative_to(disk)], capture_output=True, text=True).stdout
        told.update(re.findall(r"(/\S+) \(0x", listed))
    for name in told:
        copy(Path(name), disk)


def fill_disk(disk: Path, command: list[str], exports: dict[str, str]) -> None:
    for name in ("proc", "sys", "dev", "bin", "tmp", "root"):
        (disk / name).mkdir()
    shutil.copy("/bin/busybox", disk / "bin")
    for name in ("sh", "env", "cat", "ls", "grep"):
        (disk / "bin" / name).symlink_to("busybox")
    for name in CARRIED:
        copy(ROOT / name, disk, skip=("__pycache__", ".pytest_cache", "found"))
    (disk / ROOT.relative_to("/") / "out").mkdir()
    for word in re.findall(r"[^\s;'\"]+", " ".join(command)):
        path = Path(os.path.abspath(word))
        if path.is_file() and path.is_relative_to(ROOT) and not path.is_relative_to(ROOT / ".venv"):
            copy(path, disk)
    python = Path(sys.base_prefix)
    (disk / python.relative_to("/") / "bin").mkdir(parents=True)
    for path in (python / "bin").glob("python*"):
        if not path.name.endswith("config"):
            shutil.copy(path, disk / path.relative_to("/"), follow_symlinks=False)
    library = python / "lib" / f"python3.{sys.version_info.minor}"
    copy(library, disk, skip=("site-packages", "test", "idlelib", "tkinter", "ensurepip", "__pycache__", "config-*"))
    for path in (python / "lib").glob("libpython*"):
        copy(path, disk)
    copy(ROOT / ".venv", disk, skip=("pxr", "usd*", "MaterialX*", "materialx*", "pip*", "setuptools*", "ruff*"))
    copy_libraries(disk)
    lines = "\n".join(f"export {name}={shlex.quote(value)}" for name, value in exports.items())
    start = disk / "start"
    start.write_text(START.format(folder=ROOT, exports=lines, command=shlex.join(command)))
    start.chmod(0o755)


def make_disk(folder: Path, command: list[str], exports: dict[str, str]) -> None:
    content = folder / "content"
    content.mkdir()
    fill_disk(content, command, exports)
    size = int(call("du", "-sm", content).split()[0])
    call("/sbin/mke2fs", "-q", "-t", "ext4", "-d", content, folder / "disk", f"{size * 5 // 4 + 256}M")
    shutil.rmtree(content)


def run(folder: Path, seconds: float) -> None:
    """Until it turns itself off; prints what the command says as it comes."""
    (folder / "machine").write_text(MACHINE)
    (folder / "debugger").write_text("c\n")  # Debian's waits for its debugger's word
    machine = subprocess.Popen(
        ["bochs", "-q", "-f", "machine", "-rc", "debugger"],
        cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, process_group=0,
    )  # fmt: skip
    said, shown, end = folder / "said", 0, time.monotonic() + seconds
    try:
        while machine.poll() is None:
            time.sleep(1)
            text = said.read_text(errors="replace") if said.exists() else ""
            if begun := re.search(r"^BEGIN\s*\n", text, re.MULTILINE):
                print(text[max(shown, begun.end()) :], end="", flush=True)
                shown = len(text)
            if time.monotonic() > end:
                print(f"\nemulate_avx512: stopped after {seconds:.0f} s", file=sys.stderr)
                break
    finally:
        if machine.poll() is None:
            os.killpg(machine.pid, signal.SIGKILL)
            machine.wait()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=3600, help="when to stop it (3600)")
    parser.add_argument("--show", type=Path, metavar="FILE", help="what the machine said, from its start on")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="of the environment")
    parser.add_argument("command", nargs=argparse.REMAINDER)
    arguments = parser.parse_args()
    if not arguments.command:
        parser.error("which command?")
    if wrong := [each for each in arguments.set if "=" not in each]:
        parser.error(f"--set {wrong[0]}: NAME=VALUE is expected")
    check_needed()
    exports = {"HOME": "/root", "PATH": "/bin:/usr/bin", "PYTHONPATH": str(ROOT / "python")}
    exports |= dict(each.split("=", 1) for each in arguments.set)
    KEPT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=KEPT) as made:
        folder = Path(made)
        make_start(folder, kernel())
        make_disk(folder, arguments.command, exports)
        print("emulate_avx512: the machine starts, for some three minutes; Python takes four more", file=sys.stderr)
        run(folder, arguments.seconds)
        text = (folder / "said").read_text(errors="replace")
        if arguments.show:
            arguments.show.write_text(text)
        (folder / "back").mkdir()
        call("/usr/sbin/debugfs", "-R", f"rdump {ROOT / 'out'} {folder / 'back'}", folder / "disk")
        shutil.copytree(folder / "back/out", ROOT / "out", dirs_exist_ok=True)
    ended = re.search(r"^END (\d+)", text, re.MULTILINE)
    if not ended:
        print(f"emulate_avx512: the command did not end; the machine's last words:\n{text[-2000:]}", file=sys.stderr)
        return 1
    return int(ended[1])


if __name__ == "__main__":
    sys.exit(main())
