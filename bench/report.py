"""From results.json to pages: RESULTS.md, the console, and the figures that stand in docs/.

    python bench/report.py --write-docs      puts today's figures between the markers of README.md and docs/
    python bench/report.py --check           says where they are not

Markers are `<!-- bench: NAME -->` … `<!-- /bench -->` around a table of tables.py, and
`<!-- figure: PART:PATH -->` … `<!-- /figure -->` around one number of results.json.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

import tables
from goals import all_goals
from results import Results, replace
from settings import ROOT

TABLE = re.compile(r"(<!-- bench: ([\w-]+) -->\n).*?(<!-- /bench -->)", re.S)
FIGURE = re.compile(r"(<!-- figure: ([^ ]+) -->).*?(<!-- /figure -->)", re.S)
HEADINGS = {
    "goals": ("Goals", "*Undecided*: the 95 % interval of the rounds holds the limit."),
    "side-by-side": (
        "Side by side",
        "After the semicolon: our figure over theirs, and the 95 % interval of rounds in pairs; below 1, Kanuka takes "
        "less. *Render*: sampling alone, kernels compiled and the scene built. *First picture*: reading, building and "
        "one sample a pixel. *Error*: relative, squared, against the mean of the renderer's other rounds.",
    ),
    "agreement": ("The same picture?", ""),
    "micropolygons": ("Micropolygons", ""),
    "dice": ("Dicing", "Evaluated, joined, simplified; no displacement, no shading."),
    "hierarchy": (
        "Rays through pages",
        "Pages of src/hierarchy beside Embree on the same vertices; camera rays go to Embree in packets of eight.",
    ),
    "instances": ("A million instances", ""),
    "moving": (
        "What moves, and what changes",
        "A hundred thousand balls of 6144 micropolygons, two units wide: straight by up to half their size, turning by "
        "20 degrees as well, far by up to twice their size and by 60. Waves travel by 16 cells of a terrain. Rays at "
        "random times, and all at one.",
    ),
    "rays": (
        "A thousand million rays",
        "From inside of closed surfaces: a third goes anywhere, a third to vertices, a third to points of edges. A "
        "leak hits nothing, by a search for the closest hit or for any. Where the two tracers differ by more than "
        "rounding of a distance, all triangles in doubles say who is right; both: within the rounding of edges.",
    ),
    "rib": ("Reading RIB", ""),
    "hair": ("Hair", ""),
    "delayed": ("Delayed archives", ""),
    "networks": ("Shader networks", "From an empty cache to the last pixel."),
    "shaders": ("The shader compiler", "Without AVX-512, 16 lanes lie in two registers."),
    "lights": ("Lights", ""),
    "lanes": ("Lanes", ""),
    "widths": ("Lanes on whole pictures", ""),
    "watertight": ("Hits without gaps", ""),
    "wavelengths": ("Wavelengths", ""),
    "tolerance": ("Geometry tolerance", ""),
    "stages": ("Scenes of scenes/", ""),
    "store": (
        "The store",
        "Until rays can be traced: without a store, while one is filled, and with what it holds then, read from the "
        "system's memory.",
    ),
    "edits": ("Edits", "Until rays can be traced again; times the first making of the same round."),
    "shots": (
        "Shots",
        "A slow camera in a scene that stands still: all frames until rays can be traced, reading left out.",
    ),
    "flight": (
        "A flight through a forest",
        "Frames, each diced for its own camera (alone), and all for one shot. Variance: of pixels' second "
        "differences in time, over that of a reference that is diced once and four times as finely; noise is taken out "
        "by a second seed. Jump: the most that the mean of 8 × 8 pixels changes by from one frame to the next and the "
        "reference's does not, of the mean of the picture.",
    ),
    "oracle": (
        "The dicing oracle",
        "A street, and what stands behind its houses. Until rays can be traced, reading left out; the record serves "
        "all renders.",
    ),
    "kills": (
        "Killed a hundred times",
        "At random moments, with a store and a checkpoint; each render goes on from what is left.",
    ),
    "budgets": (
        "Budgets of memory",
        "Geometry and hierarchy within a part of what they take, each render a process of its own. Peak: above what "
        "the process has before it renders. The system keeps what was given back as long as it has room.",
    ),
    "levels": (
        "Levels of detail of instances",
        "Displaced rocks from near by to the horizon, `instance_levels` at 1 over 0: near fills the picture with what "
        "is near, far by a narrow lens with the rest, and budget is far within that. Times are of the processor.",
    ),
    "nesting": (
        "Instances in instances",
        "The same knots at the same places, one to six groups deep in each other; in Embree, and in pages of our own. "
        "CPU time of samples of the same sessions, in turn.",
    ),
    "isles": (
        "Instances upon instances",
        "1024 × 429 pixels, five bounces. Read and the first picture are from the start; bytes an instance are the "
        "difference to the same scene with the 64 placements of each exemplar that the camera sees largest.",
    ),
    "ingest": (
        "Reading USD",
        "Beside USD's own Python, which opens the stage and gets the same arrays and matrices; the ratio is of "
        "processor time.",
    ),
    "taken": ("Where it comes from", "Load: of the last minute, before and after; a renderer's own threads are in it."),
}


def page(results: Results) -> str:
    parts = [
        "# Results\n",
        "Made by `bench/run.py` from `results.json`; `docs/bench.md` says what is measured and how. Figures of two "
        "machines or of two runs do not compare.\n",
    ]
    if any(part["taken"]["quick"] for part in results.parts.values()):
        parts.append("**A quick run: small pictures and scenes. It shows that all works, not how fast it is.**\n")
    for name, (title, text) in HEADINGS.items():
        made = tables.TABLES[name](results)
        parts += [f"## {title}\n", made + "\n"] + ([text + "\n"] if text else [])
    return "\n".join(parts)


def console(results: Results) -> str:
    return "\n".join(f"{g.verdict:<10} {g.name}: {g.measured} (goal {g.goal})" for g in all_goals(results))


def write(results: Results, folder: Path) -> None:
    replace(folder / "RESULTS.md", page(results))


# ---- docs


def pages() -> list[Path]:
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def renewed(text: str, results: Results) -> str:
    """A page with what its markers ask for; an unknown table or figure is a KeyError."""

    def figure(match: re.Match) -> str:
        value = results.look_up(match[2])
        name = re.split(r"[.:]", match[2])[-1]
        return match[1] + (tables.NOT_MEASURED if value is None else tables.show(name, value)) + match[3]

    text = TABLE.sub(lambda m: m[1] + tables.TABLES[m[2]](results) + "\n" + m[3], text)
    return FIGURE.sub(figure, text)


def write_docs(results: Results) -> None:
    for path in pages():
        text = path.read_text()
        made = renewed(text, results)
        if made != text:
            replace(path, made)
            print(path.relative_to(ROOT))


def differing(results: Results) -> list[Path]:
    return [path for path in pages() if renewed(text := path.read_text(), results) != text]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write-docs", action="store_true")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    results = Results(ROOT / "bench" / "results.json")
    write(results, ROOT / "bench")
    if arguments.write_docs:
        write_docs(results)
    stale = differing(results) if arguments.check else []
    for path in stale:
        print(f"{path.relative_to(ROOT)}: bench/report.py --write-docs")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
