"""What the build of the manual adds to docs/: the front page, the Python reference and the gallery."""

from __future__ import annotations

import posixpath
import re
import subprocess
import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "manual"))
import reference  # noqa: E402  (MkDocs runs this file by itself)

# What each scene shows.
GALLERY = {
    "showcase": "Metals with measured spectra, glass with dispersion, displaced ground, instances, a sky",
    "cornell": "Cornell's box: diffuse light between walls",
    "shapes": "Primitives: quadrics, patches, trimmed NURBS, subdivision surfaces, curves, points, blobbies",
    "solids": "Set operations on solids",
    "volumes": "Media that absorb, scatter and vary",
    "listings": "Shaders of the language's examples",
}
PROCEDURALS = {"grove": "A grove of trees and grass, grown by procedurals", "fur": "Fur of curves", "cloth": "Cloth"}
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


def scenes() -> dict[str, tuple[Path, str]]:
    found = {name: (ROOT / "scenes" / f"{name}.rib", about) for name, about in GALLERY.items()}
    found |= {name: (ROOT / "scenes" / "procedurals" / f"{name}.rib", about) for name, about in PROCEDURALS.items()}
    return {name: each for name, each in found.items() if "WorldBegin" in each[0].read_text()}


def size_of(scene: Path, longest: int) -> str:
    """In the shape that the scene asks for, by `longest` pixels."""
    found = re.search(r"^\s*Format\s+(\d+)\s+(\d+)", scene.read_text(), re.M)
    width, height = (int(found[1]), int(found[2])) if found else (640, 480)
    return "x".join(str(max(1, round(side * longest / max(width, height)))) for side in (width, height))


def render(name: str, scene: Path, longest: int, progressions: int) -> Path:
    """The picture of a scene; rendered where there is none that is newer than it."""
    size = size_of(scene, longest)
    picture = ROOT / "build" / "manual" / f"{name}-{size}-{progressions}.png"
    if picture.exists() and picture.stat().st_mtime > scene.stat().st_mtime:
        return picture
    picture.parent.mkdir(parents=True, exist_ok=True)
    asked = ["-o", picture, "--resolution", size, "--progressions", progressions, "-qq"]
    command = [sys.executable, "-m", "kanuka", "render", scene, *asked]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode != 0 or not picture.exists():
        raise RuntimeError(f"the gallery's {scene.name} does not render:\n{done.stderr[-1000:]}")
    return picture


def front_page() -> str:
    """README.md, whose links into docs/ become links to pages."""
    return re.sub(r"\]\(docs/(?=[^)]*\.(?:md|png|jpg))", "](", (ROOT / "README.md").read_text())


def on_files(files: Files, config: MkDocsConfig) -> Files:
    def add(uri: str, content: str | bytes) -> None:
        files.append(File.generated(config, uri, content=content))

    asked = config.extra["gallery"]
    gallery = ["# Gallery\n", f"Rendered as this site was built: {asked['progressions']} samples a pixel.\n"]
    for name, (scene, about) in scenes().items():
        if name not in asked.get("scenes", [name]):
            continue
        picture = render(name, scene, asked["longest"], asked["progressions"])
        add(f"gallery/{name}.png", picture.read_bytes())
        gallery.append(f"![{about}](gallery/{name}.png)\n\n{about}: `{scene.relative_to(ROOT)}`\n")
    add("gallery.md", "\n".join(gallery))
    add("reference.md", reference.page())
    add("index.md", front_page())
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Links to what is no page, such as sources and scenes, become names of files."""
    folder = posixpath.dirname(page.file.src_uri)
    top = "" if page.file.src_uri == "index.md" else "docs"

    def mended(match: re.Match) -> str:
        image, text, target = match.groups()
        path, _, _ = target.partition("#")
        if "://" in target or not path or target.startswith("mailto:"):
            return match[0]
        if files.get_file_from_path(posixpath.normpath(posixpath.join(folder, path))):
            return match[0]
        at = posixpath.normpath(posixpath.join(top, folder, path))
        if image or not (ROOT / at).exists():
            return match[0]  # broken: MkDocs says so
        return text if text.strip("`") == at else f"{text} (`{at}`)"

    outside_code = re.split(r"(^```.*?^```|`[^`\n]+`)", markdown, flags=re.S | re.M)
    return "".join(part if k % 2 else LINK.sub(mended, part) for k, part in enumerate(outside_code))
