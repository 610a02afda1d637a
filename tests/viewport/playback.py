# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenarios: animations and volume sequences that play."""

import tempfile
from pathlib import Path

import bpy
from drive import alone, at, regions, rendered_views, scenario, settled
from eyes import as_rendered, different, shown
from latency import of_kind, traced
from views import from_the_front

FRAMES = 12


def written_sequence(folder):
    """A sequence of volumes that grow, by Blender itself."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    ball = bpy.context.object
    ball.hide_render = True
    data = bpy.data.volumes.new("Maker")
    maker = bpy.data.objects.new("Maker", data)
    bpy.context.scene.collection.objects.link(maker)
    modifier = maker.modifiers.new("Fill", 'MESH_TO_VOLUME')
    modifier.object, modifier.voxel_amount, modifier.density = ball, 24, 1.0
    for frame in range(1, FRAMES + 1):
        ball.scale = [0.4 + 0.6 * frame / FRAMES] * 3
        evaluated = maker.evaluated_get(bpy.context.evaluated_depsgraph_get())
        assert evaluated.data.grids.save(filepath=str(folder / f"ball_{frame:04}.vdb"))
    bpy.data.objects.remove(maker)
    bpy.data.objects.remove(ball)
    bpy.data.volumes.remove(data)


def replace_fog(data, density):
    """Makes smoke of that, and hides the cube of fog."""
    smoke = bpy.data.materials.new("Smoke")
    smoke.use_nodes = True
    tree = smoke.node_tree
    tree.nodes.clear()
    volume = tree.nodes.new("ShaderNodeVolumePrincipled")
    volume.inputs["Density"].default_value = density
    tree.links.new(volume.outputs["Volume"],
                   tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    data.materials.append(smoke)
    fog = bpy.data.objects["Fog"]
    fog.hide_viewport = fog.hide_render = True


def sequence_in_the_cube(folder):
    """In place of the cube of fog."""
    written_sequence(folder)
    volume = bpy.data.volumes.new("Ball")
    volume.filepath = str(folder / "ball_0001.vdb")
    volume.is_sequence, volume.frame_duration, volume.frame_start = True, FRAMES, 1
    volume.sequence_mode = 'REPEAT'
    replace_fog(volume, 1.0)
    ob = bpy.data.objects.new("Ball", volume)
    ob.location.z = 1.0
    bpy.context.scene.collection.objects.link(ob)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, FRAMES
    bpy.context.scene.frame_set(1)


def toggle_playback(area):
    """Starts or stops it."""
    with at(area):
        bpy.ops.screen.animation_play()


def played(area, seconds, frames_wanted, scenes_wanted):
    """Plays so long, and on until there were so many frames and pictures of so many scenes, and
    waits for the view's rest; gives the frames that Blender came to, and the scenes of the pictures
    that the view showed, while it played and after that. How fast a machine plays is not asked
    here; one that never gets there runs out of the scenario's time."""
    frames = []

    def note(scene, *_):
        frames.append(scene.frame_current)

    bpy.app.handlers.frame_change_post.append(note)
    with traced() as events:
        toggle_playback(area)
        yield seconds
        yield lambda: (len(frames) >= frames_wanted and
                       len({values.get("scene") for *_, values in of_kind(events, "draw")}
                           - {None}) >= scenes_wanted)
        toggle_playback(area)
        bpy.app.handlers.frame_change_post.remove(note)
        drawn = len(of_kind(events, "draw"))
        yield from settled()
        scenes = [values.get("scene") for *_, values in of_kind(events, "draw")]
    return frames, [[scene for scene in part if scene is not None]
                    for part in (scenes[:drawn], scenes[drawn:])]


@scenario()
def volume_sequence():
    """Frames are dropped rather than queued, and pictures go on changing while it plays."""
    area = yield from alone()
    region, = regions(area)
    from_the_front(area)
    with tempfile.TemporaryDirectory() as folder:
        sequence_in_the_cube(Path(folder))
        yield from rendered_views()
        first = shown(region)
        frames, (scenes, after) = yield from played(area, 5.0, FRAMES + 1, 5)
        assert len(frames) > FRAMES, f"it did not play: {frames}"
        assert len(set(scenes)) > 4, f"pictures of {len(set(scenes))} frames alone"
        assert scenes == sorted(scenes), "an older picture came after a newer one"
        # Then come the picture and the file that were under way, and the last frame.
        assert len({*after} - {*scenes}) <= 3, f"{after} after {scenes[-1]}"
        assert scenes[-1] - scenes[0] <= len(frames) + 2, "a frame was exported more than once"
        bpy.context.scene.frame_set(FRAMES)
        yield from settled()
        different(shown(region), first, "the last frame")
        found = as_rendered(region, "the last frame")
        bpy.data.objects.remove(bpy.data.objects["Ball"])  # lets the files go
        yield from settled()
    return {"apart": found, "frames": len(frames), "shown": len(set(scenes))}


def smoking(folder):
    """A gas domain of few cells with a ball that smokes in it, simulated while it plays."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.4, location=(0.0, 0.0, 0.6))
    ball = bpy.context.object
    ball.modifiers.new("Fluid", 'FLUID').fluid_type = 'FLOW'
    flow = ball.modifiers["Fluid"].flow_settings
    flow.flow_type, flow.flow_behavior, flow.density = 'SMOKE', 'INFLOW', 4.0
    ball.hide_render = True
    bpy.ops.mesh.primitive_cube_add(size=2.0, location=(0.0, 0.0, 1.0))
    domain = bpy.context.object
    domain.name = "Domain"
    domain.modifiers.new("Fluid", 'FLUID').fluid_type = 'DOMAIN'
    settings = domain.modifiers["Fluid"].domain_settings
    settings.domain_type, settings.resolution_max = 'GAS', 16
    settings.cache_type, settings.cache_directory = 'REPLAY', str(folder)
    settings.cache_frame_start, settings.cache_frame_end = 1, 250
    replace_fog(domain.data, 8.0)
    # Longer than it plays: at its beginning there is no smoke.
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 250
    bpy.context.scene.frame_set(1)


@scenario(fluid=True)
def simulation():
    """Smoke that is simulated while it plays is seen to rise."""
    area = yield from alone()
    region, = regions(area)
    from_the_front(area)
    with tempfile.TemporaryDirectory() as folder:
        smoking(Path(folder))
        yield from rendered_views()
        first = shown(region)
        frames, (scenes, _) = yield from played(area, 6.0, 9, 5)
        assert len(set(frames)) > 8, f"it did not play: {frames}"
        assert len(set(scenes)) > 4, f"pictures of {len(set(scenes))} frames alone"
        different(shown(region), first, "after a while")
        found = as_rendered(region, "the simulation where it stopped")
        bpy.data.objects.remove(bpy.data.objects["Domain"])
        yield from settled()
    return {"apart": found, "frames": len(frames), "shown": len(set(scenes))}
