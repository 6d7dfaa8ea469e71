"""The layer check finds each kind of breach, says where, and passes this repository."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest


def check(root: Path, tree: Path) -> subprocess.CompletedProcess[str]:
    script = root / "tools" / "check_layers.py"
    return subprocess.run([sys.executable, script, tree], capture_output=True, text=True)


def write(tree: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        path = tree / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def test_this_repository_is_clean(root: Path) -> None:
    result = check(root, root)
    assert result.returncode == 0, result.stdout
    assert "0 breaches" in result.stdout
    files = int(result.stdout.split("layers: ")[1].split(" files")[0])
    assert files > 20, "the check must have read the sources"


def test_downward_includes_pass(root: Path, tmp_path: Path) -> None:
    write(
        tmp_path,
        {
            "src/base/a.h": "#pragma once\n#include <vector>\n",
            "src/grid/b.h": '#include "base/a.h"\n',
            "src/sl/codegen/c.cpp": '#include <llvm/IR/Module.h>\n#include "grid/b.h"\n#include "d.h"\n',
            "src/sl/codegen/d.h": "",
            "include/kanuka/api.h": "",
            "src/render/r.cpp": "#include <kanuka/api.h>\n",
            "plugins/integrators/p.cpp": '#include "transport/t.h"\n#include <kanuka/api.h>\n',
            "src/transport/t.h": "",
        },
    )
    result = check(root, tmp_path)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize(
    ("files", "place", "word"),
    [
        ({"src/base/a.h": '\n#include "grid/b.h"\n', "src/grid/b.h": ""}, "src/base/a.h:2", "higher level"),
        ({"src/color/a.h": '#include "grid/b.h"\n', "src/grid/b.h": ""}, "src/color/a.h:1", "own level"),
        ({"src/shade/a.cpp": '// x\nauto v = a.user.find("light:nsamples");\n'}, "src/shade/a.cpp:2", "a name of RIB"),
        ({"src/sl/a.cpp": "#include <llvm/IR/Module.h>\n"}, "src/sl/a.cpp:1", "src/sl/codegen"),
        ({"src/render/a.cpp": "// x\n#include <embree3/rtcore.h>\n"}, "src/render/a.cpp:2", "src/bvh"),
        (
            {"src/geom/a.cpp": "#include <OpenImageIO/texture.h>\n"},
            "src/geom/a.cpp:1",
            "src/shade and src/film",
        ),
        ({"src/odd/a.h": ""}, "src/odd/a.h:1", "has no level"),
        (
            {"src/grid/a.h": '#include "grid/b.h"\n', "src/grid/b.h": '#include "grid/a.h"\n'},
            "src/grid/b.h:1",
            "include circle: src/grid/a.h -> src/grid/b.h -> src/grid/a.h",
        ),
        (
            {"plugins/x/a.cpp": '#include "scene/s.h"\n', "src/scene/s.h": ""},
            "plugins/x/a.cpp:1",
            "a plug-in includes",
        ),
        (
            {"plugins/x/a.cpp": '#include "../y/b.h"\n', "plugins/y/b.h": ""},
            "plugins/x/a.cpp:1",
            "a plug-in includes plugins/y/b.h",
        ),
        (
            {"include/kanuka/a.h": '#include "base/b.h"\n', "src/base/b.h": ""},
            "include/kanuka/a.h:1",
            "public header",
        ),
    ],
)
def test_breaches_are_found(root: Path, tmp_path: Path, files: dict[str, str], place: str, word: str) -> None:
    write(tmp_path, files)
    result = check(root, tmp_path)
    assert result.returncode == 1
    assert place + ":" in result.stdout
    assert word in result.stdout
    assert "1 breaches" in result.stdout
