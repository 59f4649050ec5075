"""Raywright as a render engine of Blender."""

import bpy

from . import engine, panel


def register():
    bpy.utils.register_class(engine.RaywrightEngine)
    panel.register()


def unregister():
    panel.unregister()
    bpy.utils.unregister_class(engine.RaywrightEngine)
