# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings: scene.brume, the passes at view_layer.brume, and their native form."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

from . import native

METHODS = [
    ('DOM', "Discrete Ordinates",
     "Light goes along many directions, from cell to cell, until it has found its way: right to a "
     "few percent, and the more so the more cells and directions there are", 2),
    ('LPV', "Light Propagation",
     "Light that volumes scatter and surfaces reflect goes on from cell to cell, as often as it "
     "takes: fills rooms and clouds with light, softly", 1),
    ('OPV', "Single Scattering",
     "Light that volumes scatter once: the quickest, and too dark in thick clouds and rooms", 0),
]

PRESETS = {
    'DRAFT': {"samples": 4, "medium_resolution": 64, "lattice_resolution": 32,
              "field_resolution": 16, "ordinates": '48', "step": 4.0,
              "half_resolution_volumes": True, "shadow_resolution": 256,
              "light_samples": 4, "world_samples": 32},
    'PREVIEW': {"samples": 12, "medium_resolution": 128, "lattice_resolution": 64,
                "field_resolution": 40, "ordinates": '96', "step": 3.0,
                "half_resolution_volumes": True, "shadow_resolution": 512, "light_samples": 8,
                "world_samples": 128},
    'FINAL': {"samples": 64, "medium_resolution": 192, "lattice_resolution": 96,
              "field_resolution": 64, "ordinates": '96', "step": 1.0,
              "half_resolution_volumes": False, "shadow_resolution": 1024,
              "light_samples": 16, "world_samples": 256},
}
_DEFAULT = PRESETS['PREVIEW']


def _apply_preset(settings, context):
    for name, value in PRESETS[settings.preset].items():
        setattr(settings, name, value)


def changed(settings, context):
    """Nothing; but Blender evaluates a scene or object anew after a script set one of its
    properties only if that has such a function."""


