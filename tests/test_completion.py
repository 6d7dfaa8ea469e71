"""kanuka completion, in the shells that are here."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from kanuka.cli import completion, make_parser

COMPLETE = """
source "$1"
shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
_kanuka
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture
def complete(tmp_path: Path):
    script = tmp_path / "kanuka.bash"
    script.write_text(completion.bash(completion.commands_of(make_parser(), ()), zsh=False))

    def run(*words: str) -> set[str]:
        result = subprocess.run(
            ["bash", "-c", COMPLETE, "bash", script, *words], capture_output=True, text=True, cwd=tmp_path, check=True
        )
        assert result.stderr == ""
        return set(result.stdout.split())

    return run


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (("kanuka", "ren"), {"render"}),
        (("kanuka", "shader", "c"), {"compile", "cache"}),
        (("kanuka", "shader", "cache", "tr"), {"trim"}),
        (("kanuka", "render", "scene.rib", "--progr"), {"--progressions"}),
        (("kanuka", "render", "a.rib", "--store-mode", ""), {"read", "write", "kanuka.bash"}),
        (("kanuka", "completion", "z"), {"zsh"}),
        (("kanuka", "render", "kan"), {"kanuka.bash"}),
    ],
)
def test_bash_completes(complete, words: tuple[str, ...], found: set[str]) -> None:
    assert complete(*words) == found


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_scripts_have_no_faults(kanuka_command, shell: str) -> None:
    """By the shell itself, where it is here."""
    text = kanuka_command("completion", shell).stdout
    assert ("texture-cache" in text and "--progressions" in text) or (shell == "fish" and "-l progressions" in text)
    if shutil.which(shell):
        subprocess.run([shell, "-n", "/dev/stdin"], input=text, text=True, check=True)
