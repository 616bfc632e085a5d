"""A rig in a notebook: what the camera sees while its joints turn, as widgets of the notebook itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from rigs import Rig
from studio.results import ViewRequest
from studio.surroundings import OVERLAYS, Surroundings

if TYPE_CHECKING:
    import ipywidgets

MISSING = "ipywidgets is not installed; it comes with mirrorgaze's extra: pip install 'mirrorgaze[notebook]'"
JPEG_QUALITY = 85


def explore(rig: Rig, *, width_px: int = 480, **surroundings: Any) -> ipywidgets.VBox:
    """Widgets that turn a rig's joints and show what its camera sees, and where it looks.

    Each image is rendered in the notebook's own process: in draft light until the full light of rig and surroundings is
    in the cache, as in the studio. The first takes some seconds, the next ones tens of milliseconds.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    width_px : int
        Of the image.
    **surroundings
        Of `studio.Surroundings`: world, target, depth_m, water, sun_elevation_deg, sun_azimuth_deg, cloud.

    Returns
    -------
    widgets : ipywidgets.VBox
        Its children: image, sliders of q1 and q2 in degrees, overlay, and a line of text.

    Raises
    ------
    ModuleNotFoundError
        Without ipywidgets.
    ValueError
        For a rig without mirrors, or surroundings that cannot be.
    """
    try:
        import ipywidgets as widgets  # noqa: PLC0415  (of an extra)
    except ModuleNotFoundError:
        raise ModuleNotFoundError(MISSING) from None
    joints = rig.require_gaze().joints
    around = Surroundings(**surroundings)
    pan, tilt = (
        widgets.FloatSlider(
            value=min(max(0.0, joint.min_deg), joint.max_deg),
            min=joint.min_deg,
            max=joint.max_deg,
            step=0.5,
            description=f"{name} (°)",
        )
        for name, joint in (("q1", joints.pan), ("q2", joints.tilt))
    )
    overlay = widgets.Dropdown(options=OVERLAYS, description="overlay")
    image, line = widgets.Image(format="jpeg", width=width_px), widgets.HTML()

    def look(_: Any = None) -> None:
        request = ViewRequest(
            rig=rig,
            surroundings=around,
            q1_deg=pan.value,
            q2_deg=tilt.value,
            width_px=width_px,
            overlay=cast("Any", overlay.value),
            full=True,
        )
        image.value, line.value = _seen(request)

    for control in (pan, tilt, overlay):
        control.observe(look, names="value")
    look()
    return widgets.VBox([image, pan, tilt, overlay, line])


def _seen(request: ViewRequest) -> tuple[bytes, str]:
    """Image as JPEG, and the line below it."""
    # What renders takes seconds to import.
    import cv2  # noqa: PLC0415

    from studio.views import see  # noqa: PLC0415

    view = see(request)
    azimuth, elevation, _ = view.gaze_deg
    jpeg = cv2.imencode(".jpg", view.image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()
    return jpeg, f"gaze {azimuth:.1f}° azimuth, {elevation:.1f}° elevation; {view.light} light, {view.render_ms:.0f} ms"
