# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings: scene.brume, the passes at view_layer.brume, and their native form."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

from . import native

METHODS = [
    ('OPV', "Single Scattering",
     "Light that the medium scatters once: fast, and too dark in thick clouds", 0),
]

PRESETS = {
    'DRAFT': {"samples": 4, "medium_resolution": 64, "lattice_resolution": 32,
              "shadow_resolution": 256, "light_samples": 4, "world_samples": 16},
    'PREVIEW': {"samples": 16, "medium_resolution": 128, "lattice_resolution": 64,
                "shadow_resolution": 512, "light_samples": 8, "world_samples": 32},
    'FINAL': {"samples": 64, "medium_resolution": 192, "lattice_resolution": 96,
              "shadow_resolution": 1024, "light_samples": 16, "world_samples": 64},
}
_DEFAULT = PRESETS['PREVIEW']


def _apply_preset(settings, context):
    for name, value in PRESETS[settings.preset].items():
        setattr(settings, name, value)


class BrumeSettings(bpy.types.PropertyGroup):
    method: EnumProperty(
        name="Method", items=METHODS, default='OPV',
        description="How light travels through media")
    preset: EnumProperty(
        name="Preset", default='PREVIEW', update=_apply_preset,
        description="Sets the values below at once",
        items=[('DRAFT', "Draft", "Coarse and quick, for placing lights", 0),
               ('PREVIEW', "Preview", "For looking at a scene while working on it", 1),
               ('FINAL', "Final", "Fine, for pictures that are kept", 2)])
    samples: IntProperty(
        name="Samples", default=_DEFAULT["samples"], min=1, max=65536, soft_max=256,
        description="Samples a pixel of a final render. Time grows in proportion; noise at edges "
                    "and in the fog falls with the square root")
    medium_resolution: IntProperty(
        name="Medium", default=_DEFAULT["medium_resolution"], min=8, max=1024, soft_max=256,
        description="Cells along the longest side of the lattice that holds the media. More show "
                    "finer smoke; memory and time grow with the third power")
    lattice_resolution: IntProperty(
        name="Lattice", default=_DEFAULT["lattice_resolution"], min=4, max=512, soft_max=128,
        description="Cells along the longest side of the lattice in which light travels. More "
                    "give sharper shadows in the medium; memory and time grow with the third "
                    "power, and with the number of lights")
    iterations: IntProperty(
        name="Iterations", default=0, min=0, max=1024,
        description="Steps of the methods that spread light cell by cell; 0 goes on until it "
                    "converged. Single scattering has none")
    shadow_resolution: IntProperty(
        name="Shadow Map", default=_DEFAULT["shadow_resolution"], min=16, max=8192, soft_max=4096,
        description="Texels along the side of a lamp's shadow map. More give sharper shadows of "
                    "meshes; memory grows with the square, and with lights and light samples")
    light_samples: IntProperty(
        name="Light Samples", default=_DEFAULT["light_samples"], min=1, max=256, soft_max=32,
        description="Shadow maps spread over each lamp. More give smoother soft shadows; time and "
                    "memory grow in proportion")
    world_samples: IntProperty(
        name="World Samples", default=_DEFAULT["world_samples"], min=1, max=4096, soft_max=128,
        description="Directions that stand for the world's light. More catch smaller bright "
                    "spots of an environment texture; time grows in proportion")
    step: FloatProperty(
        name="Step", default=1.0, min=0.05, max=16.0, soft_max=4.0,
        description="Length of a step through the medium, in its cells. Smaller steps miss less; "
                    "time grows in inverse proportion")
    memory_budget: IntProperty(
        name="Memory Budget", default=2048, min=64, max=1048576, soft_max=32768, subtype='NONE',
        description="Megabytes that may be used on the GPU. Lattices that would not fit are made "
                    "coarser, with a warning")
    world_reach: FloatProperty(
        name="World Reach", default=0.0, min=0.0, soft_max=1000.0, unit='LENGTH',
        description="How far around the scene's objects the world's medium goes. Beyond it light "
                    "travels freely, so that sun and sky reach the fog. 0 takes half of the "
                    "scene's diagonal")
    seed: IntProperty(
        name="Seed", default=0, min=0,
        description="Another number gives other noise of the same amount; one number gives the "
                    "same picture every time")
    show_statistics: BoolProperty(
        name="Show Statistics", default=False,
        description="Shows the time of each stage in the viewport's corner and prints it after "
                    "a final render")


class BrumeViewLayerSettings(bpy.types.PropertyGroup):
    use_pass_volume_direct: BoolProperty(
        name="Volume Direct", default=False,
        description="Light that media scattered straight from lamps and world to the camera")
    use_pass_transmittance: BoolProperty(
        name="Transmittance", default=False,
        description="What the media in front of the first surface let through")


# Pass of brume.h, Blender's name and channels, type for register_pass, and where its switch is.
# Blender's own switches are used where there are any: they are the same for all engines.
PASSES = [
    ("DEPTH", "Depth", "Z", 'VALUE', "use_pass_z"),
    ("NORMAL", "Normal", "XYZ", 'VECTOR', "use_pass_normal"),
    ("EMISSION", "Emit", "RGB", 'COLOR', "use_pass_emit"),
    ("ENVIRONMENT", "Env", "RGB", 'COLOR', "use_pass_environment"),
    ("VOLUME_DIRECT", "VolumeDir", "RGB", 'COLOR', "brume.use_pass_volume_direct"),
    ("TRANSMITTANCE", "Transmittance", "RGB", 'COLOR', "brume.use_pass_transmittance"),
]


def passes_of(view_layer):
    """(number in the library, name, channel ids, type) of each pass in use, Combined first."""
    used = [(0, "Combined", "RGBA", 'COLOR')]
    used += [(native.PASSES.index(identifier), name, channels, kind)
             for identifier, name, channels, kind, switch in PASSES
             if view_layer.path_resolve(switch)]
    return used


def native_settings(settings):
    """brume_settings of scene.brume."""
    return native.Settings(
        method=native.METHODS[settings.method],
        medium_resolution=settings.medium_resolution,
        lattice_resolution=settings.lattice_resolution, iterations=settings.iterations,
        shadow_resolution=settings.shadow_resolution, light_samples=settings.light_samples,
        world_samples=settings.world_samples, step=settings.step,
        memory_budget=settings.memory_budget << 20)


_CLASSES = (BrumeSettings, BrumeViewLayerSettings)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.brume = PointerProperty(type=BrumeSettings)
    bpy.types.ViewLayer.brume = PointerProperty(type=BrumeViewLayerSettings)


def unregister():
    del bpy.types.ViewLayer.brume
    del bpy.types.Scene.brume
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
