# SPDX-License-Identifier: GPL-3.0-or-later
"""Brume's panels, and Blender's own that apply to it."""

import bpy

from . import compat, native
from .properties import PASSES


class _RenderPanel:
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "render"
    COMPAT_ENGINES = {'BRUME'}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES


class _Rows:
    """Draws the settings listed in `rows`."""
    rows = ()

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        for name in self.rows:
            layout.prop(context.scene.brume, name)


class BRUME_PT_sampling(_RenderPanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw(self, context):
        layout, settings = self.layout, context.scene.brume
        layout.use_property_split = True
        layout.use_property_decorate = False
        try:
            native.library()
        except native.BrumeError as error:
            layout.label(text=error.sentence, icon='ERROR')
        layout.prop(settings, "preset")
        column = layout.column(align=True)
        column.prop(settings, "viewport_samples", text="Samples Viewport")
        column.prop(settings, "samples", text="Render")


class BRUME_PT_sampling_advanced(_Rows, _RenderPanel, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "BRUME_PT_sampling"
    bl_options = {'DEFAULT_CLOSED'}
    rows = ("seed",)


class BRUME_PT_volumes(_Rows, _RenderPanel, bpy.types.Panel):
    bl_label = "Volumes"
    # Iterations come here with the first method that has any.
    rows = ("method", "medium_resolution", "lattice_resolution", "step")


class BRUME_PT_world_volume(_RenderPanel, bpy.types.Panel):
    bl_label = "World Volume"
    bl_parent_id = "BRUME_PT_volumes"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout, settings = self.layout, context.scene.brume
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "world_unlimited")
        row = layout.row()
        row.active = not settings.world_unlimited
        row.prop(settings, "world_reach", text="Reach")


class BRUME_PT_lights(_Rows, _RenderPanel, bpy.types.Panel):
    bl_label = "Lights and Shadows"
    bl_options = {'DEFAULT_CLOSED'}
    rows = ("light_samples", "shadow_resolution", "world_samples")


class BRUME_PT_performance(_Rows, _RenderPanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_options = {'DEFAULT_CLOSED'}
    rows = ("memory_budget",)

    def draw(self, context):
        super().draw(context)
        self.layout.prop(context.scene.render, "preview_pixel_size", text="Viewport Pixel Size")
        self.layout.prop(context.scene.render, "use_persistent_data", text="Persistent Data")
        self.layout.prop(context.scene.brume, "show_statistics")


class BRUME_PT_film(_RenderPanel, bpy.types.Panel):
    bl_label = "Film"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(context.scene.render, "film_transparent")
        layout.prop(context.scene.render, "filter_size")


class BRUME_PT_passes(_RenderPanel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        for *_, switch in PASSES:
            owner, _, name = switch.rpartition(".")
            column.prop(getattr(context.view_layer, owner) if owner else context.view_layer, name)


_CLASSES = (BRUME_PT_sampling, BRUME_PT_sampling_advanced, BRUME_PT_volumes,
            BRUME_PT_world_volume, BRUME_PT_lights, BRUME_PT_film, BRUME_PT_performance,
            BRUME_PT_passes)

# EEVEE's panels that show what Brume reads too.
_ADDED = {
    'MATERIAL_PT_preview', 'EEVEE_MATERIAL_PT_context_material', 'EEVEE_MATERIAL_PT_surface',
    'EEVEE_MATERIAL_PT_volume', 'EEVEE_WORLD_PT_surface', 'EEVEE_WORLD_PT_volume',
    'DATA_PT_EEVEE_light', 'DATA_PT_EEVEE_shadow'}
_LEFT_OUT = {
    'VIEWLAYER_PT_filter', 'VIEWLAYER_PT_layer_passes', 'DATA_PT_light', 'DATA_PT_area',
    'DATA_PT_falloff_curve'}


def blender_panels():
    """Blender's panels that apply: those for engines in general, and some of EEVEE's."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is None or panel.__name__ in _LEFT_OUT:
            continue
        if panel.__name__ in _ADDED or 'BLENDER_RENDER' in engines:
            yield panel


_NODE_CATEGORIES = "BRUME_NODES"


def _register_node_categories():
    """The shader nodes that the Add menu of 3.x shows to Cycles and EEVEE alone."""
    import nodeitems_utils
    from nodeitems_builtins import ShaderNodeCategory
    from nodeitems_utils import NodeItem

    class BrumeNodeCategory(ShaderNodeCategory):
        @classmethod
        def poll(cls, context):
            return super().poll(context) and context.engine == 'BRUME'

    names = ("ShaderNodeOutputMaterial", "ShaderNodeOutputWorld", "ShaderNodeOutputLight",
             "ShaderNodeAddShader", "ShaderNodeMixShader", "ShaderNodeBsdfPrincipled",
             "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy", "ShaderNodeBsdfTransparent",
             "ShaderNodeEmission", "ShaderNodeBackground", "ShaderNodeVolumeScatter",
             "ShaderNodeVolumeAbsorption", "ShaderNodeVolumePrincipled", "ShaderNodeVolumeInfo")
    nodeitems_utils.register_node_categories(_NODE_CATEGORIES, [
        BrumeNodeCategory("BRUME_SHADERS", "Brume", items=[NodeItem(name) for name in names])])


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    for panel in blender_panels():
        panel.COMPAT_ENGINES.add('BRUME')
    if compat.needs_node_categories():
        _register_node_categories()


def unregister():
    if compat.needs_node_categories():
        import nodeitems_utils
        nodeitems_utils.unregister_node_categories(_NODE_CATEGORIES)
    for panel in blender_panels():
        panel.COMPAT_ENGINES.discard('BRUME')
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
