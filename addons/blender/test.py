"""The extension in Blender: installed from its zip, F12, a picture; then five scenes beside Cycles, by their means.

    python3.11 -m venv venv && venv/bin/pip install bpy==5.0.1 OpenEXR --extra-index-url https://download.blender.org/pypi/
    PATH=$PWD/target/release:$PATH venv/bin/python addons/blender/test.py OUT [SCENE|passes ...]

Not a part of .ci/run: the module is 350 MB. It ends with 1 where a check fails. OUT has the pictures, Cycles' beside ours.
"""

import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="raywright-blender-"))

import bpy
import numpy as np
from mathutils import Vector

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE / "raywright")]
import exr
import pack

SIZE, SAMPLES = (240, 180), 128
FAILED = []


def check(holds, what):
    print("ok  " if holds else "FAIL", what, flush=True)
    if not holds:
        FAILED.append(what)


def install(out):
    """The extension's zip, as *Install from Disk* does it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    archive = pack.pack(str(pathlib.Path(out, "raywright.zip").resolve()))
    tool = pathlib.Path(bpy.utils.system_resource("SCRIPTS"), "addons_core", "bl_pkg", "cli", "blender_ext.py")
    check(subprocess.run([sys.executable, tool, "validate", archive]).returncode == 0, "the manifest is valid")
    bpy.ops.preferences.addon_enable(module="bl_pkg")
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True, overwrite=True)
    engines = [getattr(e, "bl_idname", "") for e in bpy.types.RenderEngine.__subclasses__()]
    check("RAYWRIGHT" in engines, f"installed from the zip, engines {engines}")


# ---------------------------------------------------------------------------------------------------------------- scenes


def clear():
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.lights, bpy.data.cameras, bpy.data.worlds, bpy.data.images):
        for thing in list(collection):
            collection.remove(thing)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    if not scene.world.node_tree:
        scene.world.use_nodes = True
    background().inputs["Color"].default_value = (0, 0, 0, 1)
    return scene


def background():
    return next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")


def camera(eye, target, fov=45):
    data = bpy.data.cameras.new("camera")
    thing = add("camera", data, eye)
    thing.rotation_euler = (Vector(target) - Vector(eye)).to_track_quat("-Z", "Y").to_euler()
    data.lens_unit, data.angle = "FOV", math.radians(fov)
    bpy.context.scene.camera = thing
    return thing


def add(name, data, place=(0, 0, 0), turn=(0, 0, 0)):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    thing.location, thing.rotation_euler = place, turn
    return thing


def lamp(kind, energy, place, target=None, **values):
    data = bpy.data.lights.new(kind, kind)
    data.energy = energy
    for key, value in values.items():
        setattr(data, key, value)
    thing = add(kind, data, place)
    if target is not None:
        thing.rotation_euler = (Vector(target) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    return thing


def principled(colour, **inputs):
    material = bpy.data.materials.new("material")
    if not material.node_tree:
        material.use_nodes = True
    node = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value = (*colour, 1)
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    return material


def diffuse(colour):
    material = principled(colour)
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = (*colour, 1)
    tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Surface"])
    return material


def primitive(operator, material, smooth=False, **values):
    getattr(bpy.ops.mesh, operator)(**values)
    thing = bpy.context.object
    if smooth:
        bpy.ops.object.shade_smooth()
    thing.data.materials.append(material)
    return thing


def floor(material=None, size=20):
    return primitive("primitive_plane_add", material or diffuse((0.6, 0.6, 0.6)), size=size)


def lamps():
    """Sun, point, spot and area lamps over matte balls, outside of the picture."""
    clear()
    floor()
    for k in range(4):
        primitive("primitive_uv_sphere_add", diffuse((0.7, 0.3 + 0.1 * k, 0.2)), True, radius=0.5, location=(-2.25 + 1.5 * k, 0, 0.5), segments=48, ring_count=24)
    lamp("SUN", 0.5, (0, 0, 5), (2, 1, 0), angle=0.009)
    lamp("POINT", 150, (-4, -2, 3), shadow_soft_size=0.25)
    lamp("SPOT", 400, (3, -3, 4), (1, 0, 0.5), spot_size=math.radians(50), spot_blend=0.4, shadow_soft_size=0.0)
    lamp("AREA", 120, (0, 3, 3.5), (0, 0, 0), shape="RECTANGLE", size=2, size_y=0.7)
    camera((0, -7, 2.4), (0, 0, 0.5), 40)


def materials():
    """Principled plastics, metals and coats under an even sky and an area lamp."""
    clear()
    background().inputs["Color"].default_value = (0.6, 0.7, 0.9, 1)
    background().inputs["Strength"].default_value = 0.6
    floor()
    rows = [
        [principled((0.8, 0.2, 0.1), Roughness=r) for r in (0.1, 0.3, 0.6, 1.0)],
        [principled((0.9, 0.6, 0.3), Roughness=r, Metallic=1.0) for r in (0.05, 0.2, 0.4, 0.7)],
        [principled((0.1, 0.3, 0.7), Roughness=0.6, Coat_Weight=w) for w in (0.3, 1.0)] + [principled((0.3, 0.6, 0.3), Roughness=0.3, Specular_IOR_Level=s) for s in (0.0, 0.2)],
    ]
    for y, row in enumerate(rows):
        for x, material in enumerate(row):
            primitive("primitive_uv_sphere_add", material, True, radius=0.45, location=(-1.65 + 1.1 * x, 1.1 * y - 1, 0.45), segments=48, ring_count=24)
    lamp("AREA", 200, (-3, -3, 5), (0, 0, 0), shape="DISK", size=1.5)
    camera((0, -6, 4), (0, 0.1, 0.3), 38)


def picture(name, size, pixel, space="sRGB"):
    image = bpy.data.images.new(name, size, size)
    image.colorspace_settings.name = space
    v, u = np.mgrid[0:size, 0:size] / size
    whole = np.ones((size, size, 4), np.float32)
    whole[..., :3] = pixel(u, v)
    image.pixels.foreach_set(whole.ravel())
    image.update()
    return image


def textures():
    """Pictures on subdivided and instanced meshes, lens blur, a normal map."""
    clear()
    background().inputs["Color"].default_value = (1, 1, 1, 1)
    background().inputs["Strength"].default_value = 0.4
    grid = picture("grid", 128, lambda u, v: np.stack([(np.floor(8 * u) + np.floor(8 * v)) % 2 * 0.7 + 0.1, 0.2 + 0.5 * u, 0.2 + 0.5 * v], -1))
    bumps = picture("bumps", 128, lambda u, v: np.stack([0.5 + 0.2 * np.sin(60 * u), 0.5 + 0.2 * np.sin(60 * v), np.full_like(u, 0.95)], -1), "Non-Color")
    material = principled((1, 1, 1), Roughness=0.5)
    tree = material.node_tree
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    colour, normal, mapped = (tree.nodes.new(k) for k in ("ShaderNodeTexImage", "ShaderNodeTexImage", "ShaderNodeNormalMap"))
    colour.image, normal.image = grid, bumps
    mapping, uv = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.inputs["Scale"].default_value, mapping.inputs["Rotation"].default_value = (2, 1, 1), (0, 0, 0.3)
    for a, b in ((uv.outputs["UV"], mapping.inputs[0]), (mapping.outputs[0], colour.inputs[0]), (colour.outputs[0], shader.inputs["Base Color"])):
        tree.links.new(a, b)
    tree.links.new(normal.outputs[0], mapped.inputs["Color"])
    tree.links.new(mapped.outputs[0], shader.inputs["Normal"])
    floor(diffuse((0.5, 0.5, 0.5)))
    bpy.ops.mesh.primitive_monkey_add(size=1.2, location=(0, 0, 0.6))
    head = bpy.context.object
    head.data.materials.append(material)
    head.modifiers.new("finer", "SUBSURF").render_levels = 1
    bpy.ops.object.shade_smooth()
    row = primitive("primitive_cube_add", material, size=0.4, location=(-1.6, 1.2, 0.2))
    array = row.modifiers.new("row", "ARRAY")
    array.count, array.relative_offset_displace = 6, (1.6, 0, 0)
    group = bpy.data.collections.new("group")
    part = primitive("primitive_cone_add", diffuse((0.2, 0.5, 0.2)), radius1=0.2, depth=0.5, location=(0, 0, 0.25))
    bpy.context.scene.collection.objects.unlink(part)
    group.objects.link(part)
    for k in range(5):
        empty = add(f"instance {k}", None, (-1.6 + 0.8 * k, -0.9, 0), (0, 0, k))
        empty.instance_type, empty.instance_collection = "COLLECTION", group
    lamp("AREA", 100, (2, -2, 3), (0, 0, 0), shape="SQUARE", size=1)
    eye = camera((0.4, -4.5, 1.6), (0, 0, 0.5), 40)
    eye.data.dof.use_dof, eye.data.dof.focus_distance, eye.data.dof.aperture_fstop = True, 4.4, 0.4


def glass():
    """A glass ball and a window's pane before matte things, under a sky of a picture, turned."""
    scene = clear()
    sky = picture("sky", 256, lambda u, v: np.stack([0.6 + 0.3 * np.sin(2 * np.pi * u), 0.4 + 0.3 * v, 0.6 + 0.3 * np.cos(2 * np.pi * u)], -1))
    tree = scene.world.node_tree
    node, mapping, place = (tree.nodes.new(k) for k in ("ShaderNodeTexEnvironment", "ShaderNodeMapping", "ShaderNodeTexCoord"))
    node.image = sky
    mapping.inputs["Rotation"].default_value = (0, 0, 1.2)
    tree.links.new(place.outputs["Generated"], mapping.inputs[0])
    tree.links.new(mapping.outputs[0], node.inputs[0])
    tree.links.new(node.outputs[0], background().inputs["Color"])
    floor()
    primitive("primitive_uv_sphere_add", principled((0.9, 0.95, 1.0), Roughness=0.0, Transmission_Weight=1.0, IOR=1.45), True, radius=0.7, location=(-0.7, 0, 0.7), segments=96, ring_count=48)
    primitive("primitive_cube_add", principled((0.6, 0.9, 0.7), Roughness=0.3, Transmission_Weight=1.0), size=0.9, location=(0.9, -0.4, 0.46), rotation=(0, 0, 0.5))
    for k in range(3):
        primitive("primitive_cube_add", diffuse(((0.7, 0.2, 0.2), (0.2, 0.7, 0.2), (0.2, 0.2, 0.7))[k]), size=0.6, location=(-1.2 + 1.2 * k, 1.5, 0.3))
    camera((0.5, -5, 1.8), (0, 0, 0.5), 38)


