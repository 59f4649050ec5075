"""The scene file of Raywright, from a scene described in Blender's terms. Nothing here needs Blender.

Blender's z axis points up, Raywright's y axis: a point (x, y, z) becomes (x, z, -y). Meshes keep Blender's coordinates,
and the transforms of the objects turn them.
"""

import json
import math
import struct

import numpy as np

TURN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def turned(vector):
    """A point or direction of Blender in Raywright's axes."""
    return (TURN @ np.asarray(vector, float)[:3]).tolist()


def transform(matrix):
    """The steps of an object whose matrix in Blender is `matrix`, four rows of four."""
    return [{"matrix": (TURN @ np.asarray(matrix, float)[:3]).tolist()}]


def axes(matrix):
    """Unit directions of the columns of a Blender matrix, and its origin, in Raywright's axes."""
    columns = (TURN @ np.asarray(matrix, float)[:3]).T
    units = columns[:3] / np.linalg.norm(columns[:3], axis=1, keepdims=True)
    return [*units.tolist(), columns[3].tolist()]


# ---------------------------------------------------------------------------------------------------------------- meshes


def unique_vertices(columns):
    """Rows that occur first, and for each row the number of its first equal among them."""
    rows = np.ascontiguousarray(np.concatenate([np.ascontiguousarray(c, np.float32) for c in columns], 1))
    keys = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))).ravel()
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    return first, inverse.reshape(-1)


def glb(positions, normals, uv_sets=(), colours=None):
    """A GLB file of one mesh. Each array has a row a corner, three corners a triangle; v of `uv_sets` grows upwards."""
    columns = [positions, normals, *uv_sets] + ([] if colours is None else [colours])
    first, indices = unique_vertices(columns)
    attributes = {"POSITION": positions, "NORMAL": normals}
    for number, uv in enumerate(uv_sets):
        attributes[f"TEXCOORD_{number}"] = np.stack([uv[:, 0], 1 - uv[:, 1]], 1)
    if colours is not None:
        attributes["COLOR_0"] = colours
    views, accessors, chunks, offset = [], [], [], 0

    def add(array, kind, component):
        nonlocal offset
        raw = array.tobytes()
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(raw)})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind})
        chunks.append(raw)
        offset += len(raw)
        return len(accessors) - 1

    primitive = {"attributes": {}}
    for name, array in attributes.items():
        array = np.ascontiguousarray(array[first], "<f4")
        primitive["attributes"][name] = add(array, f"VEC{array.shape[1]}", 5126)
        if name == "POSITION":
            accessors[-1].update(min=array.min(0).tolist(), max=array.max(0).tolist())
    primitive["indices"] = add(indices.astype("<u4"), "SCALAR", 5125)
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "buffers": [{"byteLength": offset}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = b"".join(chunks)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body))
    return head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body


# ---------------------------------------------------------------------------------------------------------------- lights


def scaled(colour, factor):
    return [float(c) * factor for c in colour]


def unseen(cameras):
    """Opacity of a surface that rays from the camera pass: they alone start at its eye, or on its lens."""
    camera = cameras[0]
    eye = camera["pose"]["axes"]["eye"]
    lens = camera["projection"].get("thin_lens", {}).get("aperture_radius", 0)
    reach = 1.001 * lens + 1e-5 * (1 + max(map(abs, eye)))
    return f"if(length(o - {vector_text(eye)}) < {reach:.9g}, 0, 1)"


def in_view(camera, light):
    """Whether the ball around a lamp may reach into a cone around the view. A lamp with an opacity costs time and noise."""
    view, matrix = np.asarray(camera["matrix"], float), np.asarray(light["matrix"], float)
    reach = light.get("radius", 0) + np.linalg.norm(light.get("size", (0, 0))) / 2 * np.linalg.norm(matrix[:3, :3], 2)
    place = matrix[:3, 3] - view[:3, 3]
    distance = np.linalg.norm(place)
    width, height = camera["whole_size"]
    edge = math.tan(camera.get("vertical_fov", 3) / 2) * math.hypot(width, height) / camera["size"][1]
    if distance <= reach:
        return True
    axis = -view[:3, 2] / np.linalg.norm(view[:3, 2])
    angle = math.acos(min(max(float(axis @ place) / distance, -1), 1))
    return angle - math.asin(reach / distance) < math.atan(edge) + 0.05


