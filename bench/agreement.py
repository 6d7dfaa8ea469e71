"""Our picture against Mitsuba's, both far longer than usual: the same within noise?"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import reduce

import peers
import references
import validation
from pictures import Estimate, agreement
from settings import Found, Say, Settings

REFERENCE = peers.RENDERERS["mitsuba-llvm-spectral"]  # spectral as ours, and the fastest


@dataclass(frozen=True)
class Pair:
    """Samples of a batch, of which there are 16 of ours and 32 of theirs.

    `levelled`: where colours are spectra by two optimisers, structure is looked for after the means are made equal.
    """

    ours: int = 64
    theirs: int = 32
    levelled: bool = False
    scale: float = 1  # of the picture's sides


SCENES: dict[str, Pair] = {
    "cornell": Pair(levelled=True, scale=0.5),
    "grey-cornell": Pair(scale=0.5),
    "terrain": Pair(theirs=16, levelled=True, scale=0.5),
    **{name: Pair() for name in validation.MAKERS},
    "dispersion": Pair(ours=512, theirs=16),
}
OUR_BATCHES, THEIR_BATCHES, AT_A_TIME = 16, 32, 8


def request(settings: Settings, scene: str, n: int = 0, **given: object) -> Found:
    asked = settings.request(scene, n, **given)
    return asked | {"scale": asked["scale"] * SCENES[scene].scale}


def ours_of(settings: Settings, scene: str, samples: int, batches: int) -> Estimate:
    made = None
    for first in range(3000, 3000 + batches, AT_A_TIME):
        seeds = list(range(first, min(first + AT_A_TIME, 3000 + batches)))
        answer = peers.ask(peers.OURS, request(settings, scene, samples=samples) | {"seeds": seeds})
        if answer.figures["nan_samples"]:
            raise peers.WorkerError(f"{scene}: {answer.figures['nan_samples']} samples are not finite")
        more = Estimate.of(answer.pictures, samples)
        made = made + more if made else more
    return made


def measure(settings: Settings, scene: str, say: Say) -> Found:
    if not REFERENCE.installed:
        raise peers.NotInstalled(f"{REFERENCE.name} is not installed")
    pair = SCENES[scene]
    our_batches, their_batches = (4, 8) if settings.quick else (OUR_BATCHES, THEIR_BATCHES)
    our_samples, their_samples = (8, 8) if settings.quick else (pair.ours, pair.theirs)
    ours = ours_of(settings, scene, our_samples, our_batches)  # first: it leaves the spectra of metals
    # A peer without dispersion renders band by band of wavelengths, each at an index of its own.
    bands = range(1, 1 + (validation.BANDS if scene == "dispersion" else 0)) or (0,)
    parts = [
        references.converged(
            REFERENCE, request(settings, scene, n, samples=their_samples, as_ours=True), their_batches, say
        )
        for n in bands
    ]
    theirs = reduce(Estimate.superposed, parts)
    found = agreement(ours, theirs, level=pair.levelled)
    means = ", ".join(
        f"{100 * (r - 1):+.2f} ± {100 * s:.2f} %" for r, s in zip(found.mean_ratio, found.mean_sigma, strict=True)
    )
    say(
        f"  {scene}: means {means} from {REFERENCE.name}; blocks: z {found.rms_z:.2f} r.m.s. "
        f"({found.rms_limit:.2f}), worst {found.worst_z:.1f} ({found.worst_limit:.1f}), "
        f"{100 * found.residual:.2f} % beyond noise"
    )
    return {
        "peer": REFERENCE.name,
        "our_samples": ours.samples * ours.batches,
        "their_samples": theirs.samples * theirs.batches,
        **asdict(found),
        "mean_error": found.mean_error,
        "structure": found.structure,
    }
