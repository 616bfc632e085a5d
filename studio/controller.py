"""The studio without its page: a session, where the joints are, what is asked of the workers, and who hears of it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.gaze.kinematics import fold_reflection, inverse_gaze, inverse_reflection
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig, RigError
from studio.design import change_at
from studio.lines import change_line, command_line, view_line
from studio.results import Checked, Covered, Judgement, Parts, View, ViewRequest
from studio.session import Session
from studio.surroundings import Overlay, Surroundings
from studio.workers import Asked, Failed, Worker

REST_S = 1.0
"""How long nothing moves before the light is found in full."""

VIEW, JUDGEMENT, COARSE, PARTS, FINE = "image", "rig", "coarse coverage", "mount", "fine coverage"
LIGHT, CHECKS = "full light", "checks of the mount"
OTHER_PARTS, OTHER_COVERAGE = "mount of the other rig", "coverage of the other rig"


@dataclass(frozen=True)
class Heard:
    """Who hears of what; each is called from some thread.

    Attributes
    ----------
    changed : callable
        The rig is another; takes it.
    view, parts, covered, judged, checked : callable
        Take results.
    other_parts, other_covered : callable
        Take those of the rig beside.
    said : callable
        Takes a sentence, and whether it is one of something wrong.
    did : callable
        Takes the line that does the same as what was just done.
    """

    changed: Callable[[Rig], None] = lambda rig: None
    view: Callable[[View], None] = lambda view: None
    parts: Callable[[Parts], None] = lambda parts: None
    covered: Callable[[Covered], None] = lambda covered: None
    judged: Callable[[Judgement], None] = lambda judged: None
    checked: Callable[[Checked], None] = lambda checked: None
    other_parts: Callable[[Parts], None] = lambda parts: None
    other_covered: Callable[[Covered], None] = lambda covered: None
    said: Callable[[str, bool], None] = lambda sentence, wrong: None
    did: Callable[[str], None] = lambda line: None


@dataclass
class Crew:
    """The processes: one for images, one for analyses, one for what takes long, each behind what is more urgent."""

    images: Asked
    analyses: Asked
    slow: Asked

    @classmethod
    def of(cls, answered: Callable[[str, Any], None]) -> Crew:
        """Three processes; they start when they are first asked."""
        return cls(
            images=Worker((VIEW,), answered),
            analyses=Worker((JUDGEMENT, COARSE, PARTS, FINE, OTHER_PARTS, OTHER_COVERAGE), answered, nice=5),
            slow=Worker((LIGHT, CHECKS), answered, nice=15),
        )

    def close(self) -> None:
        """End all."""
        for worker in (self.images, self.analyses, self.slow):
            worker.close()


@dataclass
class Pose:
    """Where the joints are, and how the image is shown."""

    q1_deg: float
    q2_deg: float
    width_px: int = 640
    overlay: Overlay = "none"
    sensor: bool = False
    surroundings: Surroundings = field(default_factory=Surroundings)


class Studio:
    """A rig in the studio.

    Parameters
    ----------
    session : Session
    crew : callable
        Takes what is called with topic and result, and gives the workers.
    width_px : int
        Of the camera's image.
    """

    def __init__(
        self, session: Session, *, crew: Callable[[Callable[[str, Any], None]], Crew] = Crew.of, width_px: int = 640
    ) -> None:
        self.session = session
        self.heard = Heard()
        q1, q2 = within(session.rig, 0.0, 0.0)
        self.pose = Pose(q1_deg=q1, q2_deg=q2, width_px=width_px)
        self._meshes: Parts | None = None
        self._lit: tuple[Rig, Surroundings] | None = None
        self._checked: Rig | None = None
        self._rest: threading.Timer | None = None
        self._lock = threading.RLock()
        self._closed = False
        self._crew = crew(self._answered)

    def start(self) -> None:
        """Ask for all that there is to know of the rig."""
        self._new_rig()

    def close(self) -> None:
        """End the workers."""
        with self._lock:
            self._closed = True
            if self._rest is not None:
                self._rest.cancel()
        self._crew.close()

    def turn(self, q1_deg: float, q2_deg: float) -> None:
        """Move the joints, as far as their limits let them."""
        self.pose.q1_deg, self.pose.q2_deg = within(self.session.rig, q1_deg, q2_deg)
        self._look()

    def look_towards(self, direction: ArrayLike) -> bool:
        """Turn the gaze to a direction of the body frame, by the nearest joint values; False out of their reach."""
        x, y, z = np.asarray(direction, dtype=np.float64) / np.linalg.norm(direction)
        return self._turn_nearest(inverse_gaze(self._layout, float(np.arctan2(y, x)), float(np.arcsin(z))))

    def show_at(self, direction: ArrayLike, sight: ArrayLike) -> bool:
        """Bring a direction of the body frame to where the camera looks along `sight`; False out of the joints' reach.

        Parameters
        ----------
        direction : array, shape (3,)
            Unit vector; what is far away that way.
        sight : array, shape (3,)
            Unit vector behind the port, body frame.
        """
        incoming = fold_reflection(self._layout, sight)
        return self._turn_nearest(inverse_reflection(self._layout, incoming, direction))

    @property
    def _layout(self) -> Layout:
        return Layout.from_rig(self.session.rig)

    def _turn_nearest(self, joint_values: FloatArray) -> bool:
        """Turn to the nearest of some joint values, radians, shape (k, 2); False when there is none."""
        if not len(joint_values):
            return False
        found, here = np.degrees(joint_values), np.array([self.pose.q1_deg, self.pose.q2_deg])
        q1, q2 = found[np.abs(found - here).sum(axis=1).argmin()]
        self.turn(float(q1), float(q2))
        return True

    def set_beside(self, source: str) -> bool:
        """Look at another rig too, a preset or a file; says what is wrong with it."""
        try:
            other = Rig.load(source)
            other.require_gaze()
        except (OSError, ValueError) as error:
            self.heard.said(str(error), True)
            return False
        self._crew.analyses.ask(OTHER_PARTS, "studio.analyses:parts_of", other)
        self._crew.analyses.ask(OTHER_COVERAGE, "studio.analyses:coverage_of", other, None, "coarse")
        self.heard.did(command_line(["compare-designs", self.session.autosave.name, source]))
        return True

    def surround(self, **changes: Any) -> None:
        """Change world, water or light."""
        self.pose.surroundings = replace(self.pose.surroundings, **changes)
        self._look()

    def show(self, *, overlay: Overlay | None = None, sensor: bool | None = None) -> None:
        """Change what the image shows."""
        self.pose.overlay = self.pose.overlay if overlay is None else overlay
        self.pose.sensor = self.pose.sensor if sensor is None else sensor
        self._look()

    def change(self, place: str, value: Any) -> bool:
        """Give a place of the rig another value; says what is wrong, and returns False, when that makes no rig."""
        values = change_at(self.session.rig, place, value)
        if not self._try(lambda: self.session.change(values)):
            return False
        self.heard.did(change_line(values))
        return True

    def undo(self) -> None:
        """Take the last change back."""
        if self.session.undo():
            self._new_rig()

    def redo(self) -> None:
        """Take it again."""
        if self.session.redo():
            self._new_rig()

    def read_back(self) -> bool:
        """Take over what a command wrote into the autosaved file."""
        return self._try(self.session.read_back)

    def back_to_file(self) -> bool:
        """Take the rig as its file has it."""
        return self._try(self.session.back_to_file)

    def save(self, path: Path) -> bool:
        """Write the rig file; says where, or what was wrong."""
        try:
            written = self.session.save(path)
        except (OSError, ValueError) as error:
            self.heard.said(str(error), True)
            return False
        self.heard.said(f"{written}: saved", False)
        self.heard.did(f"rig.save({str(written)!r})")
        return True

    def _try(self, act: Callable[[], Rig]) -> bool:
        before = self.session.rig
        try:
            act()
        except (RigError, OSError, ValueError) as error:
            self.heard.said(str(error), True)
            return False
        if self.session.rig != before:
            self._new_rig()
        return True

    def _new_rig(self) -> None:
        """Lay the rig out again, and ask for what follows from it; what is still asked for the old one is dropped."""
        rig = self.session.rig
        self.pose.q1_deg, self.pose.q2_deg = within(rig, self.pose.q1_deg, self.pose.q2_deg)
        self.heard.changed(rig)
        if self._checked not in (None, rig):
            self._checked = None
            self._crew.slow.stop_work(CHECKS)
        known = self._meshes is not None and self._meshes.rig == rig
        analyses = self._crew.analyses
        analyses.ask(JUDGEMENT, "studio.analyses:judgement_of", rig)
        if self._meshes is not None:
            # With the last mount: the new one takes seconds to build.
            analyses.ask(COARSE, "studio.analyses:coverage_of", rig, self._meshes.meshes, "coarse")
        if known:
            analyses.ask(FINE, "studio.analyses:coverage_of", rig, None, "fine")
            self._look()
        else:
            analyses.ask(PARTS, "studio.analyses:parts_of", rig)

    def _look(self, *, full: bool = False) -> None:
        """Ask for an image; of a rig whose mount is not there yet it is asked for when it is."""
        with self._lock:
            if self._meshes is None or self._closed:
                return
            self._crew.images.ask(VIEW, "studio.views:see", self._request(self._meshes.rig, full=full))
            if not full:
                self._rest_anew()

    def _request(self, rig: Rig, *, full: bool = False) -> ViewRequest:
        pose = self.pose
        # The rig with the newest mount may still have other limits than the rig with the newest numbers.
        q1, q2 = within(rig, pose.q1_deg, pose.q2_deg)
        return ViewRequest(
            rig=rig,
            surroundings=pose.surroundings,
            q1_deg=q1,
            q2_deg=q2,
            width_px=pose.width_px,
            overlay=pose.overlay,
            sensor=pose.sensor,
            full=full,
            asked_s=time.monotonic(),
        )

    def _rest_anew(self) -> None:
        if self._rest is not None:
            self._rest.cancel()
        self._rest = threading.Timer(REST_S, self._rested)
        self._rest.daemon = True
        self._rest.start()

    def _rested(self) -> None:
        """Nothing has moved for a while: find the light in full, unless that is known or being found."""
        with self._lock:
            if self._meshes is None or self._closed:
                return
            rig = self._meshes.rig
            self.heard.did(view_line(self.session.autosave.name, self._request(rig)))
            wanted = (rig, self.pose.surroundings)
            if wanted != self._lit:
                self._lit = wanted
                self._crew.slow.stop_work(LIGHT)
                self._crew.slow.ask(LIGHT, "studio.analyses:light_of", *wanted)
            if rig != self._checked:
                self._checked = rig
                self._crew.slow.ask(CHECKS, "studio.analyses:checks_of", rig)

    def _answered(self, topic: str, answer: Any) -> None:
        if self._closed:
            return
        if isinstance(answer, Failed):
            self._failed(topic, answer)
        elif topic == OTHER_PARTS:
            self.heard.other_parts(answer)
        elif topic == OTHER_COVERAGE:
            self.heard.other_covered(answer)
        elif isinstance(answer, Checked):
            self.heard.checked(answer)
        elif isinstance(answer, View):
            self.heard.view(answer)
        elif isinstance(answer, Judgement):
            self.heard.judged(answer)
        elif isinstance(answer, Covered):
            self.heard.covered(answer)
        elif isinstance(answer, Parts):
            self._have_parts(answer)
        elif topic == LIGHT:
            self._look(full=True)

    def _failed(self, topic: str, failed: Failed) -> None:
        if topic in (LIGHT, CHECKS) and failed.stopped:
            return
        self._lit = None if topic == LIGHT else self._lit
        self.heard.said(f"{topic}: {failed.sentence}", True)

    def _have_parts(self, parts: Parts) -> None:
        self._meshes = parts
        self.heard.parts(parts)
        if parts.rig == self.session.rig:
            self._crew.analyses.ask(COARSE, "studio.analyses:coverage_of", parts.rig, parts.meshes, "coarse")
            self._crew.analyses.ask(FINE, "studio.analyses:coverage_of", parts.rig, parts.meshes, "fine")
        self._look()


def within(rig: Rig, q1_deg: float, q2_deg: float) -> tuple[float, float]:
    """Joint values brought within the limits of a rig, degrees."""
    joints = rig.require_gaze().joints
    q1, q2 = (
        float(np.clip(value, joint.min_deg, joint.max_deg))
        for value, joint in ((q1_deg, joints.pan), (q2_deg, joints.tilt))
    )
    return q1, q2
