"""The parts of the extension that need no Blender: what it writes for the program, and what it reads from it."""

import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np

SOURCE = pathlib.Path(__file__).resolve().parents[1] / "raywright"
# The package without its first file, which needs Blender.
package = types.ModuleType("extension")
package.__path__ = [str(SOURCE)]
sys.modules["extension"] = package
from extension import colours, exr, nodes, program, scene_file, shaders

STILL = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
CAMERA = {
    "matrix": [[1, 0, 0, 0], [0, 0, -1, -5], [0, 1, 0, 2], [0, 0, 0, 1]],
    "kind": "perspective",
    "size": [40, 20],
    "whole_size": [40, 20],
    "vertical_fov": math.radians(30),
    "aperture_radius": 0.0,
    "focus_distance": 1.0,
}
SETTINGS = dict(samples=32, max_error=0.05, denoise=True, max_depth=12, clamp=0, seed=3, threads=2, layers=["depth"], transparent=True, filter="", crop=[1, 2, 3, 4])


def described(**parts):
    empty = dict(camera=CAMERA, world=dict(colour=(0, 0, 0), strength=1.0), lights=[], images=[], textures=[], materials=[], meshes=[], objects=[])
    return scene_file.scene({**empty, **parts})


class Socket(types.SimpleNamespace):
    def __init__(self, name, value=0.0, kind="VALUE", link=None):
        links = [types.SimpleNamespace(from_node=link[0], from_socket=link[1])] if link else []
        super().__init__(name=name, identifier=name, type=kind, default_value=value, is_linked=bool(link), links=links, enabled=True)


def node(kind, *inputs, outputs=("Out",), **values):
    return types.SimpleNamespace(type=kind, bl_label=kind, inputs=list(inputs), outputs=[Socket(o) for o in outputs], **values)


def linked(name, source, output=0, kind="VALUE"):
    return Socket(name, kind=kind, link=(source, source.outputs[output]))