def vector_text(vector):
    return "[" + ", ".join(f"{c:.9g}" for c in vector) + "]"


def lamp_material(name, radiance, opacity):
    model = {"base_colour": 0, "specular": 0, "emission": radiance}
    if opacity is not None:
        model.update(alpha="blend", opacity=opacity)
    return {"name": name, "model": {"physical": model}}


def lamp_object(name, shape):
    """Lamps of Blender block no light; here they block that of suns, spots and points no more."""
    return {"name": name, "shape": shape, "material": name, "side": "outside", "casts_shadow": False}


def add_point(scene, light, name, opacity):
    """Watts leave in all directions: a sphere of radius r has radiance P / (4 pi^2 r^2)."""
    _, _, _, position = axes(light["matrix"])
    radius = light["radius"]
    if radius > 0:
        radiance = scaled(light["colour"], light["watts"] / (4 * math.pi**2 * radius**2))
        scene["materials"].append(lamp_material(name, radiance, opacity))
        shape = {"sphere": {"centre": position, "radius": radius}}
        scene["objects"].append(lamp_object(name, shape))
    else:
        colour = scaled(light["colour"], light["watts"] / (4 * math.pi))
        scene["lights"].append({"name": name, "kind": {"point": {"position": position}}, "colour": colour})


def add_spot(scene, light, name, _opacity):
    """Blender fades a spot by a smooth step of the cosine, Raywright by a square over three quarters of its width: both
    emit the same power."""
    _, _, back, position = axes(light["matrix"])
    half = min(light["angle"] / 2, math.radians(89.9))
    inner = math.acos(min(1, math.cos(half) + 0.75 * light["blend"] * (1 - math.cos(half))))
    spot = {
        "position": position,
        "direction": scaled(back, -1),
        "inner_angle": min(math.degrees(inner), math.degrees(half)),
        "outer_angle": math.degrees(half),
    }
    colour = scaled(light["colour"], light["watts"] / (4 * math.pi))
    scene["lights"].append({"name": name, "kind": {"spot": spot}, "colour": colour})


def add_sun(scene, light, name, _opacity):
    _, _, back, _ = axes(light["matrix"])
    colour = scaled(light["colour"], light["strength"])
    scene["lights"].append({"name": name, "kind": {"directional": {"to_light": back}}, "colour": colour})


def add_area(scene, light, name, opacity):
    """Watts leave through the front alone: radiance P / (pi A)."""
    width, height = light["size"]
    matrix = np.asarray(light["matrix"], float)
    scales = np.linalg.norm(matrix[:3, :2], axis=0)
    round_ = light["round"]
    area = width * height * scales[0] * scales[1] * (math.pi / 4 if round_ else 1)
    radiance = scaled(light["colour"], light["watts"] / (math.pi * area))
    scene["materials"].append(lamp_material(name, radiance, opacity))
    # The lamp shines along its own -z.
    if round_:
        shape = {"disk": {"centre": [0, 0, 0], "normal": [0, 0, -1], "radius": 0.5}}
    else:
        shape = {"quad": {"corner": [-0.5, -0.5, 0], "edge_u": [0, 1, 0], "edge_v": [1, 0, 0]}}
    steps = [{"scale": [width, height, 1]}, *transform(matrix)]
    scene["objects"].append({**lamp_object(name, shape), "transform": steps})


ADD_LIGHT = {"point": add_point, "spot": add_spot, "sun": add_sun, "area": add_area}


# ------------------------------------------------------------------------------------------------------- camera and world


