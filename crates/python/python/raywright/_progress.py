"""`render(progress=True)`: the picture as it comes, with its error, in the cell of a notebook, or a line of text elsewhere."""

import sys
import time

# Samples of the looks before the picture, as shares of its own. Looks are renders of their own, and add 14 % to the time.
SHARES = 1 / 64, 1 / 8
# Seconds between two updates of the line.
INTERVAL = 0.2


def _looks(scene, flags):
    """Flags of each look. A picture of fixed samples, a quick one and one of a given time have none."""
    if flags.get("quick") or flags.get("budget") is not None:
        return []
    if flags.get("max_error") is not None:
        return [dict(flags, max_error=float(flags["max_error"]) / share**0.5) for share in SHARES]
    samples = int(flags.get("spp") or scene._samples or 0)
    counts = [int(samples * share) for share in SHARES]
    return [dict(flags, spp=count, denoise=bool(flags.get("denoise")) and count >= 8) for count in counts if count >= 2]


def _describe(picture):
    error = picture.error
    return picture.samples + (f", error {error.value:.3g} ({error.low:.3g} to {error.high:.3g})" if error else "")


class _Cell:
    """A line, and a picture below it, in the output of a notebook's cell."""

    def __init__(self, display):
        self._display, self._shown = display, {}

    def _show(self, name, content):
        if name in self._shown:
            self._shown[name].update(content, raw=True)
        else:
            self._shown[name] = self._display(content, raw=True, display_id=True)

    def line(self, text):
        self._show("line", {"text/plain": text})

    def picture(self, picture):
        self._show("picture", {"image/png": picture.png(), "text/plain": repr(picture)})

    def close(self):
        pass


class _Terminal:
    """A line on a stream. Only a terminal sees it change; elsewhere the last one is written."""

    def __init__(self, stream):
        self._stream, self._rewrites, self._text = stream, stream.isatty(), ""

    def line(self, text):
        if self._rewrites:
            self._stream.write("\r" + text.ljust(len(self._text)))
            self._stream.flush()
        self._text = text

    def picture(self, picture):
        pass

    def close(self):
        if self._text:
            self._stream.write("\n" if self._rewrites else self._text + "\n")
            self._stream.flush()


def _place():
    """The cell of the notebook that runs this, or standard error."""
    module = sys.modules.get("IPython")
    shell = module and module.get_ipython()
    if getattr(shell, "kernel", None) is None:
        return _Terminal(sys.stderr)
    return _Cell(module.display.display)


def render(scene, layers, **flags):
    """The picture of `scene.render(layers=layers, **flags)`, shown as it comes."""
    place, began, known, told = _place(), time.monotonic(), "", 0.0

    def tell(share, force=False):
        nonlocal told
        now = time.monotonic()
        if force or now - told >= INTERVAL:
            told = now
            place.line(f"{share:4.0%}, {now - began:.0f} s" + (f"; so far {known}" if known else ""))

    share = 0.0

    def follow(now):
        nonlocal share
        share = now
        tell(share)

    try:
        for look in _looks(scene, flags):
            picture = scene.render(layers=layers, progress=lambda _: tell(0.0), **look)
            known = _describe(picture)
            place.picture(picture)
            tell(0.0, force=True)
        picture = scene.render(layers=layers, progress=follow, **flags)
    except KeyboardInterrupt:
        place.line(f"stopped at {share:.0%} after {time.monotonic() - began:.1f} s" + (f"; shown: {known}" if known else ""))
        raise
    else:
        place.picture(picture)
        place.line(f"{_describe(picture)}, {time.monotonic() - began:.1f} s")
        return picture
    finally:
        place.close()
