"""A thousand million rays from inside of closed surfaces, by pages of our own and by Embree (kanuka_ray_bench)."""

from __future__ import annotations

from settings import Found, Say, Settings, built, lines_of

KINDS = ("displaced", "subdivided", "trimmed", "mesh", "instances", "moving", "changing", "fibres")
CLOSED = ("displaced", "subdivided", "trimmed")  # as they are diced: a thousand million rays in all
RAYS, RAYS_OF_CLOSED, SURFACES = 200_000_000, 340_000_000, 64  # of each kind
QUICK_RAYS, QUICK_SURFACES = 2_000_000, 4


def measure(settings: Settings, kind: str, say: Say) -> Found:
    rays, surfaces = (QUICK_RAYS, QUICK_SURFACES) if settings.quick else (RAYS, SURFACES)
    if kind in CLOSED and not settings.quick:
        rays = RAYS_OF_CLOSED
    program = built("kanuka_ray_bench", "render")
    options = (f"--kind={kind}", f"--rays={rays}", f"--surfaces={surfaces}", f"--threads={settings.threads}")
    (found,) = lines_of(program, *options)
    leaks = sum(found["leaks"].values()) + sum(found["leaks_of_any"].values())
    say(
        f"  {sum(found['rays'].values()):,} rays: {leaks} leaks, Embree {sum(found['embree_leaks'].values()):,}; "
        f"{found['differ']:,} differ, {found['embree_right'] + found['neither']} of them are ours to answer for"
    )
    return found
