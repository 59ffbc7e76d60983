"""Photographs of a strip on a marker board, drawn without any of the reader's own code.

A pinhole camera with radial and tangential distortion looks at the board. The strip is a wall that
stands on the paper: its upper edge, its visible side and its end faces are drawn as polygons, far
ones first. Light falls off, aluminium is streaky and glares, the lens blurs, the sensor is noisy
and JPEG is lossy. Only the board's data, not its reading, is shared with the workbench.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from workbench.photo import BOARDS, Board
from workbench.schemas import ShapeFile

__all__ = ["TARGET", "Optics", "Scene", "board_texture", "random_scene", "render", "thesis_angles"]

Array = NDArray[np.float64]

TEXTURE_PX_PER_M = 8000
FINE = 2  # samples of the paper a pixel, each way
COVER_FINE = 5  # samples of the strip a pixel, each way
COARSE_PX = 16  # the paper's place is smooth: found on a grid, a spline between
WHITE, BLACK, FOOT_LINE = 0.85, 0.06, 0.3  # light that paper and inks return
CLEARANCE = 0.020  # [m] so that a strip, nearer to the camera than the paper, stays in the field
thesis_angles = np.array([
    -2.558, 0.01, 0.112, 0.042, 0.094, 0.147, 0.130, 0.217,
    0.182, 0.339, 0.339, 0.347, 0.399, 0.234, 0.344, 0.175,
])  # fmt: skip
TARGET = ShapeFile.model_validate({
    "schema": "workbench/shape-1", "name": "thesis", "angles": thesis_angles.tolist(),
    "length": "615 mm", "thickness": "2 mm", "width": "16 mm", "state": "unloaded",
    "source": "Appendix B",
})  # fmt: skip


class Optics(NamedTuple):
    """A camera.

    Args:
        size: columns and rows [pixel].
        focal: [pixel].
        lens: k1, k2, p1, p2 and k3 in the usual polynomial, in focal lengths.
        height: above the board [m].
        aside: (x, y) of the board's middle, where the camera hangs [m].
        roll: about its own axis [rad].
    """

    size: tuple[int, int] = (2000, 1500)
    focal: float = 4000.0
    lens: tuple[float, float, float, float, float] = (-0.4, 0.2, 0.0, 0.0, 0.0)
    height: float = 0.0
    aside: tuple[float, float] = (0.05, -0.08)
    roll: float = np.pi / 2


@dataclass(frozen=True)
class Scene:
    """What is photographed and how.

    Args:
        angles: (16,) alpha_0 to alpha_15 [rad].
        optics: the camera.
        length: of the strip [m].
        thickness: [m].
        width: by which its upper edge stands above the paper [m].
        place: (2,) where the middle of its box lies on the board [m]; None is the field's middle.
        turn: of forward against the board's x, counter-clockwise [rad].
        mirrored: whether it lies on its other edge.
        board: on which it lies.
        joint: (dx, dy, turn) of the upper sheet [m, m, rad].
        paint: red, green, blue that the upper edge returns.
        side: what its sides return, of the upper edge's.
        glare: number of spots.
        blur: standard deviation [pixel].
        noise: of the sensor at white, of full scale.
        quality: of the JPEG.
        uneven: how much light falls off across the board.
        seed: of everything random.
        without: of `strip`, `markers`: what is left out.
    """

    angles: Array
    optics: Optics = field(default_factory=Optics)
    length: float = 0.615
    thickness: float = 0.002
    width: float = 0.016
    place: tuple[float, float] | None = None
    turn: float = np.radians(8.0)
    mirrored: bool = False
    board: Board = BOARDS["A3"]
    joint: tuple[float, float, float] = (0.0, 0.0, 0.0)
    paint: tuple[float, float, float] = (0.62, 0.62, 0.64)
    side: float = 0.35
    glare: int = 6
    blur: float = 0.8
    noise: float = 0.015
    quality: int = 90
    uneven: float = 0.35
    seed: int = 1
    without: str = ""


def random_scene(
    seed: int, size: tuple[int, int], off: float, aligned: bool = False, **changes: object
) -> Scene:
    """A scene of the thesis' shape bent `off` [rad, standard deviation] wrong at each joint.

    The strip lies as it fits the field best; or, aligned, along the board's foot line, and is drawn
    anew until it fits so.
    """
    rng = np.random.default_rng(seed)
    angles = thesis_angles + np.append(rng.normal(0, off), rng.normal(0, off, 15))
    lens = (rng.uniform(-0.5, 0.3), rng.uniform(-0.5, 0.5),
            *rng.normal(0, 3e-4, 2), rng.normal(0, 0.5))  # fmt: skip
    focal = rng.uniform(1.6, 2.4) * size[0]
    optics = Optics(
        size,
        focal,
        lens,
        aside=(rng.normal(0, 0.08), rng.normal(0, 0.12)),
        roll=np.pi / 2 * (1 + 2 * rng.integers(0, 2)) + rng.normal(0, 0.04),
    )
    chosen: dict[str, object] = {
        "side": rng.uniform(0.15, 0.7),
        "glare": int(rng.integers(2, 12)),
        "blur": rng.uniform(0.6, 1.4),
        "noise": rng.uniform(0.008, 0.03),
        "quality": int(rng.integers(80, 96)),
        "uneven": rng.uniform(0.1, 0.45),
        "seed": seed,
    }
    scene = Scene(angles, optics, **(chosen | changes))  # type: ignore[arg-type]
    if aligned:
        while room(scene) < CLEARANCE:
            angles = thesis_angles + rng.normal(0, off, 16)
            scene = replace(scene, angles=angles)
        return scene
    return scene if "turn" in changes else replace(scene, turn=roomiest_turn(scene))


def roomiest_turn(scene: Scene) -> float:
    """How a person would lay the strip: turned so that it fits the field best [rad]."""
    turns = np.radians(np.arange(0, 180, 1.0))
    return float(max(turns, key=lambda turn: room(replace(scene, turn=turn))))


def room(scene: Scene) -> float:
    """How much wider or higher, whichever is less, the field is than the strip's box [m]."""
    low, high = scene.board.field
    points, _ = centreline(scene)
    return float(np.min((high - low) - np.ptp(points, axis=0)))