class SceneFile(unittest.TestCase):
    def test_axes_turn_and_keep_hands(self):
        self.assertEqual(scene_file.turned([1, 2, 3]), [1, 3, -2])
        right, up, back, eye = scene_file.axes(CAMERA["matrix"])
        np.testing.assert_allclose(np.cross(right, up), back, atol=1e-12)
        np.testing.assert_allclose((eye, back), ([0, 2, 5], [0, 0, 1]), atol=1e-12)

    def test_lamps_emit_their_watts(self):
        """The flux of each lamp's radiance or intensity is its power; a lamp scaled by its object is larger, not brighter."""
        scaled = np.diag([2.0, 3.0, 1.0, 1.0]).tolist()
        made = described(lights=[
            dict(kind="point", name="p", matrix=STILL, colour=[1, 1, 1], watts=100.0, radius=0.5, seen=True),
            dict(kind="area", name="a", matrix=scaled, colour=[1, 1, 1], watts=60.0, size=[0.5, 0.25], round=True, seen=True),
            dict(kind="point", name="q", matrix=STILL, colour=[1, 0, 0], watts=100.0, radius=0.0, seen=True),
        ])
        ball, disk = (m["model"]["physical"]["emission"][0] for m in made["materials"])
        self.assertAlmostEqual(ball * math.pi * 4 * math.pi * 0.25, 100)
        self.assertAlmostEqual(disk * math.pi * (math.pi / 4 * 0.5 * 0.25 * 6), 60)
        self.assertAlmostEqual(made["lights"][0]["colour"][0] * 4 * math.pi, 100)

    def test_spot_has_the_power_of_a_smooth_step(self):
        spot = described(lights=[dict(kind="spot", name="s", matrix=STILL, colour=[1, 1, 1], watts=1.0, angle=1.0, blend=0.6, seen=True)])["lights"][0]["kind"]["spot"]
        inner, outer = (math.cos(math.radians(spot[k])) for k in ("inner_angle", "outer_angle"))
        cosines = np.linspace(outer, 1, 100001)
        ours = np.clip((cosines - outer) / (inner - outer), 0, 1) ** 2
        step = np.clip((cosines - outer) / (0.6 * (1 - outer)), 0, 1)
        self.assertAlmostEqual(ours.mean(), (step * step * (3 - 2 * step)).mean(), 4)
        self.assertEqual(spot["direction"], [0, -1, 0])

    def test_unseen_lamp_is_clear_for_the_camera_alone(self):
        light = dict(kind="area", name="a", matrix=STILL, colour=[1, 1, 1], watts=1.0, size=[1, 1], round=False, seen=False)
        opacity = described(lights=[light])["materials"][0]["model"]["physical"]["opacity"]
        self.assertIn("length(o - [0, 2, 5])", opacity)
        behind = [[1, 0, 0, 0], [0, 1, 0, -9], [0, 0, 1, 0], [0, 0, 0, 1]]
        above = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 9], [0, 0, 0, 1]]
        made = described(lights=[{**light, "matrix": behind}, {**light, "matrix": above}])
        self.assertTrue(all("opacity" not in m["model"]["physical"] for m in made["materials"]))

    def test_mesh_unseen_by_the_camera_has_a_material_of_its_own(self):
        entry = dict(name="a", mesh="m", material="paint", matrix=STILL, seen=False, shadow=True)
        made = described(meshes=[("m", "m.glb")], materials=[("paint", {"base_colour": [1, 0, 0]})], objects=[entry, {**entry, "seen": True}])
        hidden, plain = (o["material"] for o in made["objects"])
        self.assertEqual(plain, "paint")
        models = {m["name"]: m["model"]["physical"] for m in made["materials"]}
        self.assertEqual(models[hidden]["base_colour"], [1, 0, 0])
        self.assertNotIn("opacity", models[plain])

    def test_shift_becomes_a_crop(self):
        self.assertEqual(scene_file.shifted([40, 20], [0, 0, 40, 20], [3, -2]), ([46, 24], [6, 4, 40, 20]))
        camera = {**CAMERA, "whole_size": [46, 24]}
        fov = scene_file.camera_entry(camera)["projection"]["pinhole"]["vertical_fov"]
        self.assertAlmostEqual(math.tan(math.radians(fov) / 2), math.tan(CAMERA["vertical_fov"] / 2) * 24 / 20)

    def test_mesh_file_keeps_corners_and_merges_equal_ones(self):
        positions = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
        normals = np.tile(np.float32([0, 0, 1]), (6, 1))
        data = scene_file.glb(positions, normals, [positions[:, :2]])
        magic, version, size = struct.unpack_from("<4sII", data)
        self.assertEqual((magic, version, size), (b"glTF", 2, len(data)))
        (length,) = struct.unpack_from("<I", data, 12)
        document = json.loads(data[20 : 20 + length])
        body = data[28 + length :]

        def array(number, kind):
            accessor = document["accessors"][number]
            view = document["bufferViews"][accessor["bufferView"]]
            return np.frombuffer(body[view["byteOffset"] :][: view["byteLength"]], kind).reshape(accessor["count"], -1)

        primitive = document["meshes"][0]["primitives"][0]
        vertices, indices = array(primitive["attributes"]["POSITION"], "<f4"), array(primitive["indices"], "<u4")
        self.assertEqual(len(vertices), 4)
        np.testing.assert_array_equal(vertices[indices.ravel()], positions)
        uv = array(primitive["attributes"]["TEXCOORD_0"], "<f4")
        np.testing.assert_array_equal(uv[indices.ravel()], np.stack([positions[:, 0], 1 - positions[:, 1]], 1))

    def test_file_is_json_with_short_numbers(self):
        self.assertEqual(scene_file.compact({"a": [1 / 3, 2]}), '{"a":[0.333333333,2]}')


