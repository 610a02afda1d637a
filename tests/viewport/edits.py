# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenarios: many random edits in a row end with the picture that a final render of the result
has, and with the memory they began with."""

import ctypes
import gc
import random

import blenders
import bpy
import mathutils
from drive import (
    SIZE,
    at,
    drag_pixels,
    regions,
    scenario,
    settled,
    shade,
    undo_step,
    view_area,
    windows,
)
from eyes import as_rendered
from views import alone_rendered

SEED = 7
ADDED = "Added"        # begins the names of what edits add
MOST_ADDED = 12
UNDO_STEPS = 8         # a history that grows is not a leak
WARM_UP = 100          # edits, after which memory grows no more
MEMORY_GROWTH = 0.05
kinds = []             # the edits; each gets a random.Random, and may wait


def edit(function):
    kinds.append(function)
    return function


def things(kind=None, added=False):
    return sorted((ob for ob in bpy.context.scene.objects
                   if ob.type in (kind or {'MESH', 'LIGHT'})
                   and (not added or ob.get("added"))), key=lambda ob: ob.name)


def place(rng, around=1.5):
    return mathutils.Vector([rng.uniform(-around, around), rng.uniform(-around, around),
                             rng.uniform(0.3, 1.5)])


@edit
def add_thing(rng):
    added = things(added=True)
    if len(added) >= MOST_ADDED:
        bpy.data.objects.remove(rng.choice(added))
    data = rng.choice([bpy.data.objects["Post"].data, bpy.data.objects["Fog"].data])
    if rng.random() < 0.5:
        data = data.copy()
    ob = bpy.data.objects.new(ADDED, data)
    ob["added"] = True
    ob.location, ob.scale = place(rng), [rng.uniform(0.3, 0.7)] * 3
    bpy.context.scene.collection.objects.link(ob)


@edit
def add_lamp(rng):
    added = things(added=True)
    if len(added) >= MOST_ADDED:
        bpy.data.objects.remove(rng.choice(added))
    light = bpy.data.lights.new(ADDED, rng.choice(['POINT', 'SPOT', 'AREA']))
    light.energy = rng.uniform(5.0, 50.0)
    ob = bpy.data.objects.new(ADDED, light)
    ob["added"] = True
    ob.location = place(rng) + mathutils.Vector((0, 0, 2))
    bpy.context.scene.collection.objects.link(ob)


@edit
def delete(rng):
    added = things(added=True)
    if added:
        bpy.data.objects.remove(rng.choice(added))


@edit
def move(rng):
    ob = rng.choice(things())
    ob.location += mathutils.Vector([rng.uniform(-0.2, 0.2) for _ in range(3)])
    ob.rotation_euler.z += rng.uniform(-0.3, 0.3)


@edit
def mesh(rng):
    data = rng.choice(things({'MESH'})).data
    data.vertices[rng.randrange(len(data.vertices))].co *= rng.uniform(0.9, 1.1)
    data.update()


@edit
def material(rng):
    fog = bpy.data.materials["Fog"].node_tree.nodes
    shader = next(node for node in fog if node.type == 'VOLUME_SCATTER')
    shader.inputs["Density"].default_value = rng.uniform(0.3, 1.5)


@edit
def light(rng):
    lamp = rng.choice(things({'LIGHT'})).data
    lamp.energy *= rng.uniform(0.8, 1.25)
    lamp.color = [rng.uniform(0.5, 1.0) for _ in range(3)]


@edit
def world(rng):
    nodes = bpy.context.scene.world.node_tree.nodes
    background = next(node for node in nodes if node.type == 'BACKGROUND')
    background.inputs["Strength"].default_value = rng.uniform(0.5, 1.5)


@edit
def hide(rng):
    ob = rng.choice(things({'MESH'}))
    ob.hide_viewport = ob.hide_render = not ob.hide_render


@edit
def rename(rng):
    added = things(added=True)
    if added:
        ob = rng.choice(added)
        ob.name = f"{ADDED} {rng.randrange(100)}"
        ob.data.name = f"{ADDED} {rng.randrange(100)}"


@edit
def frame(rng):
    bpy.context.scene.frame_set(rng.randrange(1, 20))


@edit
def settings(rng):
    bpy.context.scene.brume.lattice_resolution = rng.choice([24, 32])
    bpy.context.scene.brume.viewport_frame_time = rng.choice([50, 100, 200])


@edit
def undo(rng):
    for _ in range(rng.randint(1, 3)):
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()


@edit
def redo(rng):
    if bpy.ops.ed.redo.poll():
        bpy.ops.ed.redo()


@edit
def orbit(rng):
    view = view_area().spaces.active.region_3d
    view.view_rotation = (mathutils.Quaternion((0, 0, 1), rng.uniform(-0.3, 0.3))
                          @ view.view_rotation)


@edit
def engine(rng):
    bpy.context.scene.render.engine = rng.choice(['BLENDER_WORKBENCH', 'CYCLES'])
    yield rng.uniform(0.05, 0.3)
    bpy.context.scene.render.engine = 'BRUME'


@edit
def shading(rng):
    shade(rng.choice(['SOLID', 'WIREFRAME']))
    yield rng.uniform(0.05, 0.3)
    shade('RENDERED')


@edit
def resize(rng):
    area = view_area()
    edge = windows()[0].height - area.y
    x = area.x + area.width // 2
    wanted = windows()[0].height - (area.y + area.height - rng.randrange(260, SIZE[1]))
    yield from drag_pixels((x, edge), (x, wanted), moves=4)


@edit
def local_view(rng):
    with at(view_area()):
        for ob in bpy.context.view_layer.objects:
            ob.select_set(ob.type != 'CAMERA' and rng.random() < 0.7)
        bpy.data.objects["Floor"].select_set(True)
        bpy.ops.view3d.localview(frame_selected=False)
    yield rng.uniform(0.05, 0.3)
    with at(view_area()):
        bpy.ops.view3d.localview(frame_selected=False)


UNDONE = {"undo", "redo", "orbit", "resize", "shading", "local_view"}  # leave no step themselves


def done(one, rng):
    waits = one(rng)
    if waits is not None:
        yield from waits
    if one.__name__ not in UNDONE:
        undo_step(one.__name__)
    # Sometimes the next comes at once, sometimes while the picture is refined.
    yield rng.choice([0.0, 0.02, 0.1, 0.4])


def give_back_freed_memory():
    """What an allocator keeps for later is no leak, and differs by some percent each time."""
    process = ctypes.CDLL(None)
    if hasattr(process, "mallctl"):  # jemalloc, which Debian's Blender is linked with
        every_arena = 4096
        failed = process.mallctl(f"arena.{every_arena}.purge".encode(), None, None, None,
                                 ctypes.c_size_t(0))
        assert not failed, f"mallctl: {failed}"
    else:
        process.malloc_trim(0)


def resident():
    """Bytes of this process, once what can go is gone: what edits added, what they left, and what
    the allocator keeps of freed memory."""
    for ob in things(added=True):
        bpy.data.objects.remove(ob)
    for ob in things():
        ob.hide_viewport = ob.hide_render = False
    bpy.data.orphans_purge(do_recursive=True)
    for _ in range(UNDO_STEPS + 1):  # the history as long as it gets, of this state
        undo_step("resident")
    yield from settled()
    gc.collect()
    give_back_freed_memory()
    with open("/proc/self/status", encoding="ascii") as file:
        line = next(line for line in file if line.startswith("VmRSS"))
    return int(line.split()[1]) * 1024


def edited(count):
    """Memory is that of the process before and after the edits, each time with what they added
    gone and a settled view. Before the first, each kind of edit was done, some at random, and a
    final render, so that all is loaded that they need. In between windows are not resized where
    Blender itself loses memory by that."""
    rng = random.Random(SEED)
    bpy.context.preferences.edit.undo_steps = UNDO_STEPS
    area, region = yield from alone_rendered()
    undo_step("begin")
    for one in kinds + rng.choices(kinds, k=WARM_UP):
        yield from done(one, rng)
    yield from settled()
    as_rendered(regions(view_area())[0], "after one edit of each kind")
    before = yield from resident()
    measured = [one for one in kinds
                if one is not resize or not blenders.leaks_when_resized(bpy.app.version)]
    for one in rng.choices(measured, k=count):
        yield from done(one, rng)
    yield from settled()
    region, = regions(view_area())
    found = as_rendered(region, f"after {count} edits")
    after = yield from resident()
    growth = after / before - 1.0
    assert growth < MEMORY_GROWTH, f"{before >> 20} MiB grew to {after >> 20} MiB"
    return {"apart": found, "before_mib": before >> 20, "after_mib": after >> 20}


@scenario()
def hundred_edits():
    return (yield from edited(100))


@scenario(slow=True)
def three_hundred_edits():
    return (yield from edited(300))
