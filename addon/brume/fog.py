# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog made of Gaussians: its settings at object.brume, operators and panels."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import compat
from .panels import EnginePanel
from .properties import changed

# Kinds of objects that can be fog, or have points or particles that are.
_TYPES = {'EMPTY', 'MESH', 'META', 'POINTCLOUD', 'CURVE', 'SURFACE', 'FONT'}
_THEMSELVES = {'EMPTY', 'META'}

CURVES = ("Radius", "Strength")

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


def _attribute_names(source, context, text):
    ob = source.id_data
    names = [group.name for group in ob.vertex_groups]
    names += [attribute.name for attribute in getattr(ob.data, "attributes", ())]
    return names


def _color_names(source, context, text):
    return [attribute.name for attribute in getattr(source.id_data.data, "attributes", ())
            if attribute.data_type in {'FLOAT_COLOR', 'BYTE_COLOR', 'FLOAT_VECTOR'}]


def _system_names(source, context, text):
    return [system.name for system in source.id_data.particle_systems]


class BrumeFogSource(bpy.types.PropertyGroup):
    name: StringProperty(
        name="Name", default="Fog", update=changed, override=_OVERRIDE)
    enabled: BoolProperty(
        name="Enabled", default=True, update=changed, override=_OVERRIDE,
        description="Lets this source give fog in the viewport and in renders")
    source: EnumProperty(
        name="Source", default='OBJECT', update=changed, override=_OVERRIDE,
        description="What the fog sits on. Time and memory grow with the number of Gaussians, and "
                    "with the space that each fills",
        items=[('OBJECT', "Object", "An empty is one ball of fog as large as it is displayed; "
                                    "metaballs are one each, and their surface is not shown", 0),
               ('POINTS', "Points", "Each vertex of the mesh, after its modifiers, or each point "
                                    "of a point cloud is a ball of fog", 1),
               ('PARTICLES', "Particles", "Each living particle of a particle system is a ball of "
                                          "fog as large as its size", 2)])
    particle_system: StringProperty(
        name="Particle System", update=changed, override=_OVERRIDE, search=_system_names,
        search_options={'SUGGESTION'},
        description="The particle system; empty: the first that is no hair")
    radius: FloatProperty(
        name="Radius", default=1.0, min=0.0, soft_max=10.0, precision=3, update=changed,
        override=_OVERRIDE,
        description="Multiplies the size of each ball of fog: that of a particle, the radius of a "
                    "point (1 m if it has none) or of a metaball, the display size of an empty. "
                    "There 2 % of the density in its middle is left. Small ones in a large scene "
                    "need more Volume Resolution; large ones that overlap take more time")
    density: FloatProperty(
        name="Density", default=1.0, min=0.0, soft_max=10.0, precision=3, update=changed,
        override=_OVERRIDE,
        description="Density in the middle of each ball of fog, per metre. Where they overlap it "
                    "adds up")
    color: FloatVectorProperty(
        name="Color", subtype='COLOR', default=(0.8, 0.8, 0.8), min=0.0, max=1.0,
        update=changed, override=_OVERRIDE,
        description="Share of the light that the fog scatters; it absorbs the rest. Where balls "
                    "of fog overlap, the denser one's color counts more")
    color_attribute: StringProperty(
        name="Color Attribute", update=changed, override=_OVERRIDE, search=_color_names,
        search_options={'SUGGESTION'},
        description="Color attribute of the points that multiplies the color; colors of face "
                    "corners are averaged. Geometry nodes may make it. Empty: none")
    factor_attribute: StringProperty(
        name="Factor", update=changed, override=_OVERRIDE,
        search=_attribute_names, search_options={'SUGGESTION'},
        description="Attribute or vertex group of the points, from 0 to 1, along which the curves "
                    "change radius and strength. A vertex group of a large mesh takes its time to "
                    "read. Empty: the curves are not used")
    material: PointerProperty(
        name="Material", type=bpy.types.Material, update=changed, override=_OVERRIDE,
        description="Material whose Volume output the fog has; its Attribute nodes read "
                    "\"density\" and \"color\". Empty: plain fog of the color above")
    anisotropy: FloatProperty(
        name="Anisotropy", default=0.0, min=-0.99, max=0.99, update=changed, override=_OVERRIDE,
        description="Where plain fog scatters light to: above 0 onwards, as mist does, so that it "
                    "glows around lights; below 0 back to where it came from")
    curves: PointerProperty(
        name="Curves", type=bpy.types.NodeTree, update=changed, override=_OVERRIDE,
        poll=lambda source, tree: is_curves(tree),
        description="Curves that multiply radius and strength of each ball of fog: along the life "
                    "of a particle, from birth to death, or the factor of a point. Other sources "
                    "may share them")


