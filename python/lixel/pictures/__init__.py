"""Pictures: of visibility images, of studies and warps, and an interactive view."""
