"""The render engine: exports the scene, runs the program, and hands its picture to Blender."""

import json
import os
import queue
import shutil
import subprocess
import tempfile
import threading

import bpy
import numpy as np

from . import exr, program, scene_file
from .export import Export

# What the last export or render of each scene could not show, for the panel.
LEFT_OUT = {}
# The error that the last picture of each scene stated.
ERRORS = {}


def picture_region(render):
    """Size of the whole picture, and the rectangle (x, y from the top, width, height) that is rendered."""
    size = [max(1, round(side * render.resolution_percentage / 100 - 0.499999)) for side in (render.resolution_x, render.resolution_y)]
    if not render.use_border:
        return size, [0, 0, *size]
    left, right = (int(size[0] * edge) for edge in (render.border_min_x, render.border_max_x))
    bottom, top = (int(size[1] * edge) for edge in (render.border_min_y, render.border_max_y))
    return size, [left, size[1] - top, max(right - left, 1), max(top - bottom, 1)]


def layers_of(view_layer):
    layers = []
    if view_layer.use_pass_z:
        layers.append("depth")
    if view_layer.use_pass_normal:
        layers.append("normal")
    if view_layer.raywright.use_pass_albedo:
        layers.append("albedo")
    if view_layer.raywright.use_pass_error:
        layers.append("stderr")
    return layers


def write_scene(depsgraph, folder, progress=lambda: False):
    """Writes the scene's file into a folder; its path, the crop of the picture, and what can't be shown."""
    size, region = picture_region(depsgraph.scene_eval.render)
    export = Export(depsgraph, folder)
    crop = export.camera(size, region)
    export.world()
    export.instances(progress)
    path = os.path.join(folder, "blender.scene.json")
    with open(path, "w", encoding="utf-8") as file:
        file.write(scene_file.compact(scene_file.scene(export.description)))
    whole = export.description["camera"]["whole_size"]
    return path, None if crop == [0, 0, *whole] else crop, listed(export, depsgraph.scene_eval)


def listed(export, scene):
    lines = []
    for what, owners in sorted(export.left_out.items()):
        names = sorted(owners)
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        lines.append(f"{what} ({', '.join(names[:3])}{more})")
    if scene.render.use_motion_blur:
        lines.append("motion blur")
    return lines


def settings_of(depsgraph, crop):
    scene, own = depsgraph.scene_eval, depsgraph.scene_eval.raywright
    return {
        "samples": own.samples,
        "max_error": own.max_error if own.use_max_error else 0,
        "denoise": own.denoise,
        "max_depth": own.max_depth,
        "clamp": own.clamp,
        "seed": own.seed,
        "threads": scene.render.threads if scene.render.threads_mode == "FIXED" else 0,
        "layers": layers_of(depsgraph.view_layer_eval),
        "transparent": scene.render.film_transparent,
        "filter": own.filter if own.filter != "box" else "",
        "crop": crop,
    }


def preferences():
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences.program if addon else ""


