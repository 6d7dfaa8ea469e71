"""Opening stages: what USD needs to find MaterialX, and what it has to say."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from kanuka._native import Error

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
EXIT_INPUT = 4
INSTALL = "pip install 'kanuka[usd]'"

Say = Callable[[str, str], None]  # severity, text


def silent(severity: str, text: str) -> None:
    """For what is told elsewhere."""


class Gathered:
    """What is told once for all prims that it is true of."""

    def __init__(self) -> None:
        self._paths: dict[str, list[str]] = {}

    def note(self, text: str, path: str) -> None:
        self._paths.setdefault(text, []).append(path)

    def tell(self, say: Say) -> None:
        for text, paths in self._paths.items():
            more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
            say("warning", f"{paths[0]}{more}: {text}")


def is_stage(path: object) -> bool:
    """Whether a file's name is a USD stage's."""
    return str(path).lower().endswith(SUFFIXES)


def input_error(text: str, file: str = "") -> Error:
    error = Error(f"{file}: {text}" if file else text)
    error.file, error.line, error.column, error.exit_code = file, 0, 0, EXIT_INPUT
    return error


def prepare() -> None:
    """Before USD is imported: where its reader of MaterialX finds the standard library."""
    name = "PXR_MTLX_STDLIB_SEARCH_PATHS"
    if name in os.environ:
        return
    # Where it is, without importing it: stages without its nodes need no more.
    if (found := find_spec("MaterialX")) and found.origin:
        os.environ[name] = str(Path(found.origin).parent / "libraries")


def require() -> None:
    """Raises an Error that names the package where USD is not installed."""
    prepare()
    try:
        from pxr import Usd  # noqa: F401
    except ImportError as error:
        raise input_error(f"reading USD needs the package usd-exchange ({error}): {INSTALL}") from None


def open_stage(
    path: str,
    say: Say,
    variants: Mapping[str, str],
    mask: Sequence[str],
    products: Sequence[str] = (),
    whole: bool = True,
):
    """The stage, composed; `variants` is {"/prim{set}": "variant"}. With a mask, or not `whole`: its prims and
    `products` alone, and the settings, with the cameras, products and vars that these name. Errors of composition are
    told one by one."""
    from pxr import Sdf, Tf, Usd, UsdUtils

    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    session = Sdf.Layer.CreateAnonymous("variants.usda")
    for place, choice in variants.items():
        prim_path, _, set_name = place.rstrip("}").rpartition("{")
        if not prim_path or not Sdf.Path.IsValidPathString(prim_path)[0]:
            raise input_error(f'variant "{place}={choice}": expected "/prim{{set}}=choice"')
        Sdf.CreatePrimInLayer(session, prim_path).variantSelections[set_name] = choice
    try:
        layer = Sdf.Layer.FindOrOpen(path)
        if layer is None:
            raise input_error("no stage that USD can read", path)
        if mask or not whole:
            stage = masked(layer, session, [*mask, *(p for p in products if p.startswith("/"))])
        else:
            stage = Usd.Stage.Open(layer, session)
    except Tf.ErrorException as error:
        raise input_error("; ".join(str(e.commentary) for e in error.args) or str(error), path) from None
    finally:
        told = [d.sourceFileName and d.commentary for d in delegate.TakeUncoalescedDiagnostics()]
        del delegate
    for text in dict.fromkeys(filter(None, told)):
        say("warning", one_line(text))
    return stage


def first_frame(stage) -> float:
    return stage.GetStartTimeCode() if stage.HasAuthoredTimeCodeRange() else 0.0


def masked(layer, session, paths: list[str]):
    from pxr import Sdf, Usd, UsdRender

    settings = layer.pseudoRoot.GetInfo("renderSettingsPrimPath") if layer.pseudoRoot else ""
    if settings and Sdf.Path.IsValidPathString(settings)[0] and Sdf.Path(settings).IsAbsoluteRootOrPrimPath():
        paths = [*paths, settings]
    stage = Usd.Stage.OpenMasked(layer, session, Usd.StagePopulationMask(paths))
    stage.ExpandPopulationMask(Usd.PrimDefaultPredicate, lambda named: named.GetPrim().IsA(UsdRender.SettingsBase))
    return stage


def one_line(text: str) -> str:
    return " ".join(text.split())
