# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenarios: methods of light transport other than the one that views begin with."""

import bpy
from drive import scenario, settled, views
from eyes import alike, as_rendered, different, part, shown
from latency import of_kind, traced
from views import alone_rendered

BEHIND = 0.6, 0.2, 0.95, 0.8  # the part of its picture that is behind the screen
STEP = 0.05             # of the lamp, in m
PICTURES = 6            # to be seen while it moves
# Without the light that walls and fog pass on, there is only what glows before the screen: here an
# eighth of the picture with it. Lattices as coarse as they get while the lamp moves keep that.
BRIGHTER = 4.0


def lamp_behind_a_screen():
    """Makes the room dark but for a lamp, behind a screen from floor to ceiling. Gives the lamp."""
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    scene.world = None
    data = bpy.data.lights.new("Lamp", 'POINT')
    data.energy, data.shadow_soft_size = 300.0, 0.0
    lamp = bpy.data.objects.new("Lamp", data)
    lamp.location = -2.2, 2.2, 1.8
    scene.collection.objects.link(lamp)
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(-0.75, 2.25, 1.6))
    screen = bpy.context.object
    screen.scale = 0.1, 3.5, 3.2
    screen.data.materials.append(bpy.data.objects["Plinth"].active_material)
    return lamp


def moved(lamp, pictures):
    """Moves a lamp at every tick, and does not wait for the view, until so many pictures were
    drawn of scenes that had it elsewhere. Gives how often it was moved."""
    moves = 0

    def enough():
        nonlocal moves
        lamp.location.y += STEP if moves % 20 < 10 else -STEP  # there and back
        moves += 1
        return len({values["scene"] for *_, values in of_kind(events, "draw")
                    if values.get("scene", before) > before}) >= pictures

    with traced() as events:
        before = views()[0].picture.scene
        yield enough
    return moves


@scenario("room")
def light_propagation():
    """What a screen hides from the lamp is lit by walls and fog: at rest as in a final render,
    and while the lamp moves. Another method and back leaves the same picture."""
    scene = bpy.context.scene
    lamp = lamp_behind_a_screen()
    scene.brume.method = 'LPV'
    scene.brume.step = 16.0  # a room full of fog takes its time; the grain is the render's too
    area, region = yield from alone_rendered()
    first = shown(region)
    found = {"first": as_rendered(region, "light propagation")}

    scene.brume.method = 'OPV'
    yield from settled()
    single = part(shown(region), BEHIND).mean()
    found["brighter"] = part(first, BEHIND).mean() / single
    assert found["brighter"] > BRIGHTER, found
    scene.brume.method = 'LPV'
    yield from settled()
    alike(shown(region), first, "light propagation again", 1e-6)

    found["moves"] = yield from moved(lamp, PICTURES)
    found["moving"] = part(shown(region), BEHIND).mean() / single
    assert found["moving"] > BRIGHTER, found
    lamp.location.y = 1.0  # wherever it got to
    yield from settled()
    different(shown(region), first, "after the lamp's moves")
    found["last"] = as_rendered(region, "after the lamp's moves")
    return found