class Program(unittest.TestCase):
    def test_flags(self):
        flags = " ".join(program.render_flags(SETTINGS))
        for words in ("--spp 32", "--max-error 0.05", "--denoise", "--crop 1,2,3,4", "--aov depth", "--background transparent", "--threads 2", "--seed 3"):
            self.assertIn(words, flags)
        self.assertNotIn("--clamp", flags)

    def test_progress_says_samples_error_and_time(self):
        line = '{"picture":1,"pictures":1,"samples":[8,16],"of":64,"error":{"root_relmse":{"value":0.0312,"low":0.03,"high":0.0333}},"seconds":1.5,"seconds_left":4.5}'
        share, words = program.progress(line)
        self.assertEqual(share, 0.25)
        self.assertEqual(words, "8 to 16 samples of 64, error 0.0312 (0.03 to 0.0333), 4 s left")
        self.assertIsNone(program.progress("note: a lamp"))

    def test_left_out_lists_effects_and_warnings_not_notes(self):
        report = {
            "effects": [dict(name="caustics", status="left-out", because="a light without size"), dict(name="sky", status="simulated", because="")],
            "warnings": [dict(severity="picture-wrong", message="no texture"), dict(severity="harmless", message="slow")],
        }
        self.assertEqual(program.left_out(report), ["caustics: a light without size", "no texture"])

    def test_setting_that_is_no_program_is_refused(self):
        with self.assertRaisesRegex(program.MissingProgram, "preferences"):
            program.find("/nowhere/raywright")


class Pictures(unittest.TestCase):
    def test_what_is_written_is_read(self):
        pixels = np.random.default_rng(1).random((5, 7, 4)).astype(np.float32)
        with tempfile.TemporaryDirectory() as folder:
            path = f"{folder}/a.exr"
            exr.write(path, pixels)
            channels = exr.read(path)
        np.testing.assert_array_equal(np.stack([channels[c] for c in "RGBA"], -1), pixels)


