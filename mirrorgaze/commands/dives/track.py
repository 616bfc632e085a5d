"""The loop on recorded or live images."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_progress, print_step, print_table

if TYPE_CHECKING:
    from tracking.loop.offline import Tracked

REPORT_EVERY_IMAGES = 30


def track(
    source: Annotated[
        str, typer.Argument(metavar="VIDEO|CAMERA", help="Video, folder of PNGs, or a camera: 0, /dev/video0.")
    ],
    rig: Annotated[str, typer.Option(metavar="RIG", help="Preset name or rig file of the camera.")],
    variant: Annotated[str, typer.Option(help="Variant of the loop: default, paper, paper-literal.")] = "default",
    detector: Annotated[
        str,
        typer.Option(help="Detector: red-ball (in water), narrow-hue (near), wide-hue, onnx:FILE (a learned model)."),
    ] = "red-ball",
    joints: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Joint angles of a recording: a CSV with time_s, q1_deg, q2_deg, or a log.parquet."
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Calibration file of the built rig, from mirrorgaze calibrate."),
    ] = None,
    mirrors: Annotated[
        str, typer.Option(metavar="DRIVER", help="Driver of a live camera's mirrors: none, maestro:PORT.")
    ] = "none",
    check: Annotated[
        bool, typer.Option("--check/--no-check", help="Move the servos for 3 s before looking, so that they are known.")
    ] = True,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/RIG-track"),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Track a target in a video or through a live camera.

    Writes what the loop saw and estimated as a video (overlay.mp4), one row per image (log.parquet) and a summary
    (track.json). Without --mirrors nothing is turned, and without --joints the mirror is taken to stand at q1 = q2 = 0.
    Ctrl-C ends the run; what there is by then is finished.

    \b
    Example:
      mirrorgaze track dive.mkv --rig aqua2 --joints joints.csv -o out/track
      mirrorgaze track /dev/video0 --rig my-auv.toml --calibration built.toml --mirrors maestro:/dev/ttyACM0
    """
    from mirrorgaze.loading import load_usable_rig
    from tracking.calibration.calibrated_rig import CalibratedRig
    from tracking.cameras import LiveCamera, open_camera
    from tracking.loop.loop import TrackingLoop
    from tracking.loop.offline import detector_named, until_interrupted, variant_named
    from tracking.loop.offline import track as run
    from tracking.mirrors import NO_MIRRORS, open_mirrors

    loaded = load_usable_rig(rig)
    if calibration is not None:
        loaded = CalibratedRig.load(calibration, loaded).with_joint_offsets()
    chosen = variant_named(variant, turning=check and mirrors != NO_MIRRORS)
    settings = detector_named(detector)
    folder = output or Path("out") / f"{loaded.name}-track"
    print_step("images ...")
    with ExitStack() as stack:
        camera = stack.enter_context(closing(open_camera(source, loaded)))
        live = isinstance(camera, LiveCamera)
        driver = stack.enter_context(open_mirrors(mirrors, loaded, joints=joints, live=live))
        loop = TrackingLoop(loaded, chosen, detector=settings)
        tracked = run(
            camera,
            driver,
            loop,
            folder,
            rig=loaded,
            about={
                "source": source,
                "rig": loaded.name,
                "variant": variant,
                "detector": detector,
                "mirrors": mirrors,
                "joints": None if joints is None else str(joints),
                "calibration": None if calibration is None else str(calibration),
            },
            clock=camera.now_s if isinstance(camera, LiveCamera) else None,
            progress=_progress(camera.expected_images),
            stopped=stack.enter_context(until_interrupted()),
        )
    if json:
        print_json(tracked.as_dict() | {"frames_per_s": tracked.frames_per_s, "folder": str(folder)})
        return
    ending = ", interrupted" if tracked.interrupted else ""
    typer.echo(f"{folder}: overlay.mp4, log.parquet, track.json{ending}")
    print_table(_rows(tracked))


def _progress(expected: int | None) -> Callable[[int], None]:
    def report(done: int) -> None:
        if done % REPORT_EVERY_IMAGES and done != expected:
            return
        if expected is None:
            typer.echo(f"\rtrack: {done} images", err=True, nl=False)
        else:
            print_progress("track", done, expected)

    return report


def _rows(tracked: Tracked) -> list[tuple[str, str]]:
    modes = ", ".join(f"{mode} {count}" for mode, count in tracked.modes.items() if count)
    return [
        ("  images", f"{tracked.images}, from {tracked.first_s:.2f} to {tracked.last_s:.2f} s"),
        ("  skipped", f"{tracked.skipped}; {tracked.missing} missing by the time stamps"),
        ("  detected", f"in {tracked.detected} ({tracked.detected / max(tracked.images, 1):.1%})"),
        ("  modes", modes),
        ("  speed", f"{tracked.frames_per_s:.1f} images/s, overlay and log included"),
    ]