def centreline(scene: Scene) -> tuple[Array, Array]:
    """Points (n, 2) of the centreline on the board [m], 0.2 mm apart, and headings (n,)."""
    step = scene.length / 16
    count = 3200
    along = (np.arange(count) + 0.5) * scene.length / count
    rate = np.zeros(count)
    joint = np.floor(along / step + 0.5).astype(int)  # the joint whose arc a place lies on
    bent = (joint > 0) & (joint < 16)
    rate[bent] = scene.angles[joint[bent]] / step
    heading = scene.angles[0] + np.cumsum(rate) * scene.length / count
    middle = heading - rate * scene.length / count / 2
    steps = np.column_stack([np.cos(middle), -np.sin(middle)]) * scene.length / count
    points = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    if scene.mirrored:
        points = points * [-1, 1]
    turn = np.array(
        [[np.cos(scene.turn), -np.sin(scene.turn)], [np.sin(scene.turn), np.cos(scene.turn)]]
    )
    points = points @ turn.T
    low, high = points.min(axis=0), points.max(axis=0)
    middle_of_field = scene.board.size / 2 if scene.place is None else np.array(scene.place)
    points = points + middle_of_field - (low + high) / 2
    way = np.gradient(points, axis=0)
    return points, np.arctan2(way[:, 1], way[:, 0])


