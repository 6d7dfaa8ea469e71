"""kanuka texture-cache: the folder of textures that renders make of plain pictures."""

from __future__ import annotations

import argparse
import json

import kanuka

from . import exit_codes
from .exit_codes import ExitCode
from .shader_cache import add_actions, age_text, bytes_text


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "texture-cache",
        help="manage the textures made of plain pictures",
        description="Of large plain pictures renders make tiled textures, in a folder that many hosts may "
        "share. KANUKA_TEXTURE_CACHE is its path, KANUKA_TEXTURE_CACHE_SIZE (as 20G) its largest size. All of it "
        "can be made again.",
        epilog=exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_actions(
        parser,
        ("list", "list the files, with sizes and last uses", run_list),
        ("clear", "delete all files", run_clear),
        ("trim", "delete the files that were not used for longest, down to a size", run_trim),
    )


def folder(arguments: argparse.Namespace) -> str:
    return arguments.folder or kanuka.texture_cache_folder()


def run_list(arguments: argparse.Namespace) -> int:
    files = kanuka.texture_cache_files(folder(arguments))
    total, limit = sum(f["bytes"] for f in files), kanuka.texture_cache_limit()
    if arguments.json:
        print(json.dumps({"folder": folder(arguments), "limit": limit, "bytes": total, "files": files}, indent=2))
        return ExitCode.OK
    for f in files:
        print(f"{bytes_text(f['bytes']):>10}  {age_text(f['age_s']):>7} ago  {f['file']}")
    print(f"{bytes_text(total)} in {len(files)} files, at most {bytes_text(limit)}: {folder(arguments)}")
    return ExitCode.OK


def run_clear(arguments: argparse.Namespace) -> int:
    return report_removed(arguments, kanuka.texture_cache_prune(folder(arguments), 0))


def run_trim(arguments: argparse.Namespace) -> int:
    return report_removed(arguments, kanuka.texture_cache_prune(folder(arguments), arguments.size))


def report_removed(arguments: argparse.Namespace, removed: int) -> int:
    told = {"folder": folder(arguments), "removed": removed}
    print(json.dumps(told) if arguments.json else f"{removed} files removed")
    return ExitCode.OK