def interior():
    """A closed room under an area lamp and a glowing mesh: light between matte surfaces, a lamp that is in the picture."""
    clear()
    white, red, green = diffuse((0.75, 0.75, 0.75)), diffuse((0.6, 0.1, 0.1)), diffuse((0.1, 0.5, 0.1))
    for place, turn, material in (
        ((0, 0, 0), (0, 0, 0), white),
        ((0, 0, 3), (math.pi, 0, 0), white),
        ((0, 2, 1.5), (math.pi / 2, 0, 0), white),
        ((0, -4, 1.5), (-math.pi / 2, 0, 0), white),
        ((-2, 0, 1.5), (0, math.pi / 2, 0), red),
        ((2, 0, 1.5), (0, -math.pi / 2, 0), green),
    ):
        primitive("primitive_plane_add", material, size=8, location=place, rotation=turn)
    primitive("primitive_cube_add", white, size=1, location=(-0.7, 0.7, 0.5), rotation=(0, 0, 0.4))
    glow = principled((0, 0, 0), Emission_Strength=4.0)
    primitive("primitive_uv_sphere_add", glow, True, radius=0.15, location=(0.9, 0.5, 0.3))
    lamp("AREA", 60, (0, 0, 2.9), (0, 0, 0), shape="SQUARE", size=1)
    camera((0, -3.8, 1.5), (0, 0, 1.3), 60)