class Pinhole:
    """Projection of points in space to pixels, and the board's plane back."""

    def __init__(self, scene: Scene) -> None:
        optics = scene.optics
        columns, rows = optics.size
        self.focal, self.lens = optics.focal, optics.lens
        self.centre = np.array([columns - 1, rows - 1]) / 2
        middle = np.append(scene.board.size / 2, 0.0)
        height = optics.height or 1.12 * optics.focal * max(
            scene.board.size[1] / columns, scene.board.size[0] / rows
        )
        self.eye = middle + np.array([*optics.aside, height])
        ahead = (middle - self.eye) / np.linalg.norm(middle - self.eye)
        right = np.cross(ahead, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        down = np.cross(ahead, right)
        c, s = np.cos(optics.roll), np.sin(optics.roll)
        self.axes = np.array([c * right + s * down, c * down - s * right, ahead])

    def pixels(self, points: Array) -> Array:
        """(..., 3) [m] to (..., 2)."""
        seen = (points - self.eye) @ self.axes.T
        return self._distort(seen[..., :2] / seen[..., 2:]) * self.focal + self.centre

    def ground(self, pixels: Array) -> Array:
        """(n, 2) to places on the board's plane (n, 2) [m]."""
        seen = (pixels - self.centre) / self.focal
        flat = seen
        for _ in range(15):
            flat = flat - (self._distort(flat) - seen)
        ray = flat @ self.axes[:2] + self.axes[2]
        return (self.eye - ray * (self.eye[2] / ray[..., 2:]))[..., :2]

    def _distort(self, flat: Array) -> Array:
        k1, k2, p1, p2, k3 = self.lens
        x, y = flat[..., 0], flat[..., 1]
        r = x * x + y * y
        stretch = 1 + r * (k1 + r * (k2 + r * k3))
        return np.stack(
            [
                x * stretch + 2 * p1 * x * y + p2 * (r + 2 * x * x),
                y * stretch + p1 * (r + 2 * y * y) + 2 * p2 * x * y,
            ],
            axis=-1,
        )


def board_texture(board: Board, markers: bool = True) -> NDArray[np.float32]:
    """The printed paper as light returned, top row first, and half a centimetre around."""
    scale = TEXTURE_PX_PER_M
    columns, rows = (board.size * scale).round().astype(int)
    page = np.full((rows, columns), WHITE, dtype=np.float32)
    low, high = (np.rint(corner * scale).astype(int) for corner in board.field)
    page[rows - high[1] : rows - low[1], low[0] : high[0]] = BLACK
    size = round(board.square * scale)
    for column, row in board.squares:
        if (column + row) % 2 == 0:
            page[
                rows - (row + 1) * size : rows - row * size, column * size : (column + 1) * size
            ] = BLACK
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)
    side = round(board.marker * scale)
    gap = (size - side) // 2
    for number, (column, row) in enumerate(board.marked if markers else []):
        cells = cv2.aruco.generateImageMarker(dictionary, board.first_marker + number, side)
        top, left = rows - (row + 1) * size + gap, column * size + gap
        page[top : top + side, left : left + side] = np.where(cells > 127, WHITE, BLACK)
    start = np.array([0.05, 0.04])
    end = start + 0.15 * np.array([np.cos(np.radians(8)), np.sin(np.radians(8))])
    ends = [(int(p[0] * scale), int(rows - p[1] * scale)) for p in (start, end)]
    cv2.line(page, ends[0], ends[1], FOOT_LINE, 3)
    return page


def render(scene: Scene) -> bytes:
    """Return the photograph as a JPEG file's bytes."""
    rng = np.random.default_rng(scene.seed)
    camera = Pinhole(scene)
    light = _paper(scene, camera)
    if scene.without != "strip":
        light = _add_strip(scene, camera, light, rng)
    light *= _lamp(scene, camera)[..., None]
    bloom = cv2.GaussianBlur(np.maximum(light - 1.0, 0), (0, 0), 4.0)
    light = cv2.GaussianBlur(light, (0, 0), scene.blur) + 0.3 * bloom
    light = light + rng.normal(size=light.shape) * scene.noise * np.sqrt(np.clip(light, 0.02, 1))
    light = np.clip(light, 0, 1)
    stored = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    picture = np.rint(255 * stored[..., ::-1]).astype(np.uint8)
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, scene.quality])[1].tobytes()


