"""Random calls of the Python API with bad shapes, types and numbers, to pixels.

    .venv/bin/python tests/fuzz/python_fuzz.py --count 10000 --keep FOLDER
    .venv/bin/python tests/fuzz/python_fuzz.py --first SEED --count 1 --print

A case is its seed. Each runs in a forked worker: a signal, more than 30 s of processor time or 4 GB, or an exception
that does not say what to mend, is a find. The calls of a case are written down as they are made, so a find can be read.
Under sanitizers: tools/sanitize.sh says how the module is built and found.
"""

from __future__ import annotations

import argparse
import math
import mmap
import os
import random
import resource
import signal
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path

# Of processor time, since other work on the machine is none of the case's; ten times as long by the clock.
SECONDS, BYTES = 30.0, 4 << 30
# What a user is told with. Others are defects.
CLEAR = (ValueError, TypeError, OverflowError)


class Case:
    """One scene made by a seed; `calls` is what it did."""

    def __init__(self, seed: int, log: Callable[[str], None]) -> None:
        import numpy as np

        import kanuka

        self.kanuka, self.np, self.log = kanuka, np, log
        self.random = random.Random(seed)
        self.pictures = 0
        self.scene = kanuka.Scene()
        self.groups: list = []
        self.materials: list = [None]

    def number(self) -> float:
        r = self.random
        return r.choice(
            [0, 1, -1, 0.5, 2, 1e-30, 1e15, 1e30, -1e30, 3.4e38, math.nan, math.inf, -math.inf, 1e-7, 180, 360]
            if r.random() < 0.3
            else [r.uniform(-2, 2)]
        )

    def floats(self, *shape: int) -> object:
        """An array, now and then of another shape, type or layout than asked for."""
        np, r = self.np, self.random
        dims = list(shape)
        if r.random() < 0.1:
            dims[r.randrange(len(dims))] = r.choice([0, 1, 2, 5, 1000])
        if r.random() < 0.05:
            dims.append(r.choice([0, 1, 3]))
        a = np.array([r.uniform(-1.5, 1.5) for _ in range(int(np.prod(dims)))]).reshape(dims)
        for _ in range(r.choice([0, 0, 1, 3])):
            if a.size:
                a.flat[r.randrange(a.size)] = self.number()
        with np.errstate(all="ignore"):
            kind = r.choice(["float32"] * 8 + ["float64", "float16", "int32", "bool", "complex64", "object", "U5"])
            a = a.astype(kind)
        how = r.randrange(12)
        if how == 0:
            return a.tolist()
        if how == 1 and a.ndim:
            return a[::-1]
        if how == 2:
            return np.asfortranarray(a)
        if how == 3:
            return memoryview(np.ascontiguousarray(a)) if a.dtype != object else a
        if how == 4:
            return r.choice([None, "text", 3, {}, [[1, 2], [3]], object()])
        return a

    def mesh(self) -> tuple:
        np, r = self.np, self.random
        n = r.choice([3, 4, 8, 8, 30])
        sides = r.choice([3, 4, 4, 5])
        faces = np.array([[r.randrange(n) for _ in range(sides)] for _ in range(r.choice([1, 2, 6, 20]))], "int32")
        if r.random() < 0.1:
            faces.flat[r.randrange(faces.size)] = r.choice([-1, n, 2**31 - 1, -(2**31)])
        return self.floats(n, 3), (faces if r.random() < 0.95 else self.floats(4, 3)), n, len(faces), sides

    def looks(self) -> dict:
        r, out = self.random, {}
        if r.random() < 0.5:
            out["material"] = r.choice(self.materials)
        if r.random() < 0.4:
            out["transform"] = r.choice(
                [self.floats(4, 4), self.floats(2, 4, 4), self.np.diag([self.number()] * 3 + [1])]
            )
        if r.random() < 0.2:
            out["area_light"] = r.choice([(1, 1, 1), self.floats(3), self.number(), "light", None])
        if r.random() < 0.2:
            out["shading_rate"] = r.choice([self.number(), 1, 1e-9])
        if r.random() < 0.2:
            out["variants"] = r.choice([1, 2, 3, 64, 65, 0, self.number()])
        if r.random() < 0.1:
            out["times"] = r.choice([[0, 1], [1, 0], self.floats(2)])
        if r.random() < 0.1:
            out["name"] = r.choice(["a", "\udcff", "\0", "x" * 5000])
        return out

    def primvars(self, n: int, faces: int, sides: int) -> dict:
        r = self.random
        key = r.choice(
            ["Cs", "N", "int k", "uniform float w", "facevarying float[2] st", "string s", "float[1000000000] f", "",
             "vertex color Cs", "matrix m", "constant color Cs", "float[-1] x", "hpoint q", "width"]
        )  # fmt: skip
        rows = r.choice([n, faces, faces * sides, 1, 7])
        return {key: r.choice([self.floats(rows, r.choice([1, 2, 3, 16])), self.floats(rows), "text", None])}

    # ---- calls

    def owner(self) -> object:
        return self.random.choice([self.scene, *self.groups])

    def add_mesh(self) -> None:
        r = self.random
        points, faces, n, count, sides = self.mesh()
        more = self.looks()
        if r.random() < 0.3:
            more["primvars"] = self.primvars(n, count, sides)
        if r.random() < 0.2:
            more["normals"] = self.floats(n, 3)
        if r.random() < 0.2:
            more["uv"] = self.floats(n, 2)
        if r.random() < 0.1:
            more["counts"] = [sides] * count
        self.owner().add_mesh(points, faces, **more)
        self.spoil(points)

    def spoil(self, array: object) -> None:
        """What happens to an array afterwards is nothing to the scene."""
        if isinstance(array, self.np.ndarray) and array.base is None and self.random.random() < 0.3:
            array.resize(self.random.choice([0, 3, 100000]), refcheck=False)

    def add_mapped(self) -> None:
        np = self.np
        name = f"/tmp/kanuka-fuzz-{os.getpid()}.bin"
        with open(name, "w+b") as file:
            file.write(np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], "float32").tobytes() * 1000)
            file.flush()
            mapped = mmap.mmap(file.fileno(), 0)
            points = np.frombuffer(mapped, "float32").reshape(-1, 3)
            self.owner().add_mesh(points, np.arange(3000, dtype="int32").reshape(-1, 3))
            os.truncate(name, 0)
        os.unlink(name)

    def add_subdivision(self) -> None:
        r = self.random
        points, faces, n, count, sides = self.mesh()
        more = self.looks()
        if r.random() < 0.3:
            more["creases"], more["crease_sharpness"] = [[0, 1], [r.randrange(-2, n + 2), 2]], [self.number(), 3]
        if r.random() < 0.2:
            more["scheme"] = r.choice(["loop", "bilinear", "catmull-clark", "none", ""])
        if r.random() < 0.2:
            more["holes"] = [r.randrange(-1, count + 1)]
        if r.random() < 0.2:
            more["primvars"] = self.primvars(n, count, sides)
        self.owner().add_subdivision(points, faces, **more)

    def add_sphere(self) -> None:
        self.owner().add_sphere(abs(self.number()) or 1, **self.looks())

    def add_group(self) -> None:
        self.groups.append(self.scene.add_group("g"))

    def add_instances(self) -> None:
        if self.groups:
            r, more = self.random, {}
            for name, each in (("variant", ()), ("tint", (3,)), ("roughness", ())):
                if r.random() < 0.3:
                    more[name] = self.floats(r.choice([2, 3]), *each) if r.random() < 0.7 else self.number()
            if r.random() < 0.2:
                more["unique"] = True
            where = r.choice([self.floats(3, 3, 4), self.floats(2, 4, 4), self.floats(2, 3, 3, 4)])
            self.owner().add_instances(r.choice(self.groups), where, **more)

    def add_light(self) -> None:
        r, more = self.random, {}
        for name in ("amount", "position", "direction"):
            if r.random() < 0.4:
                more[name] = self.floats(3)
        for name in ("angle", "cone_angle", "cone_delta_angle", "beam_distribution", "radius", "width", "height"):
            if r.random() < 0.2:
                more[name] = self.number()
        texts = {
            "spectrum": ["D65", "nonsense", "blackbody 1e30", None, 3],
            "unit": ["lumen", "lux", "x", ""],
            "texture": ["none.exr", "", "\0"],
            "profile": ["none.ies"],
        }
        for name, values in texts.items():
            if r.random() < 0.15:
                more[name] = r.choice(values)
        kinds = ["distant", "point", "spot", "environment", "ambient", "quad", "disk", "sphere", "cylinder", "x"]
        self.scene.add_light(r.choice(kinds), **more)

    def add_material(self) -> None:
        r = self.random
        name = r.choice(
            ["matte", "plastic", "glass", "principled", "metal", "cloud", "emitter", "missing", "", "\udcff"]
        )
        values: dict = {}
        for key in r.sample(
            ["Ks", "roughness", "color", "opacity", "ior", "transmission", "parameters", "displacement"], 2
        ):
            values[key] = r.choice(
                [self.number(), self.floats(3), "D65", "nonsense", None, (1, 1, 1), [], {"float x": 1}]
            )
        self.materials.append(self.kanuka.Material(name, **values))

    def set_camera(self) -> None:
        r, k = self.random, self.kanuka
        more = {"fov": self.number()} if r.random() < 0.3 else {}
        self.scene.camera = r.choice(
            [lambda: k.Camera(self.floats(3), self.floats(3), self.floats(3), **more),
             lambda: k.Camera((0, 0, 4), (0, 0, 0), (0, 1, 0), **more),
             lambda: k.Camera.from_matrix(self.floats(4, 4))]
        )()  # fmt: skip

    def set_option(self) -> None:
        r, o = self.random, self.scene.options
        name = r.choice([n for n in dir(o) if not n.startswith("_") and n != "displays"])
        numbers = [self.number(), r.choice([0, 1, 2, -1, 2**31 - 1]), (self.number(), self.number()), (0, 1, 0, 1)]
        value = r.choice([*numbers, "", "x", True, None, [], ["/nowhere"]])
        if name in ("samples", "max_depth", "volume_depth", "array_room") and isinstance(value, int):
            value = min(value, 64)
        setattr(o, name, value)

    def run(self) -> None:
        r, k = self.random, self.kanuka
        self.scene.camera = k.Camera((0, 0.5, 4), (0, 0, 0), (0, 1, 0))
        calls = [self.add_mesh] * 4 + [self.add_subdivision] * 2 + [self.add_sphere, self.add_group, self.add_instances,
                 self.add_light, self.add_material, self.set_camera, self.set_option, self.add_mapped]  # fmt: skip
        for _ in range(r.randrange(1, 9)):
            call = r.choice(calls)
            self.attempt(call.__name__, call)
        more: dict = {"threads": r.choice([1, 1, 1, 2, 0, -3, 2_000_000_000])}
        if r.random() < 0.1:
            more["resolution"] = r.choice([(0, 1), (30000, 30000), (-1, 5), (2**31 - 1, 2**31 - 1), (1, 1), (40, 2)])
        if r.random() < 0.1:
            more["crop"] = [self.number() for _ in range(4)]
        if r.random() < 0.1:
            more["integrator"] = r.choice(["path", "ao", "facing", "none", "ao:distance=nan", "\udcff"])
        if r.random() < 0.1:
            more["shading_rate"] = self.number()
        if r.random() < 0.1:
            more["progress"] = lambda *_: self.attempt("add_mesh while rendering", self.add_mesh)
        more = {"resolution": (16, 12), "progressions": 1} | more
        picture = self.attempt(f"render {more}", lambda: k.render(self.scene, **more))
        if picture is not None and not picture.cancelled:
            self.pictures += 1
            rgb = picture["rgb"]
            assert self.np.isfinite(rgb).all(), "pixels that are not finite"
            str([str(m) for m in picture.journal])

    def attempt(self, what: str, call: Callable) -> object:
        self.log(what)
        try:
            return call()
        except (*CLEAR, self.kanuka.Error) as error:
            self.log(f"    {type(error).__name__}: {error}")
        except RuntimeError as error:
            if "is being rendered" not in str(error):
                raise
        return None


