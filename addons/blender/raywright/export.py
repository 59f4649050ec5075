"""The scene as Blender sees it, described for scene_file.scene: evaluated meshes and instances, lamps, camera, world, materials.

Blender's own glTF exporter is an operator: it may not run inside a render, changes the selection, and has neither lens
blur nor sizes of lamps. So meshes and materials are read from the evaluated scene itself.
"""

import math

import numpy as np

from . import nodes, scene_file, shaders
from .meshes import corner_data
from .pictures import Pictures

GEOMETRY = {"MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES", "POINTCLOUD", "VOLUME"}
MESHED = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


class Export(Pictures):
    """One export: the description as it grows, and what Raywright can't show, each with the names of its owners."""

    def __init__(self, depsgraph, folder):
        self.depsgraph, self.folder = depsgraph, folder
        self.left_out = {}
        self.description = {"lights": [], "images": [], "textures": [], "materials": [], "meshes": [], "objects": []}
        self.material_names, self.image_names, self.texture_names = {}, {}, {}
        self.uv_names, self.coloured = [], set()
        self.mesh_parts = {}

    def note(self, what, owner):
        self.left_out.setdefault(what, set()).add(owner)

    # ---------------------------------------------------------------------------------------------------------- materials

    def material(self, material):
        """Name of a material of Blender in the file; Blender's grey where there is none."""
        key = material.name_full if material else ""
        if key not in self.material_names:
            name = f"material {len(self.material_names)} {key}".strip()
            self.material_names[key] = name
            surface, notes = {"base_colour": (0.8,) * 3, "roughness": 0.5}, set()
            if material and material.use_nodes and material.node_tree:
                surface = self.surface(material, notes, name)
            elif material:
                surface = {"base_colour": tuple(material.diffuse_color[:3]), "roughness": material.roughness, "metallic": material.metallic}
            for what in notes:
                self.note(what, material.name)
            self.description["materials"].append((name, self.model(surface)))
        return self.material_names[key]

    def surface(self, material, notes, name):
        reader = shaders.Reader(notes)
        output = material.node_tree.get_output_node("CYCLES") or material.node_tree.get_output_node("ALL")
        surface = reader.shader(output.inputs["Surface"]) if output else None
        if output and output.inputs["Volume"].is_linked:
            self.volume(output.inputs["Volume"].links[0].from_node, reader, surface, notes)
        if output and output.inputs["Displacement"].is_linked:
            notes.add("displacement")
        if reader.uses_vertex_colours:
            self.coloured.add(name)
            surface["vertex_colours"] = True
        # Cycles shows a surface without a shader as black, or as nothing around a volume.
        return surface or dict(shaders.BLACK)

    def volume(self, node, reader, surface, notes):
        if node.type != "VOLUME_ABSORPTION" or surface is None or not surface.get("transmission"):
            notes.add("volumes")
            return
        density = reader.constant(node, "Density", ())
        tint = nodes.colour(reader.input(node, "Color", ()))
        if not isinstance(tint, nodes.Texture):
            surface["attenuation_colour"] = tuple(min(max(math.exp(-(1 - c) * density), 1e-6), 1.0) for c in tint)
            surface["attenuation_distance"] = 1.0

    def model(self, surface):
        model = {}
        for key, value in surface.items():
            if key == "normal_texture":
                model[key] = {k: v for k, v in self.texture(value).items() if k != "channel"}
            elif isinstance(value, nodes.Texture):
                use = self.texture(value)
                number = key in ("metallic", "roughness", "transmission", "opacity") and "channel" not in use
                model[key] = {"texture": {**use, "channel": "green"} if number else use}
            elif isinstance(value, tuple):
                limit = math.inf if key in ("emission", "specular_colour") else 1.0
                model[key] = [min(max(c, 0.0), limit) for c in value]
            elif key in ("metallic", "roughness", "transmission", "opacity", "specular"):
                model[key] = min(max(nodes.mean(value), 0.0), 1.0)
            elif isinstance(value, dict):
                model[key] = {k: list(v) if isinstance(v, tuple) else v for k, v in value.items()}
            else:
                model[key] = value
        if model.get("opacity", 1.0) != 1.0:
            model["alpha"] = "blend"
        return model

    # ------------------------------------------------------------------------------------------------------------- meshes

    def parts(self, instance):
        """Pairs of a mesh and a material of the file that show an evaluated object, written when it is first met."""
        thing = instance.object
        materials = [slot.material for slot in thing.material_slots] or list(getattr(thing.data, "materials", ()))
        owner = thing.data.as_pointer() if thing.type == "MESH" else thing.original.as_pointer()
        key = (owner, *(m.name_full if m else "" for m in materials))
        if key not in self.mesh_parts:
            self.mesh_parts[key] = self.new_parts(thing, materials)
        return self.mesh_parts[key]

    def new_parts(self, thing, materials):
        mesh = thing.to_mesh()
        if mesh is None or not len(mesh.polygons):
            thing.to_mesh_clear()
            return []
        names = [self.material(material) for material in materials or [None]]
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        corners, slots = np.empty(3 * count, np.int32), np.empty(count, np.int32)
        mesh.loop_triangles.foreach_get("loops", corners)
        mesh.loop_triangles.foreach_get("material_index", slots)
        slots = np.clip(slots, 0, len(names) - 1)
        data = corner_data(mesh, [""] + self.uv_names)
        parts = []
        for slot in np.unique(slots):
            chosen = corners.reshape(-1, 3)[slots == slot].ravel()
            colours = data["colours"][chosen] if names[slot] in self.coloured and data["colours"] is not None else None
            uv_sets = [uv[chosen] for uv in data["uv_sets"]]
            glb = scene_file.glb(data["positions"][chosen], data["normals"][chosen], uv_sets, colours)
            name = f"mesh {len(self.description['meshes'])}"
            self.description["meshes"].append((name, self.write(f"{name.replace(' ', '')}.glb", glb)))
            parts.append((name, names[slot]))
        thing.to_mesh_clear()
        return parts

    # ---------------------------------------------------------------------------------------------- objects, lamps, camera

    def instances(self, progress):
        for instance in self.depsgraph.object_instances:
            thing = instance.object
            if progress():
                return
            if thing.type == "LIGHT" and instance.show_self:
                self.lamp(thing, instance.matrix_world)
            elif thing.type in GEOMETRY and instance.show_self:
                self.object(instance, thing)

    def object(self, instance, thing):
        if thing.type not in MESHED:
            self.note({"VOLUME": "volumes"}.get(thing.type, "hair and points"), thing.name)
            return
        matrix = [list(row) for row in instance.matrix_world]
        if abs(np.linalg.det(np.array(matrix)[:3, :3])) < 1e-24 or not np.isfinite(matrix).all():
            return
        for flag, what in (("is_holdout", "holdouts"), ("is_shadow_catcher", "shadow catchers")):
            if getattr(thing, flag, False):
                self.note(what, thing.name)
        if not (thing.visible_diffuse and thing.visible_glossy and thing.visible_transmission and thing.visible_shadow):
            self.note("objects that only some rays see", thing.name)
        if any(getattr(m, "type", "") == "PARTICLE_SYSTEM" and m.particle_system.settings.render_type == "PATH" for m in thing.modifiers):
            self.note("hair and points", thing.name)
        for mesh, material in self.parts(instance):
            entry = {"name": thing.name, "mesh": mesh, "material": material, "matrix": matrix, "seen": thing.visible_camera, "shadow": thing.visible_shadow}
            self.description["objects"].append(entry)

    def lamp(self, thing, matrix):
        light = thing.data
        colour, factor = lamp_colour(light)
        entry = {"name": thing.name, "matrix": [list(row) for row in matrix], "colour": colour, "seen": thing.visible_camera}
        if not any(colour) or factor * light.energy <= 0:
            return
        power = factor * light.energy
        if light.type == "SUN":
            if light.angle > math.radians(2):
                self.note("the size of a sun: its shadows are sharp", thing.name)
            entry.update(kind="sun", strength=power)
        elif light.type == "AREA":
            size = [light.size, light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size]
            if min(size) <= 0:
                return
            if light.spread < math.radians(179):
                self.note("the spread of an area lamp: it shines to all sides of its front", thing.name)
            entry.update(kind="area", watts=power, size=size, round=light.shape in ("DISK", "ELLIPSE"))
        elif light.type == "SPOT":
            if light.shadow_soft_size > 0.1:
                self.note("the size of a spot: its shadows are sharp", thing.name)
            entry.update(kind="spot", watts=power, angle=light.spot_size, blend=light.spot_blend)
        else:
            if light.shadow_soft_size > 1:
                self.note("point lamps of more than a metre in radius: things in them get no light", thing.name)
            entry.update(kind="point", watts=power, radius=light.shadow_soft_size)
        self.unnormalised(light, entry)
        self.description["lights"].append(entry)

    def unnormalised(self, light, entry):
        """Without `normalize` (from 4.5) the energy is that of a lamp of one square metre."""
        if getattr(light, "normalize", True) or entry["kind"] not in ("area", "point"):
            return
        if entry["kind"] == "area":
            entry["watts"] *= entry["size"][0] * entry["size"][1] * (math.pi / 4 if entry["round"] else 1)
        else:
            entry["watts"] *= math.pi * entry["radius"] ** 2

    def camera(self, size, region):
        """The camera of a picture of `size`, of which `region` (x, y from the top, width, height) is rendered."""
        thing = self.depsgraph.scene_eval.camera
        data = thing.data
        render = self.depsgraph.scene_eval.render
        aspect = size[0] * render.pixel_aspect_x / (size[1] * render.pixel_aspect_y)
        fit = data.sensor_fit if data.sensor_fit != "AUTO" else ("HORIZONTAL" if aspect >= 1 else "VERTICAL")
        side = size[0] if fit == "HORIZONTAL" else size[1] * render.pixel_aspect_y / render.pixel_aspect_x
        shift = [data.shift_x * side, data.shift_y * side * render.pixel_aspect_x / render.pixel_aspect_y]
        whole, crop = scene_file.shifted(size, region, shift)
        entry = {"matrix": [list(row) for row in thing.matrix_world], "size": size, "whole_size": whole, "kind": "perspective"}
        if render.pixel_aspect_x != render.pixel_aspect_y:
            self.note("pixels that are not square", thing.name)
        if data.type == "ORTHO":
            entry.update(kind="orthographic", height=data.ortho_scale / (aspect if fit == "HORIZONTAL" else 1))
        else:
            if data.type == "PANO":
                self.note("panoramic cameras: a perspective one is shown", thing.name)
            width = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
            tangent = width / (2 * data.lens) / (aspect if fit == "HORIZONTAL" else 1)
            entry["vertical_fov"] = 2 * math.atan(tangent)
            entry.update(self.lens(thing, data))
        self.description["camera"] = entry
        return crop

    def lens(self, thing, data):
        if not data.dof.use_dof:
            return {"aperture_radius": 0.0, "focus_distance": 1.0}
        distance = data.dof.focus_distance
        if data.dof.focus_object:
            target = data.dof.focus_object.evaluated_get(self.depsgraph).matrix_world.translation
            view = thing.matrix_world.normalized().inverted() @ target
            distance = max(-view.z, 1e-4)
        if data.dof.aperture_blades >= 3 or data.dof.aperture_ratio != 1:
            self.note("the shape of an aperture: it is round", thing.name)
        return {"aperture_radius": data.lens * 1e-3 / (2 * max(data.dof.aperture_fstop, 1e-3)), "focus_distance": max(distance, 1e-4)}

    def world(self):
        world = self.depsgraph.scene_eval.world
        entry = {"colour": (0.0, 0.0, 0.0), "strength": 1.0}
        if world and world.use_nodes and world.node_tree:
            notes = set()
            entry = self.world_nodes(world, notes) or entry
            for what in notes:
                self.note(what, world.name)
        elif world:
            entry["colour"] = tuple(world.color)
        self.description["world"] = entry

    def world_nodes(self, world, notes):
        reader = shaders.Reader(notes)
        output = world.node_tree.get_output_node("CYCLES") or world.node_tree.get_output_node("ALL")
        if output is None:
            return None
        if output.inputs["Volume"].is_linked:
            notes.add("volumes")
        found = reader.origin(output.inputs["Surface"], ())
        while found and found[1] is not None and found[1].type in ("MIX_SHADER", "ADD_SHADER"):
            notes.add("a world that differs by ray: the sky of the light alone is shown")
            found = next((f for f in (reader.origin(s, found[2]) for s in found[1].inputs if s.type == "SHADER") if f and f[1]), None)
        if not found or found[1] is None or found[1].type not in ("BACKGROUND", "EMISSION"):
            return None
        _, node, groups = found
        strength = reader.constant(node, "Strength", groups, 1.0)
        source = reader.origin(node.inputs["Color"], groups)
        while source and source[1] is not None and source[1].type in PASSED and source[1].inputs:
            notes.add(nodes.ADJUSTED)
            source = reader.origin(next((s for s in source[1].inputs if s.is_linked), source[1].inputs[0]), source[2])
        if source and source[1] is not None and source[1].type == "TEX_ENVIRONMENT" and source[1].image:
            image = self.image(source[1].image)
            return {"image": image, "strength": max(strength, 0.0), "rotation": sky_turn(reader, source[1], source[2], notes)}
        if source and source[1] is not None and source[1].type == "TEX_SKY":
            notes.add("sky textures: an even blue in their place")
            return {"colour": (0.35, 0.5, 0.8), "strength": max(strength, 0.0)}
        tint = nodes.colour(reader.value(node.inputs["Color"], groups))
        tint = (0.5,) * 3 if isinstance(tint, nodes.Texture) else tuple(max(c, 0.0) for c in tint)
        return {"colour": tint, "strength": max(strength, 0.0)}


