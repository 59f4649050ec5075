"""The program: where it is, its flags, its progress and its reports. Nothing here needs Blender."""

import importlib.util
import json
import os
import shutil
import sys


class MissingProgram(Exception):
    pass


def find(setting=""):
    """First words of a command that runs the program: by the setting, of the wheel, or on the path."""
    if setting:
        if os.path.isfile(setting) and os.access(setting, os.X_OK):
            return [setting]
        raise MissingProgram(f"{setting} is not a program: choose another in the preferences of the add-on")
    if importlib.util.find_spec("raywright._raywright" if importlib.util.find_spec("raywright") else "raywright"):
        return [sys.executable, "-m", "raywright"]
    found = shutil.which("raywright")
    if found:
        return [found]
    raise MissingProgram("Raywright is neither on the path nor installed as a wheel: name its file in the preferences of the add-on")


def render_flags(settings):
    """Flags of `render` for the settings of the panel."""
    flags = ["--integrator", "path", "--allow-outside", "--allow-empty", "--progress", "json"]
    flags += ["--spp", str(settings["samples"]), "--max-depth", str(settings["max_depth"]), "--seed", str(settings["seed"])]
    if settings["max_error"]:
        flags += ["--max-error", f"{settings['max_error']:.6g}"]
    if settings["denoise"]:
        flags += ["--denoise"]
    if settings["clamp"]:
        flags += ["--clamp", f"{settings['clamp']:.6g}"]
    if settings["threads"]:
        flags += ["--threads", str(settings["threads"])]
    if settings["layers"]:
        flags += ["--aov", ",".join(settings["layers"])]
    if settings["transparent"]:
        flags += ["--background", "transparent"]
    if settings["filter"]:
        flags += ["--rung", f"pixel-filter={settings['filter']}"]
    if settings["crop"]:
        flags += ["--crop", ",".join(map(str, settings["crop"]))]
    return flags


def error_text(error):
    """The error of a picture as one phrase, or nothing where it is not known."""
    root = (error or {}).get("root_relmse")
    if not root or root.get("value") is None:
        return ""
    if root.get("low") is None or root.get("high") is None:
        return f"error {root['value']:.3g}"
    return f"error {root['value']:.3g} ({root['low']:.3g} to {root['high']:.3g})"


def progress(line):
    """Share that is done and the text of the status line, from a line of `--progress json`; none of another line."""
    if not line.startswith("{"):
        return None
    state = json.loads(line)
    least, most = state["samples"]
    words = [f"{least} samples" if least == most else f"{least} to {most} samples"]
    share = 0.0
    if state["of"]:
        words[0] += f" of {state['of']}"
        share = least / state["of"]
    words.append(error_text(state["error"]))
    left = state["seconds_left"]
    if left is not None:
        share = max(share, state["seconds"] / max(state["seconds"] + left, 1e-9))
        words.append(f"{left:.0f} s left")
    return min(share, 1.0), ", ".join(word for word in words if word)


def picture_error(stats):
    """The error that a picture states, of the denoised one where it was denoised."""
    return error_text(stats.get("denoised") or stats.get("error"))


def left_out(report):
    """What a scene calls for and the picture can't show, from `explain --json` or `render --stats`, and its warnings."""
    lines = [f"{e['name']}: {e['because']}" for e in report.get("effects", ()) if e["status"] == "left-out"]
    told = (w for w in report.get("warnings", ()) if w.get("severity") != "harmless")
    return lines + ["; ".join(filter(None, (w["message"], w.get("remedy")))) for w in told]