SCENES = {f.__name__: f for f in (lamps, materials, textures, glass, interior)}


# --------------------------------------------------------------------------------------------------------------- renders


def prepare(engine):
    scene = bpy.context.scene
    render = scene.render
    render.engine = engine
    render.resolution_x, render.resolution_y, render.resolution_percentage = *SIZE, 100
    if engine == "CYCLES":
        own = scene.cycles
        own.samples, own.use_adaptive_sampling, own.use_denoising = SAMPLES, False, False
        own.sample_clamp_indirect, own.blur_glossy, own.light_sampling_threshold = 0, 0, 0
        own.max_bounces = own.diffuse_bounces = own.glossy_bounces = own.transmission_bounces = 10
    else:
        scene.raywright.samples, scene.raywright.denoise, scene.raywright.max_depth = SAMPLES, False, 12
    return scene


def rendered(engine, stem):
    """The linear picture of an engine, which is written as .exr and .png, and its seconds."""
    scene = prepare(engine)
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth, settings.color_mode, settings.exr_codec = "OPEN_EXR", "32", "RGB", "ZIP"
    scene.render.filepath = f"{stem}.exr"
    start = time.time()
    bpy.ops.render.render(write_still=True)
    seconds = time.time() - start
    channels = exr.read(f"{stem}.exr")
    return np.stack([channels[c] for c in "RGB"], -1), seconds


