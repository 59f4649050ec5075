"""Pictures: arrays, files, words, errors, and what goes on meanwhile."""

import ast
import doctest
import hashlib
import io
import os
import pathlib
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np
import raywright as rw
from exr_file import channels
from raywright import _raywright

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
SMALL = {"size": (40, 24), "spp": 16}


def program(*words):
    """Runs the program that the wheel brings."""
    path = pathlib.Path(sys.executable).parent / "raywright"
    return subprocess.run([str(path), *words], check=True, capture_output=True, text=True)


def preset(name, **flags):
    """One of the program's scenes; a build may come without it, since they are files that can be deleted."""
    try:
        return rw.load(f"preset:{name}", **flags)
    except rw.UsageError as error:
        raise unittest.SkipTest(str(error)) from None


class Files(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def at(self, name):
        return os.path.join(self.folder.name, name)


class Arrays(Files):
    def test_bits_are_those_of_the_program(self):
        """Protects: arrays have, to the bit, what the program writes for the same words, in colours, layers and denoised ones."""
        layers = ["albedo", "normal", "depth", "object", "stderr"]
        picture = preset("cornell").render(layers=layers, denoise=True, seed=3, **SMALL)
        words = ["--size=40x24", "--spp=16", "--denoise", "--seed=3", "--aov=" + ",".join(layers)]
        printed = program("render", "preset:cornell", *words, "--hash", "-o", self.at("a.exr")).stdout
        stored = channels(self.at("a.exr"))
        for i, channel in enumerate("RGB"):
            np.testing.assert_array_equal(picture.sampled[..., i], stored[channel])
            np.testing.assert_array_equal(picture.rgb[..., i], stored[f"denoised.{channel}"])
        seen = set("RGB")
        for name, layer in picture.layers.items():
            self.assertEqual((layer.shape[:2], layer.dtype), ((24, 40), np.float32))
            order = {3: "XYZ" if f"{name}.X" in stored else "RGB"}.get(layer.shape[2])
            own = [f"{name}.{c}" for c in order] if order else [n for n in stored if n.rpartition(".")[0] == name]
            for i, channel in enumerate(own):
                np.testing.assert_array_equal(layer[..., i], stored[channel])
            seen.update(own)
        self.assertEqual(seen, set(stored))
        numbers = struct.pack("<II", 40, 24) + picture.rgb.tobytes()
        self.assertEqual(printed.split()[0], hashlib.sha256(numbers).hexdigest())
        self.assertEqual(picture.hash, printed.split()[0])

    def test_files_are_those_of_the_program(self):
        """Protects: what is saved has the pixels that the program saves, whatever the format, and a name that ends in none is refused."""
        picture = preset("cornell").render(layers=None, **SMALL)
        for name in ["a.exr", "a.png", "a.jpg", "a.webp"]:
            picture.save(self.at(name))
            program("render", "preset:cornell", "--size=40x24", "--spp=16", "-o", self.at("b" + name))
            self.assertTrue(rw.compare(self.at(name), self.at("b" + name))["identical"], name)
        self.assertTrue(rw.compare(picture, self.at("a.exr"))["identical"])
        self.assertEqual(picture.png(), pathlib.Path(self.at("a.png")).read_bytes())
        self.assertEqual(picture.png(), picture._repr_png_())
        with self.assertRaisesRegex(rw.UsageError, "unknown picture format `.tiff`"):
            picture.save(self.at("a.tiff"))

    def test_arrays_are_views_that_outlive_their_picture(self):
        """Protects: arrays are no copies, can't be written to, and keep the memory that they show."""
        picture = preset("cornell").render(background="transparent", **SMALL)
        one, other, alpha = picture.rgb, picture.rgb, picture.alpha
        self.assertEqual(one.ctypes.data, other.ctypes.data)
        self.assertEqual(picture.layers["depth"].ctypes.data, picture.layers["depth"].ctypes.data)
        self.assertEqual((one.shape, alpha.shape, picture.layers["depth"].shape), ((24, 40, 3), (24, 40, 1), (24, 40, 1)))
        with self.assertRaises(ValueError):
            one[0, 0, 0] = 1.0
        before = one.copy()
        del picture, other
        junk = [np.random.rand(24, 40, 3) for _ in range(50)]
        self.assertEqual(len(junk), 50)
        np.testing.assert_array_equal(one, before)

    def test_errors_are_told(self):
        """Protects: a picture says how wrong it is, and whether what was asked for is reached."""
        scene = preset("cornell")
        error = scene.render(max_error=0.2, size=(64, 64)).error
        self.assertTrue(0 < error.low <= error.value <= error.high <= 0.2 and error.converged, error)
        self.assertIsNone(scene.render(**SMALL).error.converged)
        self.assertFalse(scene.render(max_error=0.001, **SMALL).error.converged)
        self.assertIsNone(preset("whitted").render(size=(16, 9)).error)


class Sources(Files):
    def test_every_source_gives_the_same_picture(self):
        """Protects: a path, bytes, a file object, text and an object that exports itself are all read."""
        path = pathlib.Path(self.at("a.obj"))
        path.write_bytes(TRIANGLE)

        class Model:
            def export(self, file_type):
                return {"glb": TRIANGLE}[file_type]

        class Text:
            def read(self):
                return TRIANGLE.decode()

        with open(path, "rb") as file:
            scenes = [rw.load(path), rw.load(str(path)), rw.load(TRIANGLE), rw.load(memoryview(TRIANGLE)), rw.load(file)]
        scenes += [rw.load(io.BytesIO(TRIANGLE)), rw.load(Text()), rw.load(TRIANGLE, format="obj"), rw.load(path, format="obj")]
        hashes = {scene.render(size=(8, 8), spp=4).hash for scene in scenes}
        self.assertEqual(len(hashes), 1)
        # What exports itself is told to be GLB, and this is not.
        with self.assertRaises(rw.InputError):
            rw.load(Model())

    def test_arrays_of_vertices_and_faces_are_read(self):
        """Protects: a mesh of arrays is where its vertices say, and wrong arrays are refused with the reason."""
        vertices, faces = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.array([[0, 1, 2], [0, 2, 3]])
        picture = rw.load(vertices, faces).render(size=(16, 16), spp=4, eye=(0, 0, 5), target=(0, 0, 0), fov=20)
        self.assertAlmostEqual(float(picture.layers["depth"][8, 8, 0]), 5, places=2)
        with self.assertRaisesRegex(rw.InputError, "from 0 to 3"):
            rw.load(vertices, [[0, 1, 4]])
        with self.assertRaisesRegex(rw.UsageError, "three coordinates"):
            rw.load([[0, 0]], faces)

    def test_the_viewer_is_shown_in_a_cell(self):
        """Protects: the viewer starts, its page is in the cell's text and is served, it ends, and its failure is an exception."""
        import urllib.request

        with rw.show("preset:cornell", size=(32, 32)) as viewer:
            self.assertIn(viewer.url, viewer._repr_html_())
            with urllib.request.urlopen(viewer.url, timeout=30) as page:
                self.assertEqual(page.status, 200)
        self.assertIsNotNone(viewer._process.returncode)
        with self.assertRaises(rw.Error):
            rw.show("nowhere.glb")

    def test_meshes_of_trimesh_are_read(self):
        """Protects: a mesh of trimesh is a scene."""
        try:
            import trimesh
        except ImportError:
            self.skipTest("trimesh is not installed")
        picture = rw.load(trimesh.creation.icosphere()).render(size=(16, 16), spp=4)
        self.assertTrue(np.isfinite(picture.layers["depth"][8, 8, 0]))

    def test_a_scene_is_shown_at_moments(self):
        """Protects: time is a keyword of each picture, and what loading was told holds for all of them."""
        scene = preset("pendulum", at=0.5)
        pictures = [scene.render(size=(32, 18)), scene.render(size=(32, 18), at=0.0), scene.render(size=(32, 18), at=0.5)]
        self.assertEqual(pictures[0].hash, pictures[2].hash)
        self.assertNotEqual(pictures[0].hash, pictures[1].hash)


class Words(Files):
    def test_errors_are_typed_and_have_the_message_of_the_program(self):
        """Protects: each kind of failure is a class of its own, of the builtin kind that callers catch, with the program's words."""
        scene = preset("cornell")
        cases = [
            (rw.UsageError, ValueError, "similar argument exists: '--size'", lambda: scene.render(sizee=(1, 1))),
            (rw.UsageError, ValueError, "expected front, back", lambda: scene.render(view="sideways")),
            (rw.UsageError, ValueError, "did you mean `preset:cornell`", lambda: rw.load("preset:cornel")),
            (rw.UsageError, ValueError, "cannot be used here", lambda: scene.render(output="a.png")),
            (rw.InputError, ValueError, "the format of the file is unknown", lambda: rw.load(b"\0\1junk")),
            (rw.FileError, OSError, "no such file or folder", lambda: rw.load(self.at("none.glb"))),
            (rw.FileError, OSError, "cannot read", lambda: rw.compare("none.exr", "none.exr")),
            (rw.LimitError, MemoryError, "the limit is 1000 bytes", lambda: scene.render(max_memory=1000)),
            (rw.InputError, ValueError, r"triangles\[0\] is 0, 1, 7", lambda: rw.Bvh(np.zeros((3, 3)), [[0, 1, 7]])),
            (rw.InputError, ValueError, r"shape \[3\]", lambda: rw.Bvh(np.zeros(3), [[0, 1, 2]])),
        ]
        for kind, builtin, message, call in cases:
            with self.subTest(message), self.assertRaisesRegex(kind, message) as raised:
                call()
            self.assertIsInstance(raised.exception, builtin)
            self.assertIsInstance(raised.exception, rw.Error)
            self.assertFalse(str(raised.exception).startswith("error: "))

    def test_reports_are_those_of_the_program(self):
        """Protects: reports are plain data, with the entries that the program prints as JSON."""
        import json

        scene = preset("cornell")
        self.assertEqual(scene.explain(), json.loads(program("explain", "preset:cornell", "--json").stdout))
        report = rw.load(TRIANGLE).accuracy(budget=10, size=(8, 8))
        self.assertIn("--size=8x8", report["command"])
        self.assertTrue(report["ladders"] and report["settings"])
        pair = [scene.render(seed=seed, layers="stderr", **SMALL) for seed in (1, 2)]
        compared = rw.compare(*pair, noise=True, max_rmse=0)
        self.assertEqual((compared["identical"], compared["noise"]["beyond"]), (False, 0))
        self.assertEqual(len(compared["beyond_thresholds"]), 1)

    def test_stubs_name_what_there_is(self):
        """Protects: type stubs and module have the same names."""
        folder = pathlib.Path(rw.__file__).parent
        self.assertTrue((folder / "py.typed").exists())
        stubs = ast.parse((folder / "_raywright.pyi").read_text())
        for node in stubs.body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                own = getattr(_raywright, node.name)
                self.assertTrue(own.__doc__ or node.name == "main", node.name)
                for member in getattr(node, "body", []):
                    name = getattr(member, "name", None) or getattr(getattr(member, "target", None), "id", None)
                    self.assertTrue(name is None or hasattr(own, name), f"{node.name}.{name}")

    def test_examples_print_what_they_say(self):
        """Protects: the examples of the module and of its page are right."""
        preset("cornell")
        self.assertEqual(doctest.testmod(rw, verbose=False).failed, 0)
        page = pathlib.Path(__file__).parents[3] / "docs/python.md"
        here = os.getcwd()
        os.chdir(self.folder.name)
        try:
            result = doctest.testfile(str(page), module_relative=False, optionflags=doctest.ELLIPSIS, verbose=False)
        finally:
            os.chdir(here)
        self.assertEqual(result.failed, 0)
        self.assertGreater(result.attempted, 10)


class Meanwhile(unittest.TestCase):
    def test_interrupts_end_a_render(self):
        """Protects: Ctrl-C ends a render that would take hours, and the module goes on working."""
        sent = []

        def interrupt():
            time.sleep(0.5)
            sent.append(time.perf_counter())
            os.kill(os.getpid(), signal.SIGINT)

        # What is started in the background by a shell ignores Ctrl-C.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        self.addCleanup(signal.signal, signal.SIGINT, before)
        scene = preset("cornell")
        thread = threading.Thread(target=interrupt)
        thread.start()
        with self.assertRaises(KeyboardInterrupt):
            scene.render(size=(3840, 2160), spp=65536)
        print(f"\ninterrupted after {1e3 * (time.perf_counter() - sent[0]):.0f} ms")
        thread.join()
        self.assertIsNotNone(scene.render(**SMALL))

    def test_progress_is_told_and_others_go_on(self):
        """Protects: progress rises to 1, the interpreter is free meanwhile, and what a callable raises ends the render."""
        shares, counted, done = [], [0], threading.Event()

        def count():
            while not done.is_set():
                counted[0] += 1
                time.sleep(0.001)

        thread = threading.Thread(target=count)
        thread.start()
        preset("cornell").render(size=(160, 120), spp=64, progress=shares.append)
        done.set()
        thread.join()
        self.assertEqual((shares, shares[-1]), (sorted(shares), 1.0))
        self.assertGreater(len(shares), 2)
        self.assertGreater(counted[0], 10)

        def refuse(share):
            raise RuntimeError("enough")

        with self.assertRaisesRegex(RuntimeError, "enough"):
            preset("cornell").render(size=(3840, 2160), spp=65536, progress=refuse)

    def test_the_program_comes_along(self):
        """Protects: the wheel brings the program, with its exit codes."""
        self.assertEqual(program("--version").stdout.split(), ["raywright", rw.__version__])
        path = pathlib.Path(sys.executable).parent / "raywright"
        self.assertEqual(subprocess.run([str(path), "info", "none.glb"], capture_output=True).returncode, 4)

    def test_first_picture(self):
        """Protects: nothing; prints what importing and a thumbnail take."""
        code = "import time; t = time.perf_counter(); import raywright as rw; i = time.perf_counter() - t; "
        code += "import sys; "
        code += "rw.load(sys.argv[1]).render(size=(256, 256), quick=True).png(); print(i, time.perf_counter() - t)"
        model = pathlib.Path(__file__).parents[3] / "scenes/models/armillary.glb"
        took = subprocess.run([sys.executable, "-c", code, str(model)], check=True, capture_output=True, text=True).stdout.split()
        print(f"\nimport {1e3 * float(took[0]):.0f} ms; with a thumbnail of 256x256 {1e3 * float(took[1]):.0f} ms")


if __name__ == "__main__":
    unittest.main()