class Nodes(unittest.TestCase):
    def setUp(self):
        self.notes = set()
        self.reader = shaders.Reader(self.notes)

    def image(self, **values):
        return node("TEX_IMAGE", Socket("Vector", kind="VECTOR"), outputs=("Color", "Alpha"), image="picture", **values)

    def test_principled_reads_links_through_groups_and_reroutes(self):
        image = self.image()
        inside = node("GROUP_OUTPUT", Socket("Shade"), is_active_output=True)
        entry = node("GROUP_INPUT", outputs=("Tint",))
        multiply = node("MIX_RGB", Socket("Fac", 1.0), linked("Color1", entry), Socket("Color2", (0.5, 1.0, 1.0)), blend_type="MULTIPLY")
        inside.inputs = [linked("Shade", multiply)]
        group = node("GROUP", linked("Tint", image), outputs=("Shade",), node_tree=types.SimpleNamespace(nodes=[inside, entry, multiply]))
        reroute = node("REROUTE", linked("Input", group))
        shader = node("BSDF_PRINCIPLED", linked("Base Color", reroute), Socket("Roughness", 0.25), Socket("Metallic", 1.0))
        surface = self.reader.shader(linked("Surface", shader))
        self.assertEqual((surface["roughness"], surface["metallic"]), (0.25, 1.0))
        self.assertEqual((surface["base_colour"].image, surface["base_colour"].factor), ("picture", (0.5, 1.0, 1.0)))
        self.assertFalse(self.notes)

    def test_glass_of_principled_has_the_root_of_its_colour(self):
        """Cycles tints a body once, in and out together; Raywright at each boundary."""
        shader = node("BSDF_PRINCIPLED", Socket("Base Color", (0.25, 1.0, 0.81)), Socket("Transmission Weight", 1.0))
        np.testing.assert_allclose(self.reader.shader(linked("Surface", shader))["base_colour"], (0.5, 1, 0.9))

    def test_mix_with_transparent_is_opacity(self):
        clear = node("BSDF_TRANSPARENT", Socket("Color", (1.0, 1.0, 1.0)))
        matte = node("BSDF_DIFFUSE", Socket("Color", (0.5, 0.5, 0.5)), Socket("Roughness", 0.0))
        image = self.image()
        mix = node("MIX_SHADER", linked("Fac", image, 1), linked("Shader", clear), linked("Shader", matte))
        surface = self.reader.shader(linked("Surface", mix))
        self.assertEqual((surface["base_colour"], surface["opacity"].channel), ((0.5, 0.5, 0.5), "alpha"))

    def test_a_little_gloss_over_matte_is_a_varnish(self):
        matte = node("BSDF_DIFFUSE", Socket("Color", (0.5, 0.25, 0.5)), Socket("Roughness", 0.0))
        gloss = node("BSDF_GLOSSY", Socket("Color", (0.8, 0.8, 0.8)), Socket("Roughness", 0.2))
        mix = node("MIX_SHADER", Socket("Fac", 0.1), linked("Shader", matte), linked("Shader", gloss))
        surface = self.reader.shader(linked("Surface", mix))
        self.assertEqual((surface["base_colour"], surface["roughness"]), ((0.5, 0.25, 0.5), 0.2))
        self.assertAlmostEqual(0.04 * surface["specular_colour"][0], 0.08)
        self.assertFalse(self.notes)

    def test_nodes_between_a_picture_and_a_shader_change_its_pixels(self):
        invert = node("INVERT", Socket("Fac", 1.0), linked("Color", self.image(), kind="RGBA"))
        grey = node("RGBTOBW", linked("Color", invert))
        power = node("MATH", linked("Value", grey), Socket("Value", 2.0), Socket("Value", 0.5), operation="POWER")
        texture = self.reader.value(linked("Roughness", power))
        pixels = np.array([[[0.5, 1.0, 0.0]]])
        for _, function in texture.changes:
            pixels = function(pixels)
        np.testing.assert_allclose(pixels, np.full((1, 1, 3), (0.2126 * 0.5 + 0.0722) ** 2))
        self.assertFalse(self.notes)

    def test_hue_turns_and_keeps(self):
        pair = np.array([[1.0, 0.0, 0.0], [0.2, 0.5, 0.4]])
        np.testing.assert_allclose(colours.shifted_hue(pair, 0.5, 1, 1), pair, atol=1e-12)
        np.testing.assert_allclose(colours.shifted_hue(pair[:1], 0.5 + 1 / 3, 1, 0.5), [[0, 0.5, 0]], atol=1e-12)

    def test_unknown_nodes_are_noted(self):
        shader = node("BSDF_DIFFUSE", linked("Color", node("TEX_NOISE")), Socket("Roughness", 0.0))
        self.assertEqual(self.reader.shader(linked("Surface", shader))["base_colour"], (0.5, 0.5, 0.5))
        self.assertEqual(self.notes, {nodes.MEAN})

    def test_mapping_turns_and_scales(self):
        place = node("TEX_COORD", outputs=("UV",))
        mapping = node("MAPPING", linked("Vector", place), Socket("Location", (0.5, 0.0, 0.0)), Socket("Rotation", (0.0, 0.0, math.pi / 2)), Socket("Scale", (2.0, 3.0, 1.0)), vector_type="POINT")
        name, matrix = self.reader.coordinates(linked("Vector", mapping), ())
        self.assertEqual(name, "")
        np.testing.assert_allclose(np.array(matrix) @ [1, 0, 1], [0.5, 2], atol=1e-12)
        np.testing.assert_allclose(np.array(matrix) @ [0, 1, 1], [-2.5, 0], atol=1e-12)


class Archive(unittest.TestCase):
    def test_it_has_the_manifest_the_licences_and_every_source(self):
        with tempfile.TemporaryDirectory() as folder:
            path = f"{folder}/raywright.zip"
            subprocess.run([sys.executable, SOURCE.parent / "pack.py", path], check=True, capture_output=True)
            import zipfile

            names = set(zipfile.ZipFile(path).namelist())
        self.assertEqual(names, {p.name for p in SOURCE.glob("*.py")} | {"blender_manifest.toml", "LICENSE-MIT", "LICENSE-APACHE"})


if __name__ == "__main__":
    unittest.main()