def display(pixels):
    pixels = np.clip(pixels, 0, 1)
    return (np.where(pixels < 0.0031308, 12.92 * pixels, 1.055 * pixels ** (1 / 2.4) - 0.055) * 255 + 0.5).astype(np.uint8)


def beside(path, *pictures):
    whole = np.concatenate([display(p) for p in pictures], 1)
    exr.write_png(path, np.concatenate([whole, np.full((*whole.shape[:2], 1), 255, np.uint8)], -1))


def compare(name, out):
    SCENES[name]()
    ours, our_seconds = rendered("RAYWRIGHT", f"{out}/{name}-raywright")
    theirs, their_seconds = rendered("CYCLES", f"{out}/{name}-cycles")
    beside(f"{out}/{name}.png", theirs, ours)
    means = [float(p.mean()) for p in (ours, theirs)]
    share = means[0] / means[1] - 1
    blocks = [p.reshape(SIZE[1] // 20, 20, SIZE[0] // 20, 20, 3).mean((1, 3, 4)) for p in (ours, theirs)]
    worst = float(np.abs(blocks[0] - blocks[1]).max() / means[1])
    print(f"{name}: means {means[0]:.4f} and Cycles' {means[1]:.4f} ({share:+.2%}), worst block {worst:.1%} of the mean, {our_seconds:.1f} s and {their_seconds:.1f} s")
    check(abs(share) < 0.02, f"{name}: means within 2 %")


def layers(path):
    """Channels of all parts of a picture of several layers, without the layer's name."""
    import OpenEXR

    with OpenEXR.File(path, separate_channels=True) as file:
        channels = {name: np.asarray(c.pixels, np.float32) for part in file.parts for name, c in part.channels.items()}
    return {name.split(".", 1)[1]: pixels for name, pixels in channels.items() if "." in name}


def passes(out):
    """Every pass, the error of the picture in the file's metadata, and a border."""
    SCENES["lamps"]()
    scene, layer = prepare("RAYWRIGHT"), bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.raywright.use_pass_albedo = layer.raywright.use_pass_error = True
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.filepath = f"{out}/passes.exr"
    scene.raywright.denoise = True
    bpy.ops.render.render(write_still=True)
    ours = layers(f"{out}/passes.exr")
    check({"Combined.R", "Depth.Z", "Normal.X", "Albedo.R", "Error.R"} <= set(ours), f"passes {sorted(ours)}")
    with open(f"{out}/passes.exr", "rb") as file:
        head = file.read(20000)
    check(b"Raywright" in head and b"error 0." in head, "the picture's error is in the file's metadata")
    check(bpy.ops.raywright.list_left_out() == {"FINISHED"}, "the scene is checked without a render")
    prepare("CYCLES")
    scene.cycles.samples = 16
    bpy.ops.render.render(write_still=True)
    theirs = layers(f"{out}/passes.exr")
    near = theirs["Depth.Z"] < 1e9
    depth = np.median(np.abs(ours["Depth.Z"][near] / theirs["Depth.Z"][near] - 1))
    check(depth < 1e-3, f"depth beside Cycles': median difference {depth:.2e}")
    normal = np.median(np.abs(np.stack([ours[f"Normal.{c}"] - theirs[f"Normal.{c}"] for c in "XYZ"])))
    check(normal < 1e-2, f"normals beside Cycles': median difference {normal:.2e}")


def main():
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    install(out)
    chosen = sys.argv[2:] or [*SCENES, "passes"]
    for name in chosen:
        passes(out) if name == "passes" else compare(name, out)
    print(f"{len(FAILED)} checks failed")
    sys.exit(bool(FAILED))


main()
