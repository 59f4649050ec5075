"""`render(progress=True)` in a notebook, at a kernel that is interrupted, and as text."""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

import raywright as rw

try:
    import ipykernel  # noqa: F401
    from jupyter_client.manager import start_new_kernel
except ImportError:
    start_new_kernel = None

NOTEBOOK = pathlib.Path(__file__).parents[3] / "docs/notebook.ipynb"
ERROR = r"error [0-9.e-]+ \([0-9.e-]+ to [0-9.e-]+\)"


@unittest.skipUnless(start_new_kernel, "ipykernel and jupyter_client are not installed")
class Notebook(unittest.TestCase):
    def test_the_notebook_of_the_documentation_runs(self):
        """Protects: `jupyter nbconvert --execute` runs the notebook; its first picture is shown with its error while it is made."""
        command = [sys.executable, "-m", "nbconvert", "--execute", "--to", "notebook", "--stdout", str(NOTEBOOK)]
        run = subprocess.run(command, capture_output=True, text=True)
        if "No module named" in run.stderr:
            self.skipTest("nbconvert is not installed")
        self.assertEqual(run.returncode, 0, run.stderr[-2000:])
        cells = [cell for cell in json.loads(run.stdout)["cells"] if cell["cell_type"] == "code"]
        line, picture = cells[0]["outputs"]
        self.assertRegex("".join(line["data"]["text/plain"]), ERROR + r", \d")
        self.assertIn("image/png", picture["data"])
        self.assertEqual(sum("image/png" in out["data"] for cell in cells for out in cell["outputs"]), 3)
        self.assertTrue(all(not cell["outputs"] for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == "code"))

    def test_looks_come_before_the_picture_and_an_interrupt_ends_it(self):
        """Protects: the picture appears before it is finished and then changes; the kernel's interrupt ends a render, the line says so, and the
        kernel goes on."""
        manager, client = start_new_kernel(kernel_name="python3")
        self.addCleanup(manager.shutdown_kernel, now=True)
        self.addCleanup(client.stop_channels)
        shown, lines = [], []

        def follow(message):
            content = message["content"]
            if message["msg_type"] in ("display_data", "update_display_data"):
                data = content["data"]
                (shown if "image/png" in data else lines).append(data.get("image/png") or data["text/plain"])
                if endless and len(shown) == first + 1:
                    manager.interrupt_kernel()

        endless, first = False, 0
        code = "import raywright as rw; scene = rw.load('preset:cornell'); p = scene.render(size=(32, 32), spp=256, progress=True)"
        reply = client.execute_interactive(code, timeout=300, output_hook=follow)
        self.assertEqual(reply["content"]["status"], "ok", reply["content"])
        self.assertEqual(len(shown), len(set(shown)))
        self.assertGreaterEqual(len(shown), 3)
        self.assertRegex(lines[-1], "^256 samples, " + ERROR)
        endless, first, began = True, len(shown), time.monotonic()
        reply = client.execute_interactive("scene.render(size=(16, 16), spp=65536, progress=True)", timeout=300, output_hook=follow)
        self.assertEqual((reply["content"]["status"], reply["content"].get("ename")), ("error", "KeyboardInterrupt"))
        self.assertRegex(lines[-1], r"^stopped at \d+%.*" + ERROR)
        reply = client.execute_interactive("assert p.size == (32, 32)", timeout=60)
        self.assertEqual(reply["content"]["status"], "ok")


class Text(unittest.TestCase):
    def test_a_line_is_written_and_the_picture_is_the_same(self):
        """Protects: without a notebook the line has samples and error; the picture is that without progress, to the bit, for samples, a
        requested error and denoising; False is no progress; a failure is the program's."""
        code = "import sys, raywright as rw; s = rw.load(sys.argv[1]); "
        code += "print([s.render(size=(48, 32), progress=shown, **eval(sys.argv[2])).hash for shown in (True, None, False)])"
        with tempfile.NamedTemporaryFile(suffix=".obj") as model:
            model.write(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
            model.flush()
            for flags in ("dict(spp=64)", "dict(max_error=.05)", "dict(spp=16, denoise=True)", "dict(quick=True)", "dict()"):
                run = subprocess.run([sys.executable, "-c", code, model.name, flags], capture_output=True, text=True)
                self.assertEqual(run.returncode, 0, run.stderr)
                self.assertEqual(len(set(re.findall(r"'(\w+)'", run.stdout))), 1, (flags, run.stdout))
                self.assertRegex(run.stderr, r"^[0-9]+ .*samples, " + ERROR + r", [0-9.]+ s\n$", flags)
            with self.assertRaisesRegex(rw.UsageError, "sideways"):
                rw.load(model.name).render(view="sideways", progress=True)


if __name__ == "__main__":
    unittest.main()
