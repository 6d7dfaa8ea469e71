"""All that a complete run measures, in order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import agreement
import budgets
import compiler
import delayed
import dicing
import edits
import flight
import hair
import hierarchy
import ingest
import isles
import kills
import lanes
import levels
import lights
import moving
import nesting
import networks
import oracles
import ourselves
import rays
import rib
import shots
import side_by_side
import stages
import storing
import triple
import usd_scenes
from settings import Found, Say, Settings


@dataclass(frozen=True)
class Part:
    measure: str
    about: str
    take: Callable[[Settings, Say], Found]
    seconds: float  # about, on two quiet cores; a quick run takes some of it
    quick: bool = True  # part of a quick run

    @property
    def name(self) -> str:
        return f"{self.measure}/{self.about}" if self.about else self.measure


WIDTH_SCENES = ("cornell", "still-life")
QUICK_AGREEMENT = ("conductor", "rough-gloss")
AGREEMENT = {"cornell": 125, "grey-cornell": 125, "terrain": 95, "dispersion": 200}  # seconds; the others are small


def parts(peers: list[str] | None = None) -> list[Part]:
    """`peers`: these alone, side by side."""

    def about(take: Callable[..., Found], *given: object) -> Callable[[Settings, Say], Found]:
        return lambda settings, say: take(settings, *given, say)

    made = [
        Part("side-by-side", scene, about(side_by_side.measure, scene, peers), seconds, scene == "cornell")
        for scene, seconds in {
            "cornell": 1040,
            "terrain": 590,
            "forest": 300,
            "forest-million": 500,
            "still-life": 600,
            **dict.fromkeys(usd_scenes.there(), 600),
        }.items()
    ]
    made += [
        Part("networks", str(links), about(networks.measure, links), seconds, links == 16)
        for links, seconds in {16: 115, 100: 175, 1000: 450}.items()
    ]
    made += [
        Part("shaders", "", compiler.measure, 160),
        Part("micropolygons", "", ourselves.micropolygons, 30),
        Part("dice", "", dicing.measure, 60),
        Part("rib", "", rib.measure, 60),
        Part("lights", "", lights.measure, 130),
        Part("lanes", "", lanes.measure, 160),
        Part("delayed", "", delayed.measure, 40),
    ]
    made += [
        Part("hierarchy", scene, about(hierarchy.measure, scene), 30, scene == "mesh") for scene in hierarchy.SCENES
    ]
    made += [Part("instances", "", hierarchy.instances, 60)]
    made += [Part("moving", scene, about(moving.measure, scene), 60, scene in moving.QUICK) for scene in moving.SCENES]
    made += [Part("rays", kind, about(rays.measure, kind), 350) for kind in rays.KINDS]
    made += [Part("hair", kind, about(hair.measure, kind), 90) for kind in ("linear", "cubic")]
    made += [Part("edits", which, about(edits.measure, which), 60 if which == "" else 120) for which in edits.ALL]
    made += [Part("shots", scene, about(shots.measure, scene), 60, scene == "wood") for scene in shots.SCENES]
    made += [
        Part("isles", scene, about(isles.measure, scene), 300, scene in ("motu", "nested")) for scene in isles.SCENES
    ]
    made += [Part("levels", view, about(levels.measure, view), 150, view == "budget") for view in levels.VIEWS]
    made += [
        Part("nesting", tracer, about(nesting.measure, tracer), 60, tracer == "pages") for tracer in nesting.TRACERS
    ]
    made += [Part("flight", way, about(flight.measure, way), 600, way == "whole") for way in flight.WAYS]
    made += [Part("oracle", "", oracles.measure, 60), Part("budgets", "", budgets.measure, 240)]
    made += [Part("kills", "", kills.measure, 300)]
    made += [Part("ingest", scene, about(ingest.measure, scene), 60) for scene in ingest.SCENES]
    made += [Part("store", scene, about(storing.measure, scene), 60, scene == "shading") for scene in storing.SCENES]
    made += [Part("stages", scene, about(stages.measure, scene), 60, scene == "showcase") for scene in stages.SCENES]
    made += [
        Part("tolerance", kind, about(ourselves.tolerance, kind), 100, kind == "flat")
        for kind in ourselves.TOLERANCE_SCENES
    ]
    made += [
        Part("watertight", scene, about(ourselves.watertight, scene), 55, scene == "still-life")
        for scene in ("still-life", "terrain")
    ]
    made += [Part("widths", scene, about(ourselves.widths, scene), 50, scene == "cornell") for scene in WIDTH_SCENES]
    made += [  # the first one builds the other renderer, minutes that a quick run does not have
        Part("wavelengths", scene, about(triple.measure, scene), 340 if scene == "cornell" else 45, False)
        for scene in triple.SCENES
    ]
    made += [
        Part("agreement", scene, about(agreement.measure, scene), AGREEMENT.get(scene, 25), scene in QUICK_AGREEMENT)
        for scene in agreement.SCENES
    ]
    return made