class BrumeSettings(bpy.types.PropertyGroup):
    method: EnumProperty(
        name="Method", update=changed,
        items=METHODS, default='DOM',
        description="How light travels through volumes")
    preset: EnumProperty(
        name="Preset", default='PREVIEW', update=_apply_preset,
        description="Sets samples, resolutions and step below at once. What is changed afterwards "
                    "stays changed until a preset is chosen again",
        items=[('DRAFT', "Draft", "Coarse and quick, for placing lights", 0),
               ('PREVIEW', "Preview", "For looking at a scene while working on it", 1),
               ('FINAL', "Final", "Fine, for pictures that are kept; takes many times longer "
                                  "than Preview", 2)])
    samples: IntProperty(
        name="Render Samples", update=changed,
        default=_DEFAULT["samples"], min=1, max=65536, soft_max=256,
        description="Samples a pixel of a final render. Time grows in proportion; noise at edges "
                    "and in volumes falls with the square root")
    viewport_samples: IntProperty(
        name="Viewport Samples", update=changed,
        default=16, min=1, max=65536, soft_max=256,
        description="Samples a pixel that the rendered viewport goes on to while nothing "
                    "changes. The first picture after a change always has one")
    viewport_frame_time: IntProperty(
        name="Frame Time (ms)", update=changed,
        default=100, min=10, max=10000, soft_max=1000,
        description="Milliseconds that a picture of the rendered viewport may take while something "
                    "moves. Less is smoother and rougher: pixels grow, steps through volumes get "
                    "longer, and lattices that must be made anew get coarser. At rest the picture "
                    "always becomes as fine as it should be")
    medium_resolution: IntProperty(
        name="Volume Resolution", update=changed,
        default=_DEFAULT["medium_resolution"], min=8, max=1024,
        soft_max=256,
        description="Cells along the longest side of the lattice that holds all volumes, which "
                    "is never finer than their own voxels. More show finer smoke; memory and the "
                    "time to fill it grow with the third power")
    lattice_resolution: IntProperty(
        name="Light Resolution", update=changed,
        default=_DEFAULT["lattice_resolution"], min=4, max=512,
        soft_max=512,
        description="Cells along the longest side of the lattice in which light travels. More "
                    "give sharper shadows of smoke on smoke; memory and time grow with the third "
                    "power, and with the number of lights")
    field_resolution: IntProperty(
        name="Scattering Resolution", update=changed,
        default=_DEFAULT["field_resolution"], min=2, max=256, soft_max=128,
        description="Cells along the longest side of the lattice in which scattered and reflected "
                    "light goes on. It is soft: fewer do than for the lights' own. More tell "
                    "smaller rooms and thicker smoke apart; memory grows with the third power, "
                    "time with the fourth where iterations go on until they converged")
    ordinates: EnumProperty(
        name="Directions", update=changed, default=_DEFAULT["ordinates"],
        description="Directions that scattered and reflected light goes along. Time and memory "
                    "grow in proportion",
        items=[('26', "26", "Quick, for a first look: bright spots show as beams", 26),
               ('48', "48", "For clouds and smoke, where scattering hides what few directions "
                            "leave; in rooms small bright spots show as soft beams", 48),
               ('96', "96", "For rooms and thin fog, which come out up to a fifth closer", 96)])
    cascades: IntProperty(
        name="Cascades", update=changed, default=0, min=0, max=3,
        description="Lattices of scattered and reflected light, each within the last and half as "
                    "long, with as many cells: finer where it counts, without a finer whole. Two "
                    "take three times as long as one, three seven times. 0: one, and with DOM "
                    "another around volumes that are small in it, twice to four times as fine")
    cascade_focus: EnumProperty(
        name="Finer Around", update=changed, default='MEDIUM',
        description="What the cascades after the first surround",
        items=[('MEDIUM', "Volumes", "The middle of the volumes. Without any, what is near the "
                                     "camera", 0),
               ('CAMERA', "Camera", "What is near the camera, before it. Light is found anew there "
                                    "when it has moved far", 1)])
    depths: EnumProperty(
        name="Optical Depths", update=changed, default='PROPAGATED',
        description="How it is found what the volumes let through between each lamp and each cell",
        items=[('PROPAGATED', "Propagated", "Carried outwards from the lamp: quick, and about 1 % "
                                            "off", 0),
               ('MARCHED', "Exact", "From each cell straight to the lamp: takes several times as "
                                    "long, the more so the finer the cells", 1),
               ('CORRECTED', "Six Neighbors", "For comparison: gathered from the six cells around, "
                                              "with steps as long as they are. Blurs shadows in "
                                              "volumes; 3 to 20 % off", 2),
               ('PAPER', "As Published", "For comparison: as in the paper on opacity propagation "
                                         "volumes. Too dark by half where light runs askew to the "
                                         "cells", 3)])
    blockers: EnumProperty(
        name="Blockers", update=changed, default='LINKS',
        description="How surfaces stand in the way of light that goes from cell to cell",
        items=[('LINKS', "Exact", "Ways from cell to cell that a surface cuts: none passes a wall, "
                                  "however thin", 0),
               ('FUZZY', "Fuzzy", "For comparison: as in the paper on light propagation volumes. "
                                  "From what lights and six views from outside see. Some light "
                                  "passes any wall, and it takes longer", 1)])
    light_paths: EnumProperty(
        name="Light Paths", update=changed, default='ALL',
        description="Which of the light is shown. All but the first are for comparison, and Light "
                    "Propagation's alone",
        items=[('ALL', "Everything", "What volumes scatter and surfaces reflect, as often as it "
                                     "takes", 0),
               ('DIRECT', "Direct", "Surfaces in the light of lamps and world, as far as volumes "
                                    "let it through", 1),
               ('REFLECTED', "Reflected", "Direct light, and what surfaces reflect to one another",
                2),
               ('SINGLE', "Single Scattering", "Direct light, and what volumes scatter once of the "
                                               "light of lamps and world", 3),
               ('REFLECTED_MARCHED', "Reflected and Marched",
                "Reflected light, and what volumes scatter of it to the camera", 4),
               ('SUM', "Sum", "Single scattering together with reflected and marched light: what "
                              "volumes scatter lights neither surfaces nor volumes", 5)])
    iterations: IntProperty(
        name="Iterations", update=changed,
        default=0, min=0, max=1024,
        description="How many cells far scattered and reflected light goes. 0 goes on until what "
                    "is still to come no longer counts, which takes longest in closed bright "
                    "rooms")
    shadow_resolution: IntProperty(
        name="Shadow Resolution", update=changed,
        default=_DEFAULT["shadow_resolution"], min=16, max=8192,
        soft_max=4096, subtype='PIXEL',
        description="Side of a shadow map. More give sharper shadows of meshes; memory and the "
                    "time to draw them grow with the square, and with lights and light samples")
    light_samples: IntProperty(
        name="Light Samples", update=changed,
        default=_DEFAULT["light_samples"], min=1, max=256, soft_max=32,
        description="Shadow maps spread over each light. More give smoother soft shadows; time "
                    "and memory grow in proportion")
    world_samples: IntProperty(
        name="World Samples", update=changed,
        default=_DEFAULT["world_samples"], min=1, max=1024, soft_max=512,
        description="Directions that stand for the world's light, each with a small shadow map. "
                    "More soften its shadows and catch smaller bright spots of an environment "
                    "texture; time and memory grow in proportion")
    step: FloatProperty(
        name="Step", update=changed,
        default=_DEFAULT["step"], min=0.05, max=16.0, soft_max=4.0, precision=2,
        description="Length of a step through volumes, in cells of their lattice. Each sample "
                    "begins its steps elsewhere, so that long ones still add up to the whole: "
                    "they cost grain, not detail. Time grows in inverse proportion")
    half_resolution_volumes: BoolProperty(
        name="Half Resolution", update=changed,
        default=_DEFAULT["half_resolution_volumes"],
        description="Follows light through volumes along one ray for 2 x 2 pixels, and fits it to "
                    "the edges of surfaces: three to four times as quick where volumes fill the "
                    "picture. The volumes' own fine detail becomes softer, by about a pixel")
    memory_budget: IntProperty(
        name="Memory Budget (MiB)", update=changed,
        default=2048, min=64, max=1048576, soft_max=32768,
        description="Mebibytes that may be used on the GPU. Lattices that would not fit are made "
                    "coarser, with a warning")
    world_unlimited: BoolProperty(
        name="Unlimited", update=changed,
        default=False,
        description="Lets the world's volume go on for ever, as in Cycles. Suns and the sky "
                    "are then swallowed on their way: only lamps that stand in the scene light it")
    world_reach: FloatProperty(
        name="World Volume Reach", update=changed,
        default=0.0, min=0.0, soft_max=1000.0, subtype='DISTANCE',
        description="How far around the scene's objects the world's volume goes; beyond, light "
                    "travels freely, so that sun and sky reach it. Its cells grow with it. "
                    "0: half of the scene's diagonal")
    seed: IntProperty(
        name="Seed", update=changed,
        default=0, min=0,
        description="Another number gives other noise of the same amount; one number gives the "
                    "same picture every time")
    show_statistics: BoolProperty(
        name="Viewport Statistics", update=changed,
        default=False,
        description="Shows samples and the time of each stage in the rendered viewport's corner. "
                    "Final renders always tell their times, in the status bar and the info log")


