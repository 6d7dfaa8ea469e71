"""An island with the numbers of the public Moana data set, at any scale.

    python scenes/motu/make.py --scale 0.01 -o out/motu          writes a folder of arrays
    python scenes/motu/make.py --scale 1 --count                 tells how much there would be
    python scenes/motu/make.py --render shore.exr -o out/motu    makes a picture of what the folder holds

The folder is read by kit.sinks.read(); scenes/README.md says what is in it, and why it is no RIB.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import kanuka
from kit import sinks
from motu import plan, scene
from motu.cameras import CAMERAS


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scale", type=float, help=f"{plan.LEAST} to {plan.MOST:g}; 1 is the whole island (0.01)")
    parser.add_argument("--seed", type=int, help="another seed, another island (1)")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/motu"), help="folder (out/motu)")
    parser.add_argument("--count", action="store_true", help="print the numbers, and make nothing")
    parser.add_argument("--render", type=Path, metavar="PICTURE", help="render the folder; EXR or PNG")
    parser.add_argument("--camera", choices=list(CAMERAS), default="shore")
    parser.add_argument("--resolution", default="1024x429", metavar="WxH")
    parser.add_argument("--progressions", type=int, default=16, help="paths a pixel")
    parser.add_argument("--threads", type=int)
    given = parser.parse_args(arguments)
    if given.scale is not None and not plan.LEAST <= given.scale <= plan.MOST:
        parser.error(f"--scale {given.scale}: from {plan.LEAST} to {plan.MOST:g}")
    if given.seed is not None and given.seed < 0:
        parser.error("--seed: from 0 on")
    return given


def tell(numbers: dict[str, object]) -> None:
    for name, value in numbers.items():
        print(f"{name:<12} {value:>16,}" if isinstance(value, int) else f"{name:<12} {value:>16g}")


def there(given: argparse.Namespace) -> bool:
    """Does the folder hold what is asked for? What is not said may be anything."""
    if not (given.output / "index.json").is_file():
        return False
    about = sinks.index_of(given.output)["about"]
    return all(value in (None, about.get(name)) for name, value in (("scale", given.scale), ("seed", given.seed)))


def main(arguments: list[str] | None = None) -> int:
    given = parse(arguments)
    scale, seed = given.scale or 0.01, 1 if given.seed is None else given.seed
    if given.count:
        tell(scene.count(scale, seed).told())
        return 0
    wanted = {"scene": "motu", "scale": scale, "seed": seed}
    if not (given.render and there(given)):
        start = time.time()
        folder = sinks.Folder(given.output, wanted)
        folder.about["numbers"] = scene.build(folder, scale, seed).told()
        folder.close()
        tell(folder.about["numbers"])
        size = sum(file.stat().st_size for file in given.output.iterdir())
        print(f"{given.output}: {size / 1e6:.0f} MB in {time.time() - start:.1f} s")
    if given.render:
        island, _ = sinks.read(given.output)
        scene.staged(island, given.camera)
        width, height = (int(word) for word in given.resolution.split("x"))
        island.resolution = width, height
        kanuka.render(island, progressions=given.progressions, threads=given.threads).write(given.render)
    return 0


if __name__ == "__main__":
    sys.exit(main())