class BrumeObjectSettings(bpy.types.PropertyGroup):
    fog_sources: CollectionProperty(type=BrumeFogSource, name="Fog Sources",
                                    override={*_OVERRIDE, 'USE_INSERTION'})
    fog_active: IntProperty(name="Active Fog Source", options=set(), override=_OVERRIDE)


def is_curves(tree):
    """Whether a node group holds the curves of a fog source."""
    return all(name in tree.nodes and tree.nodes[name].bl_idname == 'ShaderNodeFloatCurve'
               for name in CURVES)


def active(ob):
    """The source that is chosen in the object's list, or None."""
    settings = ob.brume
    if 0 <= settings.fog_active < len(settings.fog_sources):
        return settings.fog_sources[settings.fog_active]
    return None


# ------------------------------------------------------------------------------------------------
# Operators


class _Operator:
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        ob = context.object
        return bool(ob) and ob.type in _TYPES and not ob.library and cls.applies(ob)

    @classmethod
    def applies(cls, ob):
        return active(ob) is not None


class BRUME_OT_fog_add(_Operator, bpy.types.Operator):
    bl_idname = "brume.fog_add"
    bl_label = "Add Fog"
    bl_description = ("Makes fog of the object's particles if it has any, else of an empty or of "
                      "metaballs themselves, else of the object's points")

    @classmethod
    def applies(cls, ob):
        return True

    def execute(self, context):
        ob = context.object
        source = ob.brume.fog_sources.add()
        systems = [ob.particle_systems.active, *ob.particle_systems]
        system = next((s for s in systems if s and s.settings.type != 'HAIR'), None)
        if system:
            source.source, source.particle_system = 'PARTICLES', system.name
            source.name = system.name
        else:
            source.source = 'OBJECT' if ob.type in _THEMSELVES else 'POINTS'
            source.name = "Fog"
        ob.brume.fog_active = len(ob.brume.fog_sources) - 1
        return {'FINISHED'}


class BRUME_OT_fog_remove(_Operator, bpy.types.Operator):
    bl_idname = "brume.fog_remove"
    bl_label = "Remove Fog"
    bl_description = "Removes the chosen source of fog from the object"

    def execute(self, context):
        ob = context.object
        ob.brume.fog_sources.remove(ob.brume.fog_active)
        ob.brume.fog_active = max(0, ob.brume.fog_active - 1)
        ob.update_tag()
        return {'FINISHED'}


class BRUME_OT_fog_curves_add(_Operator, bpy.types.Operator):
    bl_idname = "brume.fog_curves_add"
    bl_label = "Add Curves"
    bl_description = ("Adds curves by which balls of fog grow, fade in and vanish: along the life "
                      "of particles or the factor of points")

    def execute(self, context):
        # The dot hides it in Blender's lists of node groups.
        tree = bpy.data.node_groups.new(".Fog Curves", 'ShaderNodeTree')
        for name in CURVES:
            node = tree.nodes.new('ShaderNodeFloatCurve')
            node.name = node.label = name
            for point in node.mapping.curves[0].points:
                point.location.y = 1.0
            node.mapping.update()
        active(context.object).curves = tree
        return {'FINISHED'}


