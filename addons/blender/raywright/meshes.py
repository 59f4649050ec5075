"""Arrays of Blender's meshes, a row a corner."""

import numpy as np


def corner_data(mesh, uv_names):
    """Arrays with a row a corner of a mesh: positions, normals, coordinates of the named maps (empty: the active one), colours."""
    corners = len(mesh.loops)
    vertices = np.empty(corners, np.int32)
    mesh.loops.foreach_get("vertex_index", vertices)
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    normals = np.empty(3 * corners, np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    layers = []
    for name in uv_names:
        layer = mesh.uv_layers.get(name) if name else next((l for l in mesh.uv_layers if l.active_render), None)
        layers.append(layer or next((l for l in mesh.uv_layers if l.active_render), None))
    while layers and layers[-1] is None:
        layers.pop()
    uv_sets = []
    for layer in layers:
        uv = np.empty(2 * corners, np.float32)
        layer.uv.foreach_get("vector", uv)
        uv_sets.append(uv.reshape(-1, 2))
    return {
        "positions": positions.reshape(-1, 3)[vertices],
        "normals": normals.reshape(-1, 3),
        "uv_sets": uv_sets,
        "colours": corner_colours(mesh, vertices),
    }


def corner_colours(mesh, vertices):
    attribute = mesh.color_attributes.active_color
    if attribute is None:
        return None
    colours = np.empty(4 * len(attribute.data), np.float32)
    attribute.data.foreach_get("color", colours)
    colours = colours.reshape(-1, 4)
    return colours[vertices] if attribute.domain == "POINT" else colours
