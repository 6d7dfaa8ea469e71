"""The manual as a site (manual/): all links lead somewhere, and the reference names what the package has."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
commands = pytest.importorskip("mkdocs.commands.build")
config = pytest.importorskip("mkdocs.config")
sys.path.insert(0, str(ROOT / "manual"))
import reference  # noqa: E402

import kanuka  # noqa: E402


def test_the_site_is_built_without_a_warning(tmp_path):
    gallery = {"longest": 48, "progressions": 1, "scenes": ["cornell", "shapes"]}
    file = str(ROOT / "manual" / "mkdocs.yml")
    commands.build(config.load_config(file, strict=True, site_dir=str(tmp_path), extra={"gallery": gallery}))
    front = (tmp_path / "index.html").read_text()
    assert "shade before hit" in front and "images/showcase.png" in front
    assert "gallery/cornell.png" in (tmp_path / "gallery.html").read_text()
    assert (tmp_path / "gallery" / "shapes.png").stat().st_size > 500
    assert "add_mesh" in (tmp_path / "reference.html").read_text()
    pages = {page.stem for page in (ROOT / "docs").glob("*.md")}
    assert pages <= {page.stem for page in tmp_path.glob("*.html")}


def test_the_reference_has_all_that_the_package_exports():
    page = reference.page()
    exceptions = ("Error", "Warning")  # of the compiled module, without a stub
    wanted = [name for name in kanuka.__all__ if not name.startswith("_") and name not in exceptions]
    missing = [name for name in wanted if f"### {name}\n" not in page and f"## kanuka.{name}\n" not in page]
    assert missing == []


def test_long_signatures_have_a_line_a_parameter():
    page = reference.page()
    assert "\n    progressions: int | None = None,\n" in page
    assert "self" not in page.split("## kanuka.usd")[0].split("### Scene")[1].split("```")[1]