def _paper(scene: Scene, camera: Pinhole) -> NDArray[np.float32]:
    """The board without the strip, (rows, columns, 3)."""
    columns, rows = scene.optics.size
    texture = board_texture(scene.board, scene.without != "markers")
    total = np.zeros((rows, columns), dtype=np.float32)
    x, y = (
        np.arange(-COARSE_PX, columns + 2 * COARSE_PX, COARSE_PX),
        np.arange(-COARSE_PX, rows + 2 * COARSE_PX, COARSE_PX),
    )
    known = camera.ground(np.stack(np.meshgrid(x, y), axis=-1).astype(float))
    splines = [RectBivariateSpline(y, x, known[..., k]) for k in (0, 1)]
    shifts = (np.arange(FINE) + 0.5) / FINE - 0.5
    for dx in shifts:
        for dy in shifts:
            ground = [one(np.arange(rows) + dy, np.arange(columns) + dx) for one in splines]
            place = _unjoined(scene, np.stack(ground, axis=-1))
            u = place[..., 0] * TEXTURE_PX_PER_M - 0.5
            v = texture.shape[0] - place[..., 1] * TEXTURE_PX_PER_M - 0.5
            total += cv2.remap(
                texture, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_CONSTANT, borderValue=WHITE,
            )  # fmt: skip
    return np.repeat((total / FINE**2)[..., None], 3, axis=2).astype(np.float32)


def _unjoined(scene: Scene, place: Array) -> Array:
    """Where on the drawing a place of the joined sheets lies."""
    if scene.board.sheets == 1:
        return place
    dx, dy, turn = scene.joint
    pivot = scene.board.size / 2
    back = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    upper = pivot + (place - pivot - [dx, dy]) @ back.T
    return np.where(place[..., 1:] > pivot[1], upper, place)


def _lamp(scene: Scene, camera: Pinhole) -> NDArray[np.float32]:
    """How much light falls on each pixel: a lamp to one side, and the lens' own falling off."""
    columns, rows = scene.optics.size
    x, y = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
    way = np.random.default_rng(scene.seed + 7).uniform(0, 2 * np.pi)
    slant = scene.uneven * (np.cos(way) * x + np.sin(way) * y)
    return ((1 + slant) * (1 - 0.15 * (x * x + y * y)) * 0.95).astype(np.float32)


def _add_strip(
    scene: Scene, camera: Pinhole, light: NDArray[np.float32], rng: np.random.Generator
) -> NDArray[np.float32]:
    points, heading = centreline(scene)
    normal = np.column_stack([-np.sin(heading), np.cos(heading)])
    left, right = (points + s * scene.thickness / 2 * normal for s in (1, -1))
    along = np.linspace(0, scene.length, len(points))
    inner = np.where((np.sum((points - camera.eye[:2]) * normal, axis=1) > 0)[:, None], right, left)
    shine = _shine(scene, along, rng)
    paint, metal = np.array(scene.paint), np.array([0.62, 0.62, 0.64])
    wall = np.concatenate([inner, inner[::-1]])
    lift = np.repeat([0.0, scene.width], len(points))
    side_light = scene.side * (0.7 + 0.3 * np.sin(9 * along + rng.uniform(0, 6)))
    light = _painted(camera, light, np.column_stack([wall, lift]), side_light, metal)
    for k, way in ((0, -1), (-1, 1)):
        face = np.array([*left[[k]], *right[[k]], *right[[k]], *left[[k]]])
        if way * np.dot(points[k] - camera.eye[:2], [np.cos(heading[k]), np.sin(heading[k])]) < 0:
            solid = np.column_stack([face, [0, 0, scene.width, scene.width]])
            light = _painted(camera, light, solid, np.full(2, scene.side), metal)
    top = np.column_stack(
        [np.concatenate([left, right[::-1]]), np.full(2 * len(points), scene.width)]
    )
    return _painted(camera, light, top, shine, paint)


