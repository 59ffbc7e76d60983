"""Floor, light and camera, and the robots as they stand on it at an instant."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.motion import FOOT, ROTOR, TOP, position
from workbench.report.comparison import Comparison
from workbench.report.geometry import (
    MISSING,
    beam_points,
    beam_root,
    certainty,
    foot_corners,
    foot_pitch,
    ground_forces,
    missing_force,
    missing_scale,
)
from workbench.report.palette import EXTENDED, REAL, SHADES, TWIN, rgb
from workbench.report.scene import FORCE_M_PER_N
from workbench.timeseries import TimeSeries

__all__ = ["FilmStage", "PixelWindow", "Shot"]

Array = NDArray[np.float64]

_FOOT_THICKNESS_M = 0.008
_BEAM_M, _ARM_M, _ARROW_M, _LINK_M = 0.004, 0.003, 0.004, 0.0015
_TOP_M, _ROTOR_M = 0.011, 0.012
_GHOST = 0.6  # opacity of what was measured
_HEIGHT_M = 0.5  # of the picture at least: the robot and a little air
_ASPECT = 16 / 9
_AHEAD_M = 0.25  # shown before and behind the way
_EYE_DEG = (97.0, -18.0)  # azimuth and elevation: from the right and a little above
_MOST_GEOMS = 500
_XML = """
<mujoco>
  <visual>
    <global offwidth="{width}" offheight="{height}" fovy="{fovy}"/>
    <headlight ambient="0.45 0.45 0.45" diffuse="0.35 0.35 0.35" specular="0 0 0"/>
    <quality shadowsize="1024" numslices="20" numstacks="10" numquads="4"/>
    <map znear="0.01" shadowclip="{shadow}"/>
  </visual>
  <statistic extent="1"/>
  <asset>
    <texture type="skybox" builtin="gradient" rgb1="1 1 1" rgb2="0.93 0.95 0.97" width="64"
             height="64"/>
    <texture name="squares" type="2d" builtin="checker" width="256" height="256"
             rgb1="0.97 0.975 0.98" rgb2="0.915 0.925 0.935"/>
    <material name="floor" texture="squares" texrepeat="5 5" texuniform="true"/>
  </asset>
  <worldbody>
    <light pos="{light} -0.6 1.6" dir="0 {slant} -1" directional="true" diffuse="0.45 0.45 0.45"/>
    <geom type="plane" size="6 6 0.01" pos="0 0 {floor}" material="floor"/>
  </worldbody>
