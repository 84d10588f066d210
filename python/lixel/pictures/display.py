"""Pictures of visibility images, and how notebooks show them."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt

LIT = (226, 224, 216)
SHADOW = (92, 96, 108)
BACKGROUND = (255, 255, 255)


def shadow_picture(visibility: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """(H, W, 3) uint8: lit light, shadow dark, background white; partly lit in between."""
    share = np.nan_to_num(visibility, nan=0.0).clip(0.0, 1.0)[..., None]
    mix = share * np.array(LIT, np.float32) + (1.0 - share) * np.array(SHADOW, np.float32)
    mix[np.isnan(visibility)] = BACKGROUND
    return np.asarray((mix + 0.5).astype(np.uint8))


def png_bytes(
    picture: npt.NDArray[np.uint8] | npt.NDArray[np.uint16], text: Mapping[str, str] | None = None
) -> bytes:
    """The picture as a PNG file, of 16 bits where it has them, with chunks of text by keys."""
    from PIL import Image, PngImagePlugin

    chunks = PngImagePlugin.PngInfo()
    for key, words in (text or {}).items():
        chunks.add_itxt(key, words)
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, format="png", pnginfo=chunks)
    return stream.getvalue()


def html_figure(
    picture: npt.NDArray[np.uint8], rows: Iterable[tuple[str, object]], title: str
) -> str:
    """The picture beside a table, for Jupyter."""
    source = base64.b64encode(png_bytes(picture)).decode("ascii")
    cells = "".join(
        f'<tr><th style="text-align:left">{html.escape(name)}</th>'
        f'<td style="text-align:right">{html.escape(_text(value))}</td></tr>'
        for name, value in rows
    )
    return (
        '<div style="display:flex;gap:1em;align-items:flex-start;flex-wrap:wrap">'
        f'<img alt="{html.escape(title)}" style="max-width:640px" '
        f'src="data:image/png;base64,{source}">'
        f"<table><caption>{html.escape(title)}</caption>{cells}</table></div>"
    )


def milliseconds(timings: Mapping[str, float]) -> str:
    """Times per pass on one line, in the order of the passes."""
    return ", ".join(f"{name} {ms:.2f}" for name, ms in timings.items()) or "-"


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        return ", ".join(_text(v) for v in value) or "-"
    return str(value)
