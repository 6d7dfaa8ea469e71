"""What the manual says works as it stands: Python blocks are run, commands are parsed, tables are as declared."""

from __future__ import annotations

import importlib.util
import re
import shlex
import warnings
from pathlib import Path

import pytest

import kanuka
from kanuka.cli import make_parser

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def python_blocks() -> list:
    found = []
    for page in PAGES:
        for k, block in enumerate(re.findall(r"^```python\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)):
            found.append(pytest.param(block, id=f"{page.name}-{k}"))
    return found


@pytest.mark.parametrize("block", python_blocks())
def test_python_blocks_run(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    render = kanuka.render

    def small(scene: kanuka.Scene, **options) -> kanuka.Picture:
        return render(scene, **(options | {"progressions": 1, "resolution": (32, 18)}))

    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.rib").write_text("WorldBegin Sphere 1 -1 1 360 WorldEnd\n")
    monkeypatch.setattr(kanuka, "render", small)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(compile(block, "block", "exec"), {"__name__": "block", "kanuka": kanuka})
    if ".write(" in block:
        assert len(list(tmp_path.iterdir())) > 1


def commands() -> list:
    """Lines of indented blocks that start with the command, up to what three blanks part from it."""
    found = []
    for page in PAGES:
        for line in page.read_text().splitlines():
            if match := re.match(r"    (?:\.venv/bin/)?kanuka (.*?)(?:\s{3,}|$)", line):
                found.append(pytest.param(match[1], id=f"{page.name}: {match[1]}"))
    return found


@pytest.mark.parametrize("command", commands())
def test_commands_parse(command: str) -> None:
    make_parser().parse_args(shlex.split(command, comments=True))


def test_the_tables_of_lights_are_as_declared() -> None:
    spec = importlib.util.spec_from_file_location("make_python_docs", ROOT / "tools" / "make_python_docs.py")
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    text = maker.MANUAL.read_text()
    assert text == maker.updated(text), "run tools/make_python_docs.py"
    table = text.split(maker.BEGIN)[1].split(maker.END)[0]
    for kind, about in kanuka.light_kinds().items():
        assert f"| `{kind}` |" in table
        for parameter, (default, unit, words) in about["parameters"].items():
            assert f"| `{parameter}` | {default} | {unit} | {words} |" in table


def test_light_kinds_are_what_add_light_takes() -> None:
    for kind in kanuka.light_kinds():
        scene = kanuka.Scene()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            scene.add_light(kind)
    with pytest.raises(ValueError, match=", ".join(f'"{kind}"' for kind in kanuka.light_kinds())):
        kanuka.Scene().add_light("moon")
    summary = kanuka.Scene.add_light.__doc__
    for about in kanuka.light_kinds().values():
        for parameter, (default, _, words) in about["parameters"].items():
            assert re.search(rf"\b{parameter}: [^=]+ = {re.escape(default)}[,)]", summary)
            assert words in summary


def test_public_names_are_in_the_manual() -> None:
    manual = " ".join((ROOT / "docs" / page).read_text() for page in ("python.md", "graph.md", "procedurals.md"))
    for name in kanuka.__all__:
        if name != "__version__":
            assert re.search(rf"\b{name}\b", manual), name


def test_options_of_the_command_are_those_of_render() -> None:
    """docs/python.md: every option of the command is an argument, or one of the scene's options."""
    parser = next(a for a in make_parser()._subparsers._group_actions[0].choices.items() if a[0] == "render")[1]
    of_files = {
        "help",
        "scenes",
        "output",
        "frame",
        "no_programs",
        "allow_system",
        "png",
        "stats",
        "fireflies",
        "quiet",
    }
    of_options = {
        "transport", "clamp_direct", "clamp_indirect", "color_space", "output_space", "observer", "sensor",
        "white_balance", "f_stop", "iso", "display", "specular",
    }  # fmt: skip
    renamed = {"aov": "aovs", "shutter_interval": "shutter", "exposure": "exposure_stops", "shutter": "shutter_time"}
    signature = kanuka.render.__doc__.split(")")[0]
    for action in parser._actions:
        name = renamed.get(action.dest, action.dest)
        if action.dest in of_files or action.dest in ("verbose", "messages"):
            continue
        if action.dest in of_options or name in ("exposure_stops", "shutter_time"):
            assert hasattr(kanuka.Options, name), name
        else:
            assert f" {name}: " in kanuka.render.__doc__.split("\n")[0], name
    assert signature
