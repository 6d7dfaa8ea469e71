"""Pictures of lights: in the space that is rendered in, and those of domes by latitude and longitude."""

from __future__ import annotations

import numpy as np
from pxr import Usd

import kanuka
from kanuka.looks import colors, layouts, pictures
from kanuka.looks.colors import CODES, LINEAR, PRIMARIES, SRGB, Space

from .color_config import Configured
from .spaces import Spaces

# Kanuka's names of what heads of pictures may say.
IN_HEADS = {"rec709": "rec709", "rec2020": "rec2020", "acescg": "ap1", "aces2065": "ap0"}


def rendered(file: str, attribute: Usd.Attribute, spaces: Spaces, layout: str = "") -> str:
    """A file that the core's lights read, as the attribute's space and the layout have it. Raises ValueError where none
    can be made."""
    space = spaces.of_file(attribute, file)
    if not layout and is_read_so(file, space, spaces.rendered):
        return file

    def make(given: pictures.Numbers) -> np.ndarray:
        known = space or said_by(given)
        rgb = pictures.by_rows(given.rgb, lambda values: known.converted(values, spaces.rendered))
        return layouts.unfolded(rgb, layout) if layout else rgb

    key = f"{space.key if isinstance(space, Configured) else space!r} {spaces.rendered} {layout}"
    is_dome = attribute.GetPrim().GetTypeName() != "RectLight"
    try:
        return pictures.made_of(file, key, make, latlong=is_dome)
    except (kanuka.Error, OSError, ValueError) as error:
        raise ValueError(f"its picture {file} is not read: {error}") from None


def said_by(given: pictures.Numbers) -> Space:
    """What a file says by itself."""
    if given.codes:
        return Space("srgb", SRGB, PRIMARIES["rec709"])
    return Space(given.space, LINEAR, PRIMARIES[IN_HEADS[given.space]]) if given.space in IN_HEADS else Space("")


def is_read_so(file: str, space: Space | None, rendered: str) -> bool:
    """Whether the core makes of the file what the space says: of lights' pictures it decodes codes of 8 and 16 bits as
    sRGB's, of those of EXR it converts what the head says, and takes all others for the space that is rendered in."""
    if space is None:
        return True
    if isinstance(space, Configured) and not space.fits(file):
        return False
    kept = colors.lookup(space, rendered, file)
    if file.lower().endswith(CODES):
        return kept.space == "srgb" and not kept.function
    with open(file, "rb") as data:
        says = pictures.CHROMATICITIES in data.read(pictures.LARGEST_HEAD)
    return file.lower().endswith((".exr", ".hdr")) and kept == colors.RAW and not says