# ------------------------------------------------------------------------------------------------
# Panels


class BRUME_UL_fog(bpy.types.UIList):
    _ICONS = {'OBJECT': 'OBJECT_DATA', 'POINTS': 'POINTCLOUD_DATA', 'PARTICLES': 'PARTICLES'}

    def draw_item(self, context, layout, data, source, icon, active_data, active_property, index):
        row = layout.row(align=True)
        row.prop(source, "name", text="", emboss=False, icon=self._ICONS[source.source])
        row.prop(source, "enabled", text="")


class _FogPanel(EnginePanel):
    bl_context = "object"

    @classmethod
    def applies(cls, context):
        ob = context.object
        return bool(ob) and ob.type in _TYPES and cls.has(ob)

    @classmethod
    def has(cls, ob):
        return active(ob) is not None


class BRUME_PT_fog(_FogPanel, bpy.types.Panel):
    bl_label = "Fog"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def has(cls, ob):
        return True

    def draw(self, context):
        layout, ob = self.layout, context.object
        row = layout.row()
        row.template_list("BRUME_UL_fog", "", ob.brume, "fog_sources", ob.brume, "fog_active",
                          rows=3)
        column = row.column(align=True)
        column.operator("brume.fog_add", text="", icon='ADD')
        column.operator("brume.fog_remove", text="", icon='REMOVE')
        source = active(ob)
        if source is None:
            return
        layout = self.split()
        layout.prop(source, "source")
        if source.source == 'PARTICLES':
            layout.prop(source, "particle_system", text="System", icon='PARTICLES')
        column = layout.column(align=True)
        column.prop(source, "radius")
        column.prop(source, "density")
        column = layout.column()
        column.prop(source, "color")
        if source.source == 'POINTS':
            column.prop(source, "color_attribute", text="Attribute")


class BRUME_PT_fog_curves(_FogPanel, bpy.types.Panel):
    bl_label = "Curves"
    bl_parent_id = "BRUME_PT_fog"

    @classmethod
    def has(cls, ob):
        # Empties and metaballs have nothing to go along.
        return super().has(ob) and active(ob).source != 'OBJECT'

    def draw(self, context):
        layout, source = self.split(), active(context.object)
        if source.source == 'POINTS':
            layout.prop(source, "factor_attribute")
        self.layout.template_ID(source, "curves", new="brume.fog_curves_add")
        if source.curves is None or not is_curves(source.curves):
            return
        column = layout.column()
        column.active = source.source == 'PARTICLES' or bool(source.factor_attribute)
        for name in CURVES:
            column.label(text=name)
            column.template_curve_mapping(source.curves.nodes[name], "mapping")


class BRUME_PT_fog_material(_FogPanel, bpy.types.Panel):
    bl_label = "Medium"
    bl_parent_id = "BRUME_PT_fog"

    def draw(self, context):
        layout, source = self.split(), active(context.object)
        self.layout.template_ID(source, "material", new="material.new")
        if source.material is None:
            layout.prop(source, "anisotropy", slider=True)
            return
        tree = compat.node_tree(source.material)
        output = tree and tree.get_output_node('ALL')
        if output is None:
            layout.label(text="No output node")
        else:
            layout.template_node_view(tree, output, output.inputs["Volume"])


_CLASSES = (BrumeFogSource, BrumeObjectSettings, BRUME_OT_fog_add, BRUME_OT_fog_remove,
            BRUME_OT_fog_curves_add, BRUME_UL_fog, BRUME_PT_fog, BRUME_PT_fog_curves,
            BRUME_PT_fog_material)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.brume = PointerProperty(type=BrumeObjectSettings, override=_OVERRIDE)


def unregister():
    del bpy.types.Object.brume
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
