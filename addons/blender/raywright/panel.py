"""Settings of the engine, its panels, and the preferences of the add-on."""

import textwrap

import bpy

from . import engine


class SceneSettings(bpy.types.PropertyGroup):
    samples: bpy.props.IntProperty(name="Samples", description="Samples of a pixel, at most", default=128, min=1, max=65536)
    use_max_error: bpy.props.BoolProperty(name="Stop at an Error", description="Add samples where the error is largest, until the picture's error is below a limit", default=False)
    max_error: bpy.props.FloatProperty(
        name="Error", description="Root relMSE that the upper end of the error's interval stays below: 0.1 is grainy, 0.02 clean", default=0.05, min=0.0001, max=1, precision=4
    )
    denoise: bpy.props.BoolProperty(name="Denoise", description="Filter the noise out of the picture, and state the error of the result", default=True)
    max_depth: bpy.props.IntProperty(name="Segments", description="Segments of a path, that from the camera included", default=12, min=1, max=64)
    clamp: bpy.props.FloatProperty(name="Clamp", description="Largest radiance of a sample; 0 for no limit. Fireflies become fewer, but light is lost", default=0, min=0)
    seed: bpy.props.IntProperty(name="Seed", default=0, min=0)
    filter: bpy.props.EnumProperty(
        name="Pixel Filter", items=[(n, n.title(), "") for n in ("box", "tent", "gaussian", "blackman-harris")], default="blackman-harris", description="How far around a pixel samples count towards it"
    )


class ViewLayerSettings(bpy.types.PropertyGroup):
    use_pass_albedo: bpy.props.BoolProperty(name="Albedo", description="Base colour of what is first hit")
    use_pass_error: bpy.props.BoolProperty(name="Error", description="Standard error of each pixel")


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__
    program: bpy.props.StringProperty(name="Program", description="File of the program; empty: that of the wheel, or on the path", subtype="FILE_PATH")

    def draw(self, context):
        self.layout.prop(self, "program")


class ListLeftOut(bpy.types.Operator):
    """List what the scene has and Raywright can't show"""

    bl_idname = "raywright.list_left_out"
    bl_label = "Check the Scene"

    def execute(self, context):
        try:
            engine.LEFT_OUT[context.scene.name] = engine.explain(context.evaluated_depsgraph_get())
        except engine.program.MissingProgram as missing:
            self.report({"ERROR"}, str(missing))
            return {"CANCELLED"}
        return {"FINISHED"}


class RenderPanel(bpy.types.Panel):
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"

    @classmethod
    def poll(cls, context):
        return context.engine == engine.RaywrightEngine.bl_idname


class SamplingPanel(RenderPanel):
    bl_idname, bl_label = "RENDER_PT_raywright_sampling", "Sampling"

    def draw(self, context):
        own, layout = context.scene.raywright, self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(own, "samples")
        row = layout.row(heading="Stop at an Error")
        row.prop(own, "use_max_error", text="")
        row.prop(own, "max_error", text="")
        for name in ("denoise", "max_depth", "clamp", "filter", "seed"):
            layout.prop(own, name)
        error = engine.ERRORS.get(context.scene.name)
        if error:
            layout.label(text=f"Last picture: {error}")


class LeftOutPanel(RenderPanel):
    bl_idname, bl_label = "RENDER_PT_raywright_left_out", "What the Picture Can't Show"

    def draw(self, context):
        layout = self.layout
        layout.operator(ListLeftOut.bl_idname)
        lines = engine.LEFT_OUT.get(context.scene.name)
        if lines is not None and not lines:
            layout.label(text="Nothing was found")
        for line in lines or ():
            for k, part in enumerate(textwrap.wrap(line, max(context.region.width // 8, 20))):
                layout.label(text=part, icon="DOT" if k == 0 else "BLANK1")


class PassesPanel(bpy.types.Panel):
    bl_idname, bl_label = "VIEWLAYER_PT_raywright_passes", "Passes"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "view_layer"

    @classmethod
    def poll(cls, context):
        return context.engine == engine.RaywrightEngine.bl_idname

    def draw(self, context):
        layout, layer = self.layout, context.view_layer
        layout.use_property_split, layout.use_property_decorate = True, False
        for owner, name in ((layer, "use_pass_z"), (layer, "use_pass_normal"), (layer.raywright, "use_pass_albedo"), (layer.raywright, "use_pass_error")):
            layout.prop(owner, name)


CLASSES = (SceneSettings, ViewLayerSettings, Preferences, ListLeftOut, SamplingPanel, LeftOutPanel, PassesPanel)
# Blender's own panels of materials, lamps and the world that suit this engine.
SHARED = ("MATERIAL_PT_", "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface", "WORLD_PT_", "DATA_PT_EEVEE_light", "DATA_PT_light", "DATA_PT_spot")


def shared_panels():
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines and ("BLENDER_RENDER" in engines or panel.__name__.startswith(SHARED)):
            yield panel


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.raywright = bpy.props.PointerProperty(type=SceneSettings)
    bpy.types.ViewLayer.raywright = bpy.props.PointerProperty(type=ViewLayerSettings)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add(engine.RaywrightEngine.bl_idname)


def unregister():
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard(engine.RaywrightEngine.bl_idname)
    del bpy.types.ViewLayer.raywright
    del bpy.types.Scene.raywright
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
