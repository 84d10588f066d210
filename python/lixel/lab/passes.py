"""The passes of a frame, in groups: what tables add up, by the labels that the core gives them."""

from __future__ import annotations

VISIBILITY = ("visibility",)
"""What the camera sees."""

RECEIVERS = ("receivers", "receiver tiles", "image tiles")
"""What of it faces the light, and where it is in the image and in the map."""

FIT = ("samples", "outline", "edges (CPU)", "fit light matrix (CPU)")
"""Where the map lies."""

IMPORTANCE = (
    "importance map", "forward importance", "shadow edge", "boundary", "blend importance",
)  # fmt: skip
"""What a warp is made from."""

WARP = ("warp map",)
SHADOW_MAP = ("shadow map",)
LOOKUP = ("lookup",)

BUILD = ("hierarchy (CPU)", "acceleration structure")
"""What rays need, once for the vertices of a scene."""

RECEIVER_LISTS, CASTER_TESTS = "receiver lists", "caster tests"
SHADOW_RAYS, RAY_QUERIES = "shadow rays", "ray queries"
SHADOW_VOLUMES = "shadow volumes"

MAPLESS = (RECEIVER_LISTS, CASTER_TESTS, SHADOW_RAYS, RAY_QUERIES, SHADOW_VOLUMES)
"""Shadows without a map."""

GROUPS = (VISIBILITY, RECEIVERS, FIT, IMPORTANCE, WARP, SHADOW_MAP, LOOKUP, BUILD, MAPLESS)
"""Every label is in one of them."""
