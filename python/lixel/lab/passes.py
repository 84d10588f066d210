"""The passes of a frame by the core's labels, and the groups that tables add up."""

from __future__ import annotations

VISIBILITY = "visibility"
WARP_MAP = "warp map"
SHADOW_MAP = "shadow map"
MOMENTS = "moments"
LOOKUP = "lookup"
RECEIVER_LISTS = "receiver lists"
CASTER_TESTS = "caster tests"
SHADOW_RAYS = "shadow rays"
FIT_LIGHT_MATRIX = "fit light matrix (CPU)"
FLOAT64 = "float64 (CPU)"

FACING = "receivers"
RECEIVER_TILES = ("receiver tiles", "image tiles", "page requests")
"""Which parts of the map and of the image receivers are in: the others are not drawn."""

DRAWING = (*RECEIVER_TILES, SHADOW_MAP)
"""The map, where receivers look."""

RECEIVERS = (FACING, *RECEIVER_TILES)
"""What of the image faces the light, and where it is in the image and in the map."""

FIT = ("samples", "outline", FIT_LIGHT_MATRIX)
"""Where the map lies."""

IMPORTANCE = (
    "importance map", "forward importance", "shadow edge", "boundary", "blend importance",
)  # fmt: skip
"""What a warp is made from."""

MAP = (WARP_MAP, SHADOW_MAP, MOMENTS, LOOKUP)

BUILD = ("hierarchy (CPU)", "acceleration structure", "edges (CPU)")
"""What is made once for the vertices of a scene."""

WITHOUT_MAP = (
    RECEIVER_LISTS, "light grid", CASTER_TESTS, SHADOW_RAYS, "ray queries", "shadow volumes",
    FLOAT64,
)  # fmt: skip
"""Shadows without a map."""

READ_BACK = ("packed image",)
"""What the image that is read back is made into."""

GROUPS = ((VISIBILITY,), RECEIVERS, FIT, IMPORTANCE, MAP, BUILD, WITHOUT_MAP, READ_BACK)
"""Every label is in one of them."""