class BrumeViewLayerSettings(bpy.types.PropertyGroup):
    use_pass_volume_direct: BoolProperty(
        name="Volume Direct", default=False,
        description="Light that volumes scattered straight from lights and world to the camera")
    use_pass_volume_indirect: BoolProperty(
        name="Volume Indirect", default=False,
        description="Light that volumes scattered to the camera after it was scattered or "
                    "reflected before")
    use_pass_transmittance: BoolProperty(
        name="Transmittance", default=False,
        description="Share of the light that the volumes in front of the first surface let "
                    "through, by colour")


# Pass of brume.h, Blender's name and channels, type for register_pass, and where its switch is.
# Blender's own switches are used where there are any: they are the same for all engines.
PASSES = [
    ("DEPTH", "Depth", "Z", 'VALUE', "use_pass_z"),
    ("NORMAL", "Normal", "XYZ", 'VECTOR', "use_pass_normal"),
    ("EMISSION", "Emit", "RGB", 'COLOR', "use_pass_emit"),
    ("ENVIRONMENT", "Env", "RGB", 'COLOR', "use_pass_environment"),
    ("VOLUME_DIRECT", "VolumeDir", "RGB", 'COLOR', "brume.use_pass_volume_direct"),
    ("VOLUME_INDIRECT", "VolumeInd", "RGB", 'COLOR', "brume.use_pass_volume_indirect"),
    ("TRANSMITTANCE", "Transmittance", "RGB", 'COLOR', "brume.use_pass_transmittance"),
]


def passes_of(view_layer):
    """(number in the library, name, channel ids, type) of each pass in use, Combined first."""
    used = [(0, "Combined", "RGBA", 'COLOR')]
    used += [(native.PASSES.index(identifier), name, channels, kind)
             for identifier, name, channels, kind, switch in PASSES
             if view_layer.path_resolve(switch)]
    return used


def world_reach(settings):
    """reach of brume_world."""
    return -1.0 if settings.world_unlimited else settings.world_reach


def native_settings(settings):
    """brume_settings of scene.brume."""
    return native.Settings(
        method=native.METHODS[settings.method],
        medium_resolution=settings.medium_resolution,
        lattice_resolution=settings.lattice_resolution,
        field_resolution=settings.field_resolution,
        ordinates=int(settings.ordinates),
        cascades=settings.cascades, cascade_focus=native.FOCUS[settings.cascade_focus],
        iterations=settings.iterations,
        shadow_resolution=settings.shadow_resolution, light_samples=settings.light_samples,
        world_samples=settings.world_samples, step=settings.step,
        depths=native.DEPTHS[settings.depths],
        blockers=native.BLOCKERS[settings.blockers],
        light_paths=native.LIGHT_PATHS[settings.light_paths],
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
