# SPDX-License-Identifier: GPL-3.0-or-later
"""Brume's panels, and Blender's own that apply to it."""

import bpy

from . import compat, native
from .properties import PASSES


class EnginePanel:
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    COMPAT_ENGINES = {'BRUME'}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES and cls.applies(context)

    @classmethod
    def applies(cls, context):
        return True

    def split(self):
        """The layout, with names at the left of the values."""
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout


class _RenderPanel(EnginePanel):
    bl_context = "render"


class _Rows:
    """Draws the settings listed in `rows`."""
    rows = ()

    def draw(self, context):
        layout = self.split()
        for name in self.rows:
            layout.prop(context.scene.brume, name)


class BRUME_PT_sampling(_RenderPanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw(self, context):
        layout, settings = self.split(), context.scene.brume
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
    rows = ("method", "medium_resolution", "lattice_resolution", "step", "half_resolution_volumes")


class BRUME_PT_single_scattering(_Rows, _RenderPanel, bpy.types.Panel):
    bl_label = "Single Scattering"
    bl_parent_id = "BRUME_PT_volumes"
    bl_options = {'DEFAULT_CLOSED'}
    rows = ("depths",)


class BRUME_PT_light_propagation(_Rows, _RenderPanel, bpy.types.Panel):
    bl_label = "Light Propagation"
    bl_parent_id = "BRUME_PT_volumes"
    rows = ("field_resolution", "iterations", "cascades", "cascade_focus")

    @classmethod
    def applies(cls, context):
        return context.scene.brume.method == 'LPV'


class BRUME_PT_light_propagation_comparison(_Rows, _RenderPanel, bpy.types.Panel):
    bl_label = "Comparison"
    bl_parent_id = "BRUME_PT_light_propagation"
    bl_options = {'DEFAULT_CLOSED'}
    rows = ("light_paths", "blockers")

    @classmethod
    def applies(cls, context):
        return context.scene.brume.method == 'LPV'


class BRUME_PT_discrete_ordinates(_Rows, _RenderPanel, bpy.types.Panel):
    bl_label = "Discrete Ordinates"
    bl_parent_id = "BRUME_PT_volumes"
    rows = ("field_resolution", "ordinates", "iterations", "cascades", "cascade_focus")

    @classmethod
    def applies(cls, context):
        return context.scene.brume.method == 'DOM'


class BRUME_PT_world_volume(_RenderPanel, bpy.types.Panel):
    bl_label = "World Volume"
    bl_parent_id = "BRUME_PT_volumes"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout, settings = self.split(), context.scene.brume
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
        self.layout.prop(context.scene.brume, "viewport_frame_time", text="Viewport Frame Time")
        self.layout.prop(context.scene.render, "preview_pixel_size", text="Pixel Size")
        self.layout.prop(context.scene.render, "use_persistent_data", text="Persistent Data")
        self.layout.prop(context.scene.brume, "show_statistics")


class BRUME_PT_film(_RenderPanel, bpy.types.Panel):
    bl_label = "Film"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout = self.split()
        layout.prop(context.scene.render, "film_transparent")
        layout.prop(context.scene.render, "filter_size")


class BRUME_PT_passes(EnginePanel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context):
        layout = self.split()
        column = layout.column()
        for *_, switch in PASSES:
            owner, _, name = switch.rpartition(".")
            column.prop(getattr(context.view_layer, owner) if owner else context.view_layer, name)


class BRUME_PT_override(EnginePanel, bpy.types.Panel):
    bl_label = "Override"
    bl_context = "view_layer"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        self.split().prop(context.view_layer, "material_override")


class BRUME_PT_ray_visibility(EnginePanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"

    @classmethod
    def applies(cls, context):
        return context.object and context.object.type in {'MESH', 'CURVE', 'SURFACE', 'FONT',
                                                          'META', 'LIGHT'}

    def draw(self, context):
        layout, ob = self.split(), context.object
        layout.prop(ob, "visible_camera", text="Camera", toggle=False)
        if ob.type != 'LIGHT':
            layout.prop(ob, "visible_shadow", text="Shadow", toggle=False)


class BRUME_PT_material_settings(EnginePanel, bpy.types.Panel):
    """How alpha is read, where Blender has a setting for that."""
    bl_label = "Settings"
    bl_context = "material"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def applies(cls, context):
        return context.material and compat.has_blend_method()

    def draw(self, context):
        layout, material = self.split(), context.material
        layout.prop(material, "blend_method")
        if material.blend_method == 'CLIP':
            layout.prop(material, "alpha_threshold")


class _LightPanel(EnginePanel):
    bl_context = "data"
    types = {'POINT', 'SUN', 'SPOT', 'AREA'}

    @classmethod
    def applies(cls, context):
        return context.light and context.light.type in cls.types


class BRUME_PT_light(_LightPanel, bpy.types.Panel):
    bl_label = "Light"

    def draw(self, context):
        layout, light = self.layout, context.light
        layout.row().prop(light, "type", expand=True)
        self.split()
        column = layout.column()
        column.prop(light, "color")
        column.prop(light, "energy")
        for name in compat.LIGHT_PROPERTIES:
            if hasattr(light, name):
                column.prop(light, name)
        column = layout.column()
        if light.type == 'SUN':
            column.prop(light, "angle")
        elif light.type == 'AREA':
            column.prop(light, "shape")
            if light.shape in {'RECTANGLE', 'ELLIPSE'}:
                column = layout.column(align=True)
                column.prop(light, "size", text="Size X")
                column.prop(light, "size_y", text="Y")
            else:
                column.prop(light, "size")
            layout.prop(light, "spread")
        else:
            column.prop(light, "shadow_soft_size", text="Radius")
        layout.prop(light, "use_shadow", text="Cast Shadow", toggle=False)


class BRUME_PT_light_spot(_LightPanel, bpy.types.Panel):
    bl_label = "Beam Shape"
    bl_parent_id = "BRUME_PT_light"
    types = {'SPOT'}

    def draw(self, context):
        layout, light = self.split(), context.light
        layout.prop(light, "spot_size", text="Spot Size")
        layout.prop(light, "spot_blend", text="Blend", slider=True)
        layout.prop(light, "show_cone")


class BRUME_PT_light_nodes(_LightPanel, bpy.types.Panel):
    bl_label = "Nodes"

    def draw(self, context):
        layout, light = self.layout, context.light
        if compat.has_use_nodes():
            layout.prop(light, "use_nodes", icon='NODETREE', toggle=True)
        tree = compat.node_tree(light)
        if tree is None:
            return
        layout, output = self.split(), tree.get_output_node('ALL')
        if output is None:
            layout.label(text="No output node")
        else:
            layout.template_node_view(tree, output, output.inputs["Surface"])


_CLASSES = (BRUME_PT_sampling, BRUME_PT_sampling_advanced, BRUME_PT_volumes,
            BRUME_PT_light_propagation, BRUME_PT_light_propagation_comparison,
            BRUME_PT_discrete_ordinates,
            BRUME_PT_single_scattering, BRUME_PT_world_volume, BRUME_PT_lights, BRUME_PT_film,
            BRUME_PT_performance,
            BRUME_PT_passes, BRUME_PT_override, BRUME_PT_ray_visibility,
            BRUME_PT_material_settings, BRUME_PT_light, BRUME_PT_light_spot,
            BRUME_PT_light_nodes)

# EEVEE's panels that show what Brume reads too.
_ADDED = {
    'MATERIAL_PT_preview', 'EEVEE_MATERIAL_PT_context_material', 'EEVEE_MATERIAL_PT_surface',
    'EEVEE_MATERIAL_PT_volume', 'EEVEE_WORLD_PT_surface', 'EEVEE_WORLD_PT_volume'}
# What Brume does not do, or shows in panels of its own.
_LEFT_OUT = {
    'VIEWLAYER_PT_filter', 'VIEWLAYER_PT_layer_passes', 'DATA_PT_light', 'DATA_PT_area',
    'DATA_PT_spot', 'DATA_PT_falloff_curve', 'RENDER_PT_stereoscopy', 'RENDER_PT_output_views',
    'DATA_PT_camera_stereoscopy'}


def blender_panels():
    """Blender's panels that apply: those for engines in general, and some of EEVEE's."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        # A panel that the node editor shows too is there twice, with one set of engines.
        name = panel.__name__.removeprefix("NODE_")
        if engines is None or name in _LEFT_OUT:
            continue
        if name in _ADDED or 'BLENDER_RENDER' in engines:
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
