# SPDX-License-Identifier: GPL-3.0-or-later
"""What scenarios see: the display's pixels, final renders, and how far they are apart.

Pictures are arrays (height, width, 3) of 0 to 1 as shown, rows from the top.
"""

import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from brume import session
from drive import view_area, windows
from mathutils import Matrix

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests" / "pictures"))
from compare import write_png  # noqa: E402

OUT = ROOT / "out" / "viewport"
BLOCKS = 32         # a side
CLOSE = 0.02        # of displayed pictures and final renders of the same
EDGE = 18           # pixels, of round corners and the arrows of hidden bars
VIEW_SENSOR = 72.0  # of the camera that sees what a 3D view sees, in mm


def screen():
    """The display's pixels."""
    size = subprocess.run(["xdotool", "getdisplaygeometry"], check=True, capture_output=True)
    width, height = (int(word) for word in size.stdout.split())
    shot = subprocess.run(["import", "-window", "root", "-depth", "8", "rgb:-"], check=True,
                          capture_output=True).stdout
    return np.frombuffer(shot, np.uint8).reshape(height, width, 3) / 255.0


def shown(region):
    """What the display shows of a region."""
    top = windows()[0].height - region.y - region.height
    return screen()[top:top + region.height, region.x:region.x + region.width]


def part(picture, box):
    """A box (x0, y0, x1, y1 in fractions from the lower left) of a picture, at whole pixels."""
    height, width = picture.shape[:2]
    x0, y0, x1, y1 = box
    return picture[round((1 - y1) * height):round((1 - y0) * height),
                   round(x0 * width):round(x1 * width)]


def block_means(picture, box=(0.0, 0.0, 1.0, 1.0), blocks=BLOCKS):
    """Means over a grid of blocks that fills a box, which may cut through pixels."""
    height, width = picture.shape[:2]
    x0, y0, x1, y1 = box
    means = picture
    for axis, edges in enumerate((np.linspace(1 - y1, 1 - y0, blocks + 1) * height,
                                  np.linspace(x0, x1, blocks + 1) * width)):
        pixels = np.arange(means.shape[axis])
        # how much of each pixel is in each block
        cover = np.clip(np.minimum(edges[1:, None], pixels + 1)
                        - np.maximum(edges[:-1, None], pixels), 0, 1)
        cover /= cover.sum(1, keepdims=True)
        means = np.moveaxis(np.tensordot(cover, means, (1, axis)), 0, axis)
    return means


def apart(picture, reference, box=(0.0, 0.0, 1.0, 1.0), reference_box=(0.0, 0.0, 1.0, 1.0)):
    """The sum of absolute differences of the block means over the reference's sum."""
    a, b = block_means(picture, box), block_means(reference, reference_box)
    return np.abs(a - b).sum() / b.sum()


def something(picture):
    """Asserts that there is something to see."""
    assert picture.std() > 0.02, f"an even picture, about {picture.mean((0, 1))}"


def alike(picture, reference, what, tolerance=CLOSE, **boxes):
    """Asserts that two pictures are the same, as far as can be; gives how far they are apart."""
    something(reference)
    found = apart(picture, reference, **boxes)
    if found >= tolerance:
        keep(what, shown=picture, reference=reference)
    assert found < tolerance, f"{what}: {found:.4f} apart, {tolerance} allowed; see {OUT}"
    return float(found)


def keep(what, **pictures):
    """Leaves pictures for a person to look at."""
    OUT.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures.items():
        write_png(OUT / f"{what.replace(' ', '-')}-{name}.png", picture[::-1])


def different(picture, other, what, least=0.02):
    """Asserts that two pictures differ clearly."""
    found = apart(picture, other)
    assert found > least, f"{what}: only {found:.4f} apart"


# -- final renders


def saved_render():
    """The last final render as it is shown."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "render.png")
        settings = bpy.context.scene.render.image_settings
        settings.file_format, settings.color_mode = 'PNG', 'RGB'
        bpy.data.images["Render Result"].save_render(path)
        image = bpy.data.images.load(path, check_existing=False)
        width, height = image.size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[::-1, :, :3]


def final():
    """A final render of the scene as it is, exported from nothing."""
    session.drop("final")
    bpy.ops.render.render()
    return saved_render()


@contextmanager
def eye(region):
    """For the time being the scene's camera is one that sees what a 3D view's region sees (not
    through a camera). An orthographic view also sees what is behind its plane."""
    scene, space, view = bpy.context.scene, view_area().spaces.active, region.data
    data = bpy.data.cameras.new("Eye")
    data.sensor_width, data.lens = VIEW_SENSOR, space.lens
    data.clip_start, data.clip_end = space.clip_start, space.clip_end
    if not view.is_perspective:
        data.type, data.ortho_scale = 'ORTHO', view.view_distance * VIEW_SENSOR / space.lens
    place = view.view_matrix.inverted()
    if not view.is_perspective:
        place @= Matrix.Translation((0.0, 0.0, space.clip_end / 2))
        data.clip_start = 1e-3
    ob = bpy.data.objects.new("Eye", data)
    ob.matrix_world = place
    scene.collection.objects.link(ob)
    before = scene.camera, scene.render.resolution_x, scene.render.resolution_y
    scene.camera = ob
    scene.render.resolution_x, scene.render.resolution_y = region.width, region.height
    try:
        yield ob
    finally:
        scene.camera, scene.render.resolution_x, scene.render.resolution_y = before
        bpy.data.cameras.remove(data)  # and its object


def as_rendered(region, what, **options):
    """Asserts that a region shows what a final render of the same shows, but for its edges, which
    Blender draws on."""
    picture = shown(region)
    with eye(region):
        reference = final()
    edge = slice(EDGE, -EDGE)
    return alike(picture[edge, edge], reference[edge, edge], what, **options)


def camera_box(region):
    """The box of a region that the camera's picture takes, in fractions."""
    scene = bpy.context.scene
    corners = [scene.camera.matrix_world @ corner
               for corner in scene.camera.data.view_frame(scene=scene)]
    places = np.array([location_3d_to_region_2d(region, region.data, corner)
                       for corner in corners]) / (region.width, region.height)
    return (*places.min(0), *places.max(0))


def as_camera_sees(region, what, **options):
    """The same of a view through the scene's camera; only of what the region shows of its
    picture."""
    picture, (x0, y0, x1, y1) = shown(region), camera_box(region)
    seen = max(x0, 0.0), max(y0, 0.0), min(x1, 1.0), min(y1, 1.0)
    within = [(value - low) / (high - low) for value, low, high in
              zip(seen, (x0, y0, x0, y0), (x1, y1, x1, y1))]
    return alike(picture, final(), what, box=seen, reference_box=within, **options)
