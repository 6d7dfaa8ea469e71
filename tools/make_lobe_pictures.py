"""Makes docs/images/lobes: a row of five balls for every lobe of docs/lobes.md, or for those named."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import doc_pictures

for name in sys.argv[1:] or doc_pictures.lobes():
    doc_pictures.draw_row(name)
