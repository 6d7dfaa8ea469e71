"""kanuka completion: what a shell needs to complete commands, options and their values."""

from __future__ import annotations

import argparse
import shlex
from dataclasses import dataclass, field

from . import exit_codes
from .exit_codes import ExitCode

EXAMPLES = """\
examples:
  source <(kanuka completion bash)                 in ~/.bashrc
  source <(kanuka completion zsh)                  in ~/.zshrc, after compinit
  kanuka completion fish | source                  in ~/.config/fish/config.fish

"""
SHELLS = ("bash", "zsh", "fish")


@dataclass
class Command:
    """A command by its words, as `kanuka shader cache`, and what may follow it."""

    words: tuple[str, ...]
    commands: list[tuple[str, str]] = field(default_factory=list)  # name, help
    options: list[tuple[list[str], list[str], bool, str]] = field(default_factory=list)  # names, choices, value?, help


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "completion",
        help="print what a shell needs to complete commands",
        description="Prints a script for a shell, which completes commands, options and their values.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("shell", choices=SHELLS)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    from . import make_parser

    found = commands_of(make_parser(), ())
    print(fish(found) if arguments.shell == "fish" else bash(found, zsh=arguments.shell == "zsh"), end="")
    return ExitCode.OK


def commands_of(parser: argparse.ArgumentParser, words: tuple[str, ...]) -> list[Command]:
    made = Command(words)
    below: list[Command] = []
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            help_of = {choice.dest: choice.help or "" for choice in action._choices_actions}
            for name, inner in action.choices.items():
                made.commands.append((name, help_of.get(name, "")))
                below += commands_of(inner, (*words, name))
        else:
            choices = [str(choice) for choice in action.choices or ()]
            if action.option_strings:
                made.options.append((list(action.option_strings), choices, action.nargs != 0, action.help or ""))
            elif choices:
                made.commands += [(choice, "") for choice in choices]
    return [made, *below]


def bash(commands: list[Command], zsh: bool) -> str:
    """For zsh by its emulation of bash's completion."""
    cases, values = [], []
    for command in commands:
        words = [name for name, _ in command.commands] + [name for names, *_ in command.options for name in names]
        cases.append(f"    {shlex.quote(' '.join(command.words))}) words={shlex.quote(' '.join(words))} ;;")
        for names, choices, _, _ in command.options:
            values += [
                f"    {shlex.quote(' '.join((*command.words, name)))}) words={shlex.quote(' '.join(choices))} ;;"
                for name in names
                if choices
            ]
    lines = ["autoload -U +X bashcompinit && bashcompinit"] if zsh else []
    known = " ".join(f"{' '.join(command.words)!r}" for command in commands if command.words)
    lines += [
        "_kanuka() {",
        '    local at="" word words="" i current="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}"',
        f"    local known=({known})",
        "    for ((i = 1; i < COMP_CWORD; i++)); do",
        '        word="${at:+$at }${COMP_WORDS[i]}"',
        '        [[ " ${known[*]/#/|} |" == *"|$word |"* ]] && at="$word"',
        "    done",
        '    case "${at:+$at }$before" in',
        *values,
        "    esac",
        '    [[ -n $words ]] || case "$at" in',
        *cases,
        "    esac",
        '    COMPREPLY=($(compgen -W "$words" -- "$current"))',
        '    [[ $current == -* ]] || COMPREPLY+=($(compgen -f -- "$current"))',
        "}",
        "complete -o filenames -F _kanuka kanuka",
    ]
    return "\n".join([*lines, ""])


def fish(commands: list[Command]) -> str:
    lines = []
    for command in commands:
        inside = " ".join(f"; and __fish_seen_subcommand_from {word}" for word in command.words).removeprefix("; and ")
        where = f" -n {shlex.quote(inside)}" if inside else " -n __fish_use_subcommand"
        for name, text in command.commands:
            lines.append(f"complete -c kanuka{where} -a {name} -d {shlex.quote(text)}")
        for names, choices, value, text in command.options:
            flags = "".join(f" -l {n[2:]}" if n.startswith("--") else f" -s {n[1:]}" for n in names if len(n) != 3)
            given = f" -x -a {shlex.quote(' '.join(choices))}" if choices else " -r" if value else ""
            told = shlex.quote(text.splitlines()[0] if text else "")
            lines.append(f"complete -c kanuka{where}{flags}{given} -d {told}")
    return "\n".join([*lines, ""])
