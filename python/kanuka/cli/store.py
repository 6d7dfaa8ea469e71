"""kanuka store: the folder of diced and shaded geometry."""

from __future__ import annotations

import argparse
import json
import os

import kanuka

from . import exit_codes, store_export
from .exit_codes import ExitCode, fail
from .progress import ProgressBar
from .shader_cache import age_text, bytes_text, size


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "store",
        help="manage stored geometry",
        description="What `kanuka render --store DIR` has diced and shaded is in a folder, which many hosts "
        "may share. KANUKA_STORE is its path, KANUKA_STORE_SIZE (as 20G) its largest size. It is a cache: everything "
        "in it can be made again.",
        epilog=exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    for name, text, run in (
        ("info", "what is there: files, pages, bytes, last uses", run_info),
        ("verify", "read every page and check it; renders make broken ones again", run_verify),
        ("compress", "make packs smaller that were not used for a while; renders read them as before", run_compress),
        ("prune", "delete what was not used for longest, down to a size", run_prune),
    ):
        action = actions.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        action.add_argument("folder", nargs="?", default="", metavar="DIR", help="default: KANUKA_STORE")
        action.add_argument("--json", action="store_true", help="print JSON")
        if name == "prune":
            action.add_argument("--size", type=size, metavar="SIZE", required=True, help="as 500M or 20G; 0: all")
        if name == "compress":
            action.add_argument(
                "--idle", type=float, default=24, metavar="HOURS", help="not used for so long; default: 24"
            )
        action.set_defaults(run=run)
    store_export.add_parser(actions)


def folder(arguments: argparse.Namespace) -> str:
    chosen = arguments.folder or os.environ.get("KANUKA_STORE", "")
    if not chosen:
        fail(ExitCode.USAGE, "which folder? Name it, or set KANUKA_STORE")
    return chosen


def run_info(arguments: argparse.Namespace) -> int:
    chosen = folder(arguments)
    packs = kanuka.store_packs(chosen)
    if arguments.json:
        print(json.dumps({"folder": chosen, "packs": packs}, indent=2))
        return ExitCode.OK
    for pack in packs:
        note = f"  {pack['problem']}" if pack["problem"] else "" if pack["of_this_build"] else "  of another build"
        holds = "hierarchy" if pack["kind"] == "hierarchy" else f"{pack['pages']} pages"
        print(f"{bytes_text(pack['bytes']):>10}  {holds:>13}  {age_text(pack['age_s']):>7} ago{note}")
    here = [pack for pack in packs if pack["of_this_build"] and not pack["problem"]]
    print(f"{summary(packs)}, of this build {summary(here)}: {chosen}")
    return ExitCode.OK


def summary(packs: list[dict]) -> str:
    pages = sum(pack["pages"] for pack in packs if pack["kind"] == "pages")
    hierarchy = sum(pack["kind"] == "hierarchy" for pack in packs)
    also = f" and {hierarchy} of the hierarchy" if hierarchy else ""
    return f"{pages} pages{also} in {bytes_text(sum(pack['bytes'] for pack in packs))}"


def run_verify(arguments: argparse.Namespace) -> int:
    chosen = folder(arguments)
    packs = kanuka.store_packs(chosen, verify=True)
    broken = [pack for pack in packs if pack["problem"]]
    if arguments.json:
        print(json.dumps({"folder": chosen, "packs": len(packs), "broken": broken}, indent=2))
    else:
        for pack in broken:
            print(f"{pack['file']}: {pack['problem']}")
        print(f"{summary(packs)}, {len(broken)} of {len(packs)} files broken")
    return ExitCode.ERRORS if broken else ExitCode.OK


def run_compress(arguments: argparse.Namespace) -> int:
    chosen = folder(arguments)
    bar = ProgressBar(quiet=arguments.json)
    done = kanuka.store_compress(chosen, idle_s=3600 * arguments.idle, progress=bar.update)
    bar.finish()
    sizes = f"{bytes_text(done['bytes_before'])} are now {bytes_text(done['bytes_after'])}"
    text = f"{done['packs']} packs compressed" + (f": {sizes}" if done["packs"] else "")
    print(json.dumps({"folder": chosen, **done}) if arguments.json else text)
    return ExitCode.OK


def run_prune(arguments: argparse.Namespace) -> int:
    chosen = folder(arguments)
    removed = kanuka.store_prune(chosen, arguments.size)
    print(json.dumps({"folder": chosen, "removed": removed}) if arguments.json else f"{removed} files removed")
    return ExitCode.OK
