# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds fog_lights.blend: a room full of thick fog, which is particles, with five coloured lamps
that circle in it; and fog_lights_twin.blend, the same for Cycles."""
import colorsys
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import gaussians
import staging

NAME = 'fog_lights'
FRAMES = 48
G = 0.2


def emitter():
    """A box full of particles that stay where they are born, all in frame 1."""
    thing = staging.box('Fog', (3.8, 3.4, 2.8), (0.0, 0.2, 1.5))
    thing.show_instancer_for_render = thing.show_instancer_for_viewport = False
    settings = thing.modifiers.new('Fog', 'PARTICLE_SYSTEM').particle_system.settings
    settings.count, settings.lifetime = 160, 10000
    settings.frame_start = settings.frame_end = 1
    settings.emit_from, settings.distribution = 'VOLUME', 'RAND'
    settings.physics_type, settings.render_type = 'NO', 'NONE'
    settings.particle_size, settings.size_random = 0.7, 0.2
    return thing


def circling_lamp(number, count=5):
    """A lamp on a tilted ring, one round in FRAMES."""
    color = colorsys.hsv_to_rgb((number + 0.05) / count, 0.9, 1.0)
    thing = staging.lamp(f'Lamp {number + 1}', 'POINT', (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 160.0,
                         color, shadow_soft_size=0.06)
    for step in range(9):
        angle = math.tau * (number / count + step / 8) + 0.6
        thing.location = (1.25 * math.cos(angle), 0.1 + 1.0 * math.sin(angle),
                          1.6 + 0.7 * math.sin(angle + 0.8))
        thing.keyframe_insert('location', frame=1 + step * FRAMES / 8)


scene = staging.begin(NAME)
scene.render.resolution_x = scene.render.resolution_y = 512
stone = staging.matt('Stone', (0.16, 0.16, 0.17))

staging.alcove(4.4, 4.0, 3.4, stone, stone, stone)
staging.box('Column', (0.36, 0.36, 3.4), (0.0, 0.1, 1.7), stone, bevel=0.03, rotation=0.6)
staging.sphere('Ball', 0.4, (-1.1, -1.2, 0.4), stone)
for number in range(5):
    circling_lamp(number)
scene.frame_end = FRAMES
scene.frame_set(1)

staging.world((0.0, 0.0, 0.0), 0.0)
staging.camera((0.0, -8.2, 1.75), (0.0, 0.0, 1.68), lens=50.0)
fog = emitter()
balls = gaussians.particles(fog, 1.0, 1.0, (0.97, 0.97, 0.97), G)
staging.finish(NAME)
gaussians.finish_twin(NAME, fog, balls, 12, G)
