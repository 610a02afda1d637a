# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables 2 and 3 of the OPV paper on this machine, and the ways to find optical depths beside one
another. Appends a JSON line to out/bench/opv.jsonl:

    python3 bench/opv.py

A box of Gaussians between a floor and two walls, lamps in it; pictures of 200x150 pixels, one
sample each. Frames are medians, propagation (the stage "transport") the best of all.
"""

import argparse
import importlib.util
import os
import sys
from functools import partial
from types import SimpleNamespace

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from place import ROOT, here, keep


def _native():
    """The binding alone: the add-on around it needs Blender."""
    path = os.path.join(ROOT, 'addon', 'brume', 'native.py')
    spec = importlib.util.spec_from_file_location('brume_native', path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


native = _native()

SIZES = (15, 20, 30, 40)
LIGHTS = (1, 2, 4, 8)
COUNTS = (1, 125, 1000, 8000, 27000)
WIDTH, HEIGHT = 200, 150
WAYS = ('PROPAGATED', 'MARCHED', 'CORRECTED', 'PAPER', 'ITERATED')

# density of the Gaussians: half scattered, half absorbed
PROGRAM = SimpleNamespace(
    instructions=[(native.OP['GRID'], 0, 0, 0, 0, (0.0,) * 3),
                  (native.OP['CONSTANT'], 1, 0, 0, 0, (0.5,) * 3),
                  (native.OP['MULTIPLY'], 2, 0, 1, 0, (0.0,) * 3),
                  (native.OP['CONSTANT'], 3, 0, 0, 0, (0.0,) * 3)],
    ramps=np.zeros((0, native.RAMP_SIZE, 3), np.float32), sigma_s=2, sigma_a=2, g=3, emission=3)
GREY = dict(diffuse=(0.7,) * 3, specular=(0,) * 3, metal=(0,) * 3, emission=(0,) * 3,
            transparent=(0,) * 3, roughness=1.0, alpha=1.0, alpha_mode='OPAQUE')


def matrix(rows):
    return native.Mat4(*np.asarray(rows, np.float32).T.ravel())


def view():
    """Looks into the box [-1, 1]^3 from the front."""
    near, far, focal = 0.1, 20.0, 2.2
    view_from_world = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, -4.2], [0, 0, 0, 1]], float)
    clip = np.array([[focal * HEIGHT / WIDTH, 0, 0, 0], [0, focal, 0, 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
                     [0, 0, -1, 0]])
    return native.View(width=WIDTH, height=HEIGHT, view_from_world=matrix(view_from_world),
                       clip_from_view=matrix(clip), clip_near=near, clip_far=far, samples=1)


def gaussians(count, lots, strength=1.0):
    """`count` of them in the box, with the same mean density whatever their number."""
    side = count ** (1 / 3)
    radius = 1.0 if count == 1 else 2.2 / side
    scale = 2.0 / radius
    centers = np.zeros((1, 3)) if count == 1 else lots.uniform(radius - 1, 1 - radius, (count, 3))
    amplitude = strength * 4.0 / (count * (np.sqrt(np.pi) / scale) ** 3)
    return np.column_stack([centers, np.full(count, scale), np.ones((count, 3)),
                            np.full(count, amplitude)]).astype(np.float32)


class Box:
    def __init__(self, device, count):
        self.scene = native.Scene(device)
        self.count, self.lots = count, np.random.default_rng(1)
        self.place_lots = np.random.default_rng(2)
        corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
                           np.float32)
        faces = np.array([(0, 4, 6), (0, 6, 2), (2, 6, 7), (2, 7, 3), (0, 2, 3), (0, 3, 1)],
                         np.uint32)  # floor, back, left
        self.scene.set_material(1, name='grey', **GREY)
        self.scene.set_mesh(1, name='box', positions=corners, triangles=faces, materials=(1,))
        self.scene.set_instances(1, mesh=1, world_from_object=np.eye(4)[None],
                                 visibility=native.VISIBLE_CAMERA | native.VISIBLE_SHADOW)
        self.change_medium()

    def change_medium(self):
        terms = gaussians(self.count, np.random.default_rng(1), self.lots.uniform(0.9, 1.1))
        self.scene.set_volume(1, name='fog', program=PROGRAM, world_from_object=np.eye(4),
                              gaussians=terms)

    def move_lights(self, count):
        for key in range(1, count + 1):
            place = np.eye(4)
            place[:3, 3] = self.place_lots.uniform(-0.8, 0.8, 3)
            self.scene.set_light(key, name='lamp', type='POINT', world_from_light=place,
                                 power=(20.0 / count,) * 3, cast_shadow=False)

    def render(self, size, depths='PROPAGATED'):
        settings = native.Settings(
            medium_resolution=size, lattice_resolution=size, depths=native.DEPTHS[depths],
            light_samples=1, shadow_resolution=64, world_samples=1)
        job = self.scene.render(settings, view())
        job.check(job.wait(-1))
        stats = job.stats()
        job.close()
        return stats

    def close(self):
        self.scene.close()


TRANSPORT = native.STAGES.index('transport')


def frames(box, size, repeats, before, depths='PROPAGATED'):
    """Milliseconds of a whole frame and of the propagation in it; before() changes what changes
    from frame to frame."""
    whole, propagation = [], []
    for number in range(repeats + 1):
        before()
        stats = box.render(size, depths)
        if number:  # the first compiles
            whole.append(stats.total_ms)
            propagation.append(stats.stages[TRANSPORT].wall_ms)
    return {'frame_ms': float(np.median(whole)), 'propagation_ms': min(propagation)}


def nothing():
    pass


def table_2(device, repeats):
    found = {}
    for size in SIZES:
        box = Box(device, 16)
        box.move_lights(1)
        row = found[size] = {'static': frames(box, size, repeats, nothing)}
        for lights in LIGHTS:
            row[str(lights)] = frames(box, size, repeats, partial(box.move_lights, lights))
        box.close()
    return found


def table_3(device, repeats):
    found = {}
    for count in COUNTS:
        box = Box(device, count)
        box.move_lights(2)
        found[count] = {'dynamic': frames(box, 20, repeats, box.change_medium),
                        'static': frames(box, 20, repeats, nothing)}
        box.close()
    return found


def ways(device, repeats):
    found = {}
    for way in WAYS:
        row = found[way] = {}
        for lights in LIGHTS:
            box = Box(device, 16)
            row[str(lights)] = frames(box, 40, repeats, partial(box.move_lights, lights), way)
            box.close()
    return found


def many(device):
    """64 lights at the default resolution."""
    box = Box(device, 125)
    box.move_lights(64)
    stats = box.render(64)
    box.close()
    return {'lights': stats.light_count, 'propagated': stats.lights_propagated, 'cells': 64,
            'transport_bytes': stats.transport_bytes, 'peak_bytes': stats.peak_bytes,
            'frame_ms': stats.total_ms}


def main():
    parser = argparse.ArgumentParser(prog='opv.py')
    parser.add_argument('--repeats', type=int, default=9)
    options = parser.parse_args()
    device = native.Device()
    line = {'bench': 'opv', **here(), 'device': device.describe().renderer.decode(),
            'resolution': [WIDTH, HEIGHT], 'repeats': options.repeats}
    line['table_2'] = table_2(device, options.repeats)
    line['table_3'] = table_3(device, options.repeats)
    line['ways'] = ways(device, max(options.repeats // 2, 2))
    line['many'] = many(device)
    keep(line)


if __name__ == '__main__':
    main()
