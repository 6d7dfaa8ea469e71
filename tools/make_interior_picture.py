"""Makes docs/images/interiors.png: fog, milk, skin, and a glass with a drink in it, in a row."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import doc_pictures

doc_pictures.draw(
    doc_pictures.IMAGES / "interiors.png",
    lambda folder: doc_pictures.write_interiors(folder, (640, 200, 12)),
    *sys.argv[1:],
)