def _shine(scene: Scene, along: Array, rng: np.random.Generator) -> Array:
    """How brightly each place of the upper edge returns light: streaks and glaring spots."""
    waves = rng.uniform(0, 2 * np.pi, 6)
    shine = 1 + 0.12 * sum(np.sin((20 + 40 * k) * along + w) for k, w in enumerate(waves)) / 2
    for _ in range(scene.glare):
        middle, spread = rng.uniform(0, scene.length), rng.uniform(0.002, 0.008)
        shine = shine + rng.uniform(0.8, 4.0) * np.exp(-0.5 * ((along - middle) / spread) ** 2)
    return np.maximum(shine, 0.4)


def _painted(
    camera: Pinhole, light: NDArray[np.float32], outline: Array, shine: Array, paint: Array
) -> NDArray[np.float32]:
    """Draw a band whose brightness runs along it, its two long sides one after the other."""
    rows, columns = light.shape[:2]
    half = len(outline) // 2
    seen = camera.pixels(outline)
    one, other = seen[:half], seen[half:][::-1]
    fine = COVER_FINE
    box_low = np.maximum(np.floor(seen.min(axis=0)).astype(int) - 2, 0)
    box_high = np.minimum(np.ceil(seen.max(axis=0)).astype(int) + 3, [columns, rows])
    wide, tall = box_high - box_low
    if wide <= 0 or tall <= 0:
        return light
    cover = np.zeros((tall, wide), dtype=np.float32)
    # light of a pixel: that of the nearest station, spread to the band's surroundings by blurring
    shade = np.zeros((tall, wide), dtype=np.float32)
    weight = np.zeros((tall, wide), dtype=np.float32)
    for band in range(0, tall, 256):
        rows_here = min(256, tall - band)
        mask = np.zeros((rows_here * fine, wide * fine), dtype=np.uint8)
        quads = np.stack([one[:-1], one[1:], other[1:], other[:-1]], axis=1)
        local = (quads - box_low - [0, band] + 0.5) * fine - 0.5
        high, low = local[..., 1].max(axis=1), local[..., 1].min(axis=1)
        inside = (high > -9) & (low < rows_here * fine + 9)
        for quad in np.rint(local[inside] * 16).astype(np.int32):
            cv2.fillConvexPoly(mask, quad, 255, cv2.LINE_8, 4)
        cover[band : band + rows_here] = (
            cv2.resize(mask, (wide, rows_here), interpolation=cv2.INTER_AREA) / 255
        )
    for share in np.linspace(0, 1, 9):
        spots = np.rint(one + share * (other - one) - box_low).astype(int)
        good = ((spots >= 0) & (spots < [wide, tall])).all(axis=1)
        np.add.at(shade, (spots[good, 1], spots[good, 0]), _spread(shine, half)[good])
        np.add.at(weight, (spots[good, 1], spots[good, 0]), 1.0)
    shade, weight = (cv2.GaussianBlur(one_of, (0, 0), 1.5) for one_of in (shade, weight))
    value = (shade / np.maximum(weight, 1e-6))[..., None] * paint
    part = light[box_low[1] : box_high[1], box_low[0] : box_high[0]]
    mixed = part * (1 - cover[..., None]) + value * cover[..., None]
    result = light.copy()
    result[box_low[1] : box_high[1], box_low[0] : box_high[0]] = mixed
    return result


def _spread(shine: Array, count: int) -> Array:
    return np.interp(np.linspace(0, 1, count), np.linspace(0, 1, len(shine)), shine)