class RaywrightEngine(bpy.types.RenderEngine):
    """Path tracing by the program `raywright`."""

    bl_idname = "RAYWRIGHT"
    bl_label = "Raywright"
    bl_use_preview = False
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True
    bl_use_postprocess = True

    def update_render_passes(self, scene=None, renderlayer=None):
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        if renderlayer.use_pass_z:
            self.register_pass(scene, renderlayer, "Depth", 1, "Z", "VALUE")
        if renderlayer.use_pass_normal:
            self.register_pass(scene, renderlayer, "Normal", 3, "XYZ", "VECTOR")
        if renderlayer.raywright.use_pass_albedo:
            self.register_pass(scene, renderlayer, "Albedo", 3, "RGB", "COLOR")
        if renderlayer.raywright.use_pass_error:
            self.register_pass(scene, renderlayer, "Error", 3, "RGB", "COLOR")

    def render(self, depsgraph):
        if depsgraph.scene_eval.camera is None:
            self.report({"ERROR"}, "The scene has no camera: add one")
            return
        folder = tempfile.mkdtemp(prefix="raywright-")
        try:
            self.render_in(depsgraph, folder)
        except program.MissingProgram as missing:
            self.report({"ERROR"}, str(missing))
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def render_in(self, depsgraph, folder):
        command = program.find(preferences())
        self.update_stats("", "Reading the scene")
        path, crop, left_out = write_scene(depsgraph, folder, self.test_break)
        if self.test_break():
            return
        picture, stats = os.path.join(folder, "picture.exr"), os.path.join(folder, "stats.json")
        flags = program.render_flags(settings_of(depsgraph, crop))
        code, messages = self.run([*command, "render", path, *flags, "-o", picture, "--stats", stats])
        report = {}
        if os.path.exists(stats):
            with open(stats, encoding="utf-8") as file:
                report = json.load(file)
        LEFT_OUT[depsgraph.scene.name] = left_out + program.left_out(report)
        partial = picture.replace(".exr", ".partial.exr")
        shown = next((p for p in (picture, partial) if os.path.exists(p)), None)
        if shown is None:
            if not self.test_break():
                self.report({"ERROR"}, f"Raywright ended with exit code {code}: {' '.join(messages[-8:]) or 'no message'}")
            return
        self.show(depsgraph, exr.read(shown), program.picture_error(report))

    def run(self, command):
        """Runs the program, shows its progress, and ends it when the render is stopped; exit code and messages."""
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, encoding="utf-8")
        lines = queue.Queue()
        threading.Thread(target=lambda: [lines.put(line) for line in process.stderr], daemon=True).start()
        messages, stopped = [], False
        while process.poll() is None or not lines.empty():
            if self.test_break() and not stopped:
                # The program then writes the samples that it has.
                process.terminate()
                stopped = True
            try:
                line = lines.get(timeout=0.1).strip()
            except queue.Empty:
                continue
            state = program.progress(line)
            if state:
                self.update_progress(state[0])
                self.update_stats("", state[1])
            elif line:
                messages.append(line)
        return process.returncode, messages

    def show(self, depsgraph, channels, error):
        height, width = channels["R"].shape
        result = self.begin_result(0, 0, width, height, layer=depsgraph.view_layer_eval.name)
        layer = result.layers[0]
        for name, pixels in self.passes(depsgraph, channels).items():
            if name not in layer.passes:
                self.add_pass(name, pixels.shape[2], "RGB", layer=layer.name)
            rect = layer.passes[name].rect
            rect.foreach_set(np.ascontiguousarray(pixels[::-1], np.float32).ravel())
        self.end_result(result)
        if error:
            ERRORS[depsgraph.scene.name] = error
            self.update_stats("", error)
            self.get_result().stamp_data_add_field("Raywright", error)

    def passes(self, depsgraph, channels):
        """Blender's passes, rows from the top, from the channels of a picture."""
        stack = lambda names: np.stack([channels[name] for name in names], -1)
        denoised = "denoised." if "denoised.R" in channels else ""
        alpha = channels.get("A", np.ones_like(channels["R"]))
        passes = {"Combined": np.concatenate([stack([denoised + c for c in "RGB"]), alpha[..., None]], -1)}
        # The picture of a render that was stopped may lack layers.
        layers = [layer for layer in layers_of(depsgraph.view_layer_eval) if any(name.split(".")[0] == layer for name in channels)]
        if "depth" in layers:
            passes["Depth"] = plane_depth(depsgraph, next(pixels for name, pixels in channels.items() if name.split(".")[0] == "depth"))
        if "normal" in layers:
            x, y, z = (channels[f"normal.{c}"] for c in "XYZ")
            passes["Normal"] = np.stack([x, -z, y], -1)
        if "albedo" in layers:
            passes["Albedo"] = stack([f"albedo.{c}" for c in "RGB"])
        if "stderr" in layers:
            prefix = "denoised.stderr." if "denoised.stderr.R" in channels else "stderr."
            passes["Error"] = stack([prefix + c for c in "RGB"])
        return passes


def plane_depth(depsgraph, along):
    """Blender's depth is measured along the camera's axis, Raywright's along the ray; beyond everything Blender has 1e10."""
    size, (left, top, width, height) = picture_region(depsgraph.scene_eval.render)
    camera = depsgraph.scene_eval.camera
    depth = along.copy()
    if camera.data.type != "ORTHO":
        matrix = np.array(camera.calc_matrix_camera(depsgraph, x=size[0], y=size[1]))
        x = (2 * (left + np.arange(width) + 0.5) / size[0] - 1 + matrix[0, 2]) / matrix[0, 0]
        y = (1 - 2 * (top + np.arange(height) + 0.5) / size[1] + matrix[1, 2]) / matrix[1, 1]
        depth = depth / np.sqrt(1 + x[None, :] ** 2 + y[:, None] ** 2)
    depth[~np.isfinite(along) | (along <= 0)] = 1e10
    return np.minimum(depth, 1e10)[..., None].astype(np.float32)


def explain(depsgraph):
    """What the program can't show of a scene, without a render."""
    folder = tempfile.mkdtemp(prefix="raywright-")
    try:
        path, _, left_out = write_scene(depsgraph, folder)
        command = [*program.find(preferences()), "explain", path, "--json", "--allow-outside"]
        done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8")
        if done.returncode:
            return left_out + [done.stderr.strip()]
        return left_out + program.left_out(json.loads(done.stdout))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
