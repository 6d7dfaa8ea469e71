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


def made_docs():
    spec = importlib.util.spec_from_file_location("make_python_docs", ROOT / "tools" / "make_python_docs.py")
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    return maker


@pytest.mark.parametrize("table", ["lights", "light shaders", "camera", "options", "attributes"])
def test_tables_are_as_declared(table: str) -> None:
    maker = made_docs()
    text = maker.TABLES[table][0].read_text()
    assert text == maker.updated(table), "run tools/make_python_docs.py"
    rib = [rib.split(":")[1] for about in kanuka.attribute_parameters().values() for rib in about["rib"]]
    kinds = kanuka.light_kinds()
    names = {
        "lights": kinds,
        "light shaders": [about["shader"] for about in kinds.values()],
        "camera": kanuka.camera_parameters(),
        "options": kanuka.option_parameters(),
        "attributes": rib,
    }[table]
    for name in names:
        assert re.search(rf"^\| .*\b{name}\W.*\|$", text, re.MULTILINE)


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
        for parameter, declared in about["parameters"].items():
            assert re.search(rf"\b{parameter}: [^=]+ = ({re.escape(repr(declared['default']))}|None)[,)]", summary)
            assert declared["help"] in summary


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
        "together",
        "no_programs",
        "allow_system",
        "png",
        "stats",
        "checkpoint",
        "checkpoint_every",
        "write_oracle",
        "part",
        "fireflies",
        "quiet",
        *("camera", "product", "variant", "prim", "purpose"),  # of stages
    }
    for action in parser._actions:
        if action.dest in of_files or action.dest in ("verbose", "messages"):
            continue
        name = {"aov": "aovs", "samples": "progressions"}.get(action.dest, action.dest)
        assert f" {name}: " in kanuka.render.__doc__.split("\n")[0], name


def test_options_are_the_same_in_every_door() -> None:
    """An option is a property, an argument of render(), and what the command's flag sets."""
    parser = next(a for a in make_parser()._subparsers._group_actions[0].choices.items() if a[0] == "render")[1]
    flags = {action.dest: action.option_strings for action in parser._actions}
    options = kanuka.Options if hasattr(kanuka, "Options") else type(kanuka.Scene().options)
    for name, about in kanuka.option_parameters().items():
        assert hasattr(options, name)
        assert about["help"] in getattr(options, name).__doc__
        keyword = "progressions" if name == "samples" else name
        assert f" {keyword}: " in kanuka.render.__doc__.split("\n")[0]
        if about["flag"]:
            assert f"--{about['flag']}" in flags[name]
        value = getattr(kanuka.Scene().options, name)
        kanuka.check_option(name, value)