</mujoco>
"""
_FOVY_DEG = 24.0  # a long lens: little distortion towards the edges
_SLANT = 0.35  # how far to the left a shadow falls, of the height of what casts it
_EDGE = 3.0  # room around a point, in radii of what is drawn there: the head of an arrow is wider
_MARGIN_PX = 4


class PixelWindow(NamedTuple):
    """A part of the picture [px]; rows count from below, as OpenGL counts them."""

    left: int
    bottom: int
    width: int
    height: int


class Shot(NamedTuple):
    """A scene, and the part of the picture that its camera sees."""

    scene: mujoco.MjvScene
    window: PixelWindow


class FilmStage:
    """Where a run is shown: a floor of squares of 0.1 m and a camera that sees the whole way.

    Args:
        comparison: the run.
        times: (n,) the instants that can be shown [s], increasing.
        width: of the picture [px].
        height: of the picture [px].
    """

    def __init__(self, comparison: Comparison, times: Array, width: int, height: int) -> None:
        """Build floor and light, and aim the camera."""
        self._figure = comparison.figure
        self._real, self._twin = comparison.real.at(times), comparison.twin.at(times)
        extended, estimate = comparison.extended, comparison.estimate
        self._extended = None if extended is None else extended.motion.at(times)
        self._estimate = None if estimate is None else estimate.at(times)
        start, end = comparison.reach()
        self._size, self._floor = (width, height), comparison.floor_m - _FOOT_THICKNESS_M / 2
        self.model = mujoco.MjModel.from_xml_string(
            _XML.format(
                width=width, height=height, fovy=_FOVY_DEG, floor=self._floor,
                light=(start + end) / 2, slant=_SLANT, shadow=(end - start) / 2 + 2 * _AHEAD_M,
            )
        )  # fmt: skip
        self._edges: list[tuple[Array, float]] = []  # points and room around them
        self._data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self._data)
        self._scene = mujoco.MjvScene(self.model, maxgeom=_MOST_GEOMS)
        self._camera = _camera(start - _AHEAD_M, end + _AHEAD_M, comparison.floor_m)
        self._reach = 0.0 if comparison.estimate is None else missing_scale(comparison.estimate)
        self._option, self._perturb = mujoco.MjvOption(), mujoco.MjvPerturb()

    def empty(self) -> mujoco.MjvScene:
        """Return the whole picture's scene without any robot."""
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(
            self.model, self._data, self._option, self._perturb, self._camera, everything,
            self._scene,
        )  # fmt: skip
        return self._scene

    def at(self, time: float) -> Shot:
        """Return the scene at one of the times [s], as a window around the robots shows it.

        What was not seen then is not there. Outside of the window the picture is that of `empty`.
        """
        self.empty()
        self._edges.clear()
        estimate = None if self._estimate is None else self._estimate.between(time, time)
        self._add_measured(self._real.between(time, time), estimate)
        for motion, color in ((self._extended, EXTENDED), (self._twin, TWIN)):
            if motion is not None and motion.valid.any():
                self._add_simulated(motion.between(time, time), color)
        return Shot(self._scene, self._look_closer())

    def _look_closer(self) -> PixelWindow:
        """Narrow the camera's view to the robots and their shadows, and return what it sees."""
        width, height = self._size
        eye = mujoco.mjv_averageCamera(*self._scene.camera)
        if self._edges:
            points = np.array([point for point, _ in self._edges])
            room = np.array([radius for _, radius in self._edges])
            shadows = points + np.outer(points[:, 2] - self._floor, [0, _SLANT, -1])
            away = np.vstack([points, shadows]) - eye.pos
            scale = height / (eye.frustum_top - eye.frustum_bottom) * eye.frustum_near
            seen = away @ np.array([np.cross(eye.forward, eye.up), eye.up]).T
            seen *= (scale / (away @ eye.forward))[:, None]
            near = float(np.min(away @ eye.forward))
            edge = np.tile(room, 2)[:, None] * scale / near + _MARGIN_PX
            middle = np.array([width, height]) / 2
            low = np.floor(np.clip(middle + np.min(seen - edge, axis=0), 0, 2 * middle - 1))
            high = np.ceil(np.clip(middle + np.max(seen + edge, axis=0), low + 1, 2 * middle))
        else:
            low, high = np.zeros(2), np.ones(2)
        (left, bottom), (right, top) = low.astype(int).tolist(), high.astype(int).tolist()
        across = (eye.frustum_top - eye.frustum_bottom) / height  # of a pixel, on the near plane
        for camera in self._scene.camera:  # the left eye's and the right one's, averaged
            camera.frustum_center = across * ((left + right) / 2 - width / 2)
            camera.frustum_bottom = across * (bottom - height / 2)
            camera.frustum_top = across * (top - height / 2)
        return PixelWindow(left, bottom, right - left, top - bottom)

    def _add_simulated(self, motion: TimeSeries, color: str) -> None:
        figure = self._figure
        half = [figure.foot_length / 2, figure.foot_width / 2, _FOOT_THICKNESS_M / 2]
        foot = position(motion, FOOT)[0]
        self._add_foot(foot, foot_pitch(motion)[0], half, _ink(color))
        self._add_top(motion, _ink(color))
        beam = beam_points(motion, figure)[0]
        for begin, end in pairwise(beam):
            self._line(begin, end, _BEAM_M, _ink(color))
        pushed = ground_forces(motion, figure)
        if pushed is not None:
            for point, force in zip(pushed[0][0], pushed[1][0], strict=True):
                if np.isfinite(force).all() and force.any():
                    tip = point + FORCE_M_PER_N * force
                    self._line(point, tip, _ARROW_M, _ink(SHADES["force"]), arrow=True)

    def _add_measured(self, motion: TimeSeries, estimate: TimeSeries | None) -> None:
        """Add the real robot as a ghost, its beam as estimated, the fainter the less certain.

        Where there is no estimate, a thin line is drawn for the beam.
        """
        ink, figure = _ink(REAL, _GHOST), self._figure
        self._add_top(motion, ink)
        x, y = figure.foot_length / 2, figure.foot_width / 2
        edges = [[x, y], [x, -y], [-x, -y], [-x, y], [x, y]]
        for begin, end in pairwise(foot_corners(motion, edges)[0]):
            self._line(begin, end, _LINK_M, ink)  # a solid foot would hide the twin's
        if estimate is None:
            self._line(beam_root(motion, figure)[0], position(motion, TOP)[0], _LINK_M, ink)
            return
        for pair, sure in zip(
            pairwise(beam_points(estimate, figure)[0]), certainty(estimate)[0], strict=True
        ):
            self._line(*pair, _BEAM_M, _ink(REAL, _GHOST * float(np.nan_to_num(sure))))
        if MISSING["top"][0] in estimate:
            force, beyond = missing_force(estimate, "top")
            estimated = position(estimate, TOP)[0]
            if beyond[0]:
                tip = estimated + self._reach * force[0]
                self._line(estimated, tip, _ARROW_M, _ink(SHADES["missing"]), arrow=True)

    def _add_top(self, motion: TimeSeries, ink: NDArray[np.float32]) -> None:
        """Add T, rotor and the arm between them."""
        top, rotor = position(motion, TOP)[0], position(motion, ROTOR)[0]
        for centre, radius in ((top, _TOP_M), (rotor, _ROTOR_M)):
            if np.isfinite(centre).all():
                kind, level = mujoco.mjtGeom.mjGEOM_SPHERE, np.eye(3).ravel()
                mujoco.mjv_initGeom(self._next(), kind, np.full(3, radius), centre, level, ink)
                self._edges.append((centre, radius))
        self._line(top, rotor, _ARM_M, ink)

    def _add_foot(
        self, position: Array, pitch: float, half: Sequence[float], ink: NDArray[np.float32]
    ) -> None:
        if np.isfinite(position).all():
            c, s = np.cos(pitch), np.sin(pitch)
            turned, kind = np.array([c, 0, s, 0, 1, 0, -s, 0, c]), mujoco.mjtGeom.mjGEOM_BOX
            mujoco.mjv_initGeom(self._next(), kind, np.array(half), position, turned, ink)
            corners = np.array(list(product((-1, 1), repeat=3))) * half @ turned.reshape(3, 3).T
            self._edges += [(position + corner, 0.0) for corner in corners]

    def _line(
        self, begin: Array, end: Array, radius: float, ink: NDArray[np.float32], arrow: bool = False
    ) -> None:
        if not np.isfinite([*begin, *end]).all():
            return
        kind = mujoco.mjtGeom.mjGEOM_ARROW if arrow else mujoco.mjtGeom.mjGEOM_CAPSULE
        geom = self._next()
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), ink)
        mujoco.mjv_connector(geom, kind, radius, begin, end)
        self._edges += [(begin, _EDGE * radius), (end, _EDGE * radius)]

    def _next(self) -> mujoco.MjvGeom:
        """Return the scene's next free geom, which casts a shadow as a body does."""
        geom = self._scene.geoms[self._scene.ngeom]
        self._scene.ngeom += 1
        geom.category = mujoco.mjtCatBit.mjCAT_DYNAMIC.value
        return geom


def _camera(left: float, right: float, floor: float) -> mujoco.MjvCamera:
    """Return a camera that sees the way from left to right [m]."""
    height = max(_HEIGHT_M, (right - left) / _ASPECT)
    camera = mujoco.MjvCamera()
    camera.azimuth, camera.elevation = _EYE_DEG
    camera.lookat[:] = [(left + right) / 2, 0.0, floor + 0.3 * _HEIGHT_M]
    camera.distance = 1.06 * height / (2 * np.tan(np.radians(_FOVY_DEG / 2)))
    return camera


def _ink(color: str, opacity: float = 1.0) -> NDArray[np.float32]:
    return np.array([*(part / 255 for part in rgb(color)), opacity], np.float32)