def camera_entry(camera):
    """The camera of a picture of `size` whose shift moves it by `offset` pixels, which the crop of `view_flags` undoes."""
    right, up, back, eye = axes(camera["matrix"])
    width, height = camera["whole_size"]
    if camera["kind"] == "orthographic":
        projection = {"orthographic": {"height": camera["height"] * height / camera["size"][1]}}
    else:
        tangent = math.tan(camera["vertical_fov"] / 2) * height / camera["size"][1]
        pinhole = {"vertical_fov": math.degrees(2 * math.atan(tangent))}
        projection = {"pinhole": pinhole}
        if camera["aperture_radius"] > 0:
            lens = {"aperture_radius": camera["aperture_radius"], "focus_distance": camera["focus_distance"]}
            projection = {"thin_lens": {"pinhole": pinhole, **lens}}
    return {"pose": {"axes": {"eye": eye, "right": right, "up": up, "back": back}}, "projection": projection}


def shifted(size, region, shift):
    """Size of a picture whose middle is the lens's axis, and the part (x, y, width, height) of it that shows `region`
    of a picture of `size`, moved by `shift` pixels to the right and up."""
    dx, dy = (round(s) for s in shift)
    whole = [size[0] + 2 * abs(dx), size[1] + 2 * abs(dy)]
    x, y, width, height = region
    return whole, [x + abs(dx) + dx, y + abs(dy) - dy, width, height]


def sky(world):
    """Blender's world, as a constant or as a map."""
    if world.get("image"):
        entry = {"image": world["image"], "strength": world["strength"], "rotation": math.degrees(world["rotation"])}
        return {"map": entry}
    return {"constant": scaled(world["colour"], world["strength"])}


# ---------------------------------------------------------------------------------------------------------------- scenes


def scene(description):
    """The whole file as a dictionary. `description` has camera, world, lights, images, textures, materials, meshes and objects."""
    camera = description["camera"]
    result = {
        "format": 1,
        "render": {"size": camera["whole_size"], "integrator": "path"},
        "cameras": [camera_entry(camera)],
        "sky": sky(description["world"]),
        "lights": [],
        "images": description["images"],
        "textures": description["textures"],
        "materials": [],
        "meshes": [{"name": name, "source": {"file": file}} for name, file in description["meshes"]],
        "objects": [],
    }
    opacity = unseen(result["cameras"]) if camera["kind"] != "orthographic" else None
    for number, light in enumerate(description["lights"]):
        name = f"light {number} {light['name']}"
        hidden = not light["seen"] and in_view(camera, light)
        ADD_LIGHT[light["kind"]](result, light, name, opacity if hidden else None)
    for name, model in description["materials"]:
        result["materials"].append({"name": name, "model": {"physical": model}})
    hidden = {}
    for entry in description["objects"]:
        material = entry["material"]
        if not entry["seen"] and opacity is not None:
            material = hidden_material(result, hidden, material, opacity)
        placed = {"name": entry["name"], "shape": {"mesh": entry["mesh"]}, "material": material, "casts_shadow": entry["shadow"]}
        result["objects"].append({**placed, "transform": transform(entry["matrix"])})
    return result


def hidden_material(result, hidden, name, opacity):
    """A copy of a material that rays from the camera pass."""
    if name not in hidden:
        model = next(m["model"]["physical"] for m in result["materials"] if m["name"] == name)
        hidden[name] = f"{name}, unseen by the camera"
        copy = {**model, "alpha": "blend", "opacity": opacity}
        result["materials"].append({"name": hidden[name], "model": {"physical": copy}})
    return hidden[name]


def compact(value):
    """JSON whose numbers have the nine digits that single precision needs."""

    def short(item):
        if isinstance(item, float):
            return float(f"{item:.9g}")
        if isinstance(item, dict):
            return {key: short(part) for key, part in item.items()}
        if isinstance(item, (list, tuple)):
            return [short(part) for part in item]
        return item

    return json.dumps(short(value), separators=(",", ":"))