PASSED = {"HUE_SAT", "GAMMA", "BRIGHTCONTRAST", "CURVE_RGB", "MIX", "MIX_RGB", "VALTORGB", "INVERT"}


def sky_turn(reader, node, groups, notes):
    """Turn of a Mapping node about the vertical, in radians."""
    found = reader.origin(node.inputs["Vector"], groups)
    if not found or found[1] is None or found[1].type != "MAPPING":
        return 0.0
    turn = reader.input(found[1], "Rotation", found[2], (0.0, 0.0, 0.0))
    if not isinstance(turn, tuple):
        return 0.0
    if abs(turn[0]) > 1e-3 or abs(turn[1]) > 1e-3:
        notes.add("a sky that is turned about other axes than the vertical")
    return -turn[2] if found[1].vector_type == "TEXTURE" else turn[2]


def lamp_colour(light):
    """Colour of a lamp, and the factor of its strength, by its own values and those of an Emission node."""
    colour, factor = list(light.color), 2.0 ** getattr(light, "exposure", 0.0)
    if getattr(light, "use_temperature", False):
        colour = [a * b for a, b in zip(colour, light.temperature_color)]
    if light.use_nodes and light.node_tree:
        reader = shaders.Reader(set())
        output = light.node_tree.get_output_node("CYCLES") or light.node_tree.get_output_node("ALL")
        surface = reader.shader(output.inputs["Surface"]) if output else None
        emitted = (surface or {}).get("emission", (0.0,) * 3)
        if not isinstance(emitted, nodes.Texture):
            colour = [a * b for a, b in zip(colour, emitted)]
    return colour, factor
