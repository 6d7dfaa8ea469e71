"""kanuka shader cache: the folder of compiled shaders."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable

import kanuka

from . import exit_codes
from .exit_codes import ExitCode


def size(text: str) -> int:
    number, unit = text.rstrip("KMGT"), text[len(text.rstrip("KMGT")) :]
    try:
        return int(float(number) * {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}[unit])
    except (ValueError, KeyError, OverflowError):
        raise argparse.ArgumentTypeError(f"expected a size as in 500M or 2G, got {text!r}") from None


def add_parser(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser(
        "cache",
        help="manage the compiled shaders",
        description="Compiled shaders are stored in a folder that many machines may share. KANUKA_SHADER_CACHE is its "
        "path, KANUKA_SHADER_CACHE_SIZE (such as 500M or 2G) its largest size.",
        epilog=exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_actions(
        parser,
        ("list", "list the entries, with sizes and last uses", run_list),
        ("clear", "delete all entries", run_clear),
        ("trim", "delete the entries that were not used for longest, down to a size", run_trim),
        ("verify", "check every entry; renders compile broken ones again", run_verify),
    )


def add_actions(parser: argparse.ArgumentParser, *rows: tuple[str, str, Callable]) -> None:
    """What can be done with a cache's folder: name, help and function of each."""
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    for name, text, run in rows:
        action = actions.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        action.add_argument("--folder", default="", metavar="DIR", help="default: the folder that renders use")
        action.add_argument("--json", action="store_true", help="print JSON")
        if name == "trim":
            action.add_argument("--size", type=size, metavar="SIZE", help="such as 500M or 2G; default: the limit")
        action.set_defaults(run=run)


def folder(arguments: argparse.Namespace) -> str:
    return arguments.folder or kanuka.shader_cache_folder()


def bytes_text(count: int) -> str:
    for unit, scale in (("GiB", 2**30), ("MiB", 2**20), ("KiB", 2**10)):
        if count >= scale:
            return f"{count / scale:.1f} {unit}"
    return f"{count} B"


def age_text(seconds: float) -> str:
    for unit, scale in (("d", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * scale:
            return f"{seconds / scale:.0f} {unit}"
    return f"{max(0, seconds):.0f} s"


def run_list(arguments: argparse.Namespace) -> int:
    entries = kanuka.shader_cache_entries(folder(arguments))
    total = sum(e["bytes"] for e in entries)
    if arguments.json:
        print(json.dumps({"folder": folder(arguments), "limit": kanuka.shader_cache_limit(), "bytes": total,
                          "entries": entries}, indent=2))  # fmt: skip
        return ExitCode.OK
    for e in entries:
        what = ", ".join(e["key"].split(", ")[1:4])
        print(f"{bytes_text(e['bytes']):>10}  {age_text(e['age_s']):>7} ago  {e['shader'] or '?'}  ({what})")
    limit = bytes_text(kanuka.shader_cache_limit())
    print(f"{bytes_text(total)} in {len(entries)} entries, at most {limit}: {folder(arguments)}")
    return ExitCode.OK


def report_removed(arguments: argparse.Namespace, count: int) -> int:
    print(json.dumps({"folder": folder(arguments), "removed": count}) if arguments.json else f"{count} files removed")
    return ExitCode.OK


def run_clear(arguments: argparse.Namespace) -> int:
    return report_removed(arguments, kanuka.shader_cache_clear(folder(arguments)))


def run_trim(arguments: argparse.Namespace) -> int:
    return report_removed(arguments, kanuka.shader_cache_trim(folder(arguments), arguments.size))


def run_verify(arguments: argparse.Namespace) -> int:
    entries = kanuka.shader_cache_entries(folder(arguments), verify=True)
    broken = [e for e in entries if e["problem"]]
    if arguments.json:
        print(json.dumps({"folder": folder(arguments), "entries": len(entries), "broken": broken}, indent=2))
    else:
        for e in broken:
            print(f"{e['file']}: {e['problem']}")
        print(f"{len(entries)} entries, {len(broken)} broken")
    return ExitCode.ERRORS if broken else ExitCode.OK
