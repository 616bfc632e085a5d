"""What the reference renderer does not know of a scene and a rig: waves, snow and lamps."""

from __future__ import annotations

from rigs import Rig
from scenes.stage.scene import Scene


def check_known_to_reference(scene: Scene) -> None:
    """Raise `ValueError` for a scene with waves or snow."""
    problems = []
    if scene.sea.wind.speed_m_per_s:
        problems.append(f"a flat sea (wind of 0 m/s), got {scene.sea.wind.speed_m_per_s:g} m/s")
    if scene.snow is not None:
        problems.append("no marine snow, got some")
    if problems:
        raise ValueError(f"expected for the reference renderer {'; '.join(problems)}")


def without_lamps(rig: Rig) -> tuple[Rig, tuple[str, ...]]:
    """Rig with its lamps off, and the sentence that says so; none for a rig without lamps."""
    if not rig.lamps:
        return rig, ()
    return rig.model_copy(update={"lamps": ()}), (f"{rig.name}: lamps are off, the reference renderer knows none",)