def resident(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")
    except (OSError, IndexError):
        return 0


def work_of(pid: int) -> float:
    """Processor time so far, in seconds."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError):
        return 0.0


class Board:
    """What worker and parent share: the case that runs, when it began, and what came of all."""

    NAMES = ("seed", "began", "worked", "found", "pictures")

    def __init__(self) -> None:
        self.memory = mmap.mmap(-1, 4096)

    def __getattr__(self, name: str) -> float:
        return struct.unpack_from("<d", self.memory, 8 * self.NAMES.index(name))[0]

    def put(self, **values: float) -> None:
        for name, value in values.items():
            struct.pack_into("<d", self.memory, 8 * self.NAMES.index(name), value)


def run_worker(seeds: range, board: Board, keep: Path | None, show: bool) -> None:
    """Runs cases one by one; the number of the one that runs stands on the board."""
    import warnings

    warnings.simplefilter("ignore")
    for seed in seeds:
        board.put(seed=seed, began=time.monotonic(), worked=time.process_time())
        calls: list[str] = []

        def log(text: str, calls: list[str] = calls) -> None:
            calls.append(text)
            if show:
                print(text, flush=True)

        try:
            case = Case(seed, log)
            case.run()
            board.put(pictures=board.pictures + (case.pictures > 0))
        except BaseException as error:
            print(f"seed {seed}: FOUND: {type(error).__name__}: {error} after {calls[-1:]}", flush=True)
            board.put(found=board.found + 1)
            if keep:
                (keep / f"python_{seed}.txt").write_text("\n".join(calls), errors="backslashreplace")
    os._exit(0)


def run(first: int, count: int, keep: Path | None = None, show: bool = False, seconds: float = SECONDS) -> int:
    """Returns how many cases fell."""
    board = Board()
    found, at, end = 0, first, first + count
    while at < end:
        board.put(began=time.monotonic(), worked=0)
        child = os.fork()
        if child == 0:
            run_worker(range(at, end), board, keep, show)
        why = ""
        while True:
            time.sleep(0.05)
            pid, status = os.waitpid(child, os.WNOHANG)
            if pid:
                break
            if work_of(child) - board.worked > seconds or time.monotonic() - board.began > 10 * seconds:
                why = f"more than {seconds:g} s"
            elif resident(child) > BYTES:
                why = "more than 4 GB"
            if why:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)
                break
        if not why and os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0:
            break
        seed = int(board.seed)
        why = why or (f"signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else f"exit {os.WEXITSTATUS(status)}")
        print(f"seed {seed}: FOUND: {why}", flush=True)
        found += 1
        at = seed + 1
    found += int(board.found)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"python: {count} cases from seed {first}, {int(board.pictures)} with pictures, "
        f"{used.ru_utime + used.ru_stime:.0f} s of processor time, {found} found",
        flush=True,
    )
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--print", action="store_true", dest="show")
    arguments = parser.parse_args()
    if arguments.keep:
        arguments.keep.mkdir(parents=True, exist_ok=True)
    return min(1, run(arguments.first, arguments.count, arguments.keep, arguments.show, arguments.seconds))


if __name__ == "__main__":
    sys.exit(main())
