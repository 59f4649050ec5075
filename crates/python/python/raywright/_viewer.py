"""The viewer beside Python: a process that shows a scene on a local page, which a notebook puts into the cell."""

import atexit
import subprocess
import sys
import tempfile

from ._errors import Error


class Viewer:
    """A running viewer. The last line of a notebook's cell shows its page; elsewhere, open `url` in a browser."""

    def __init__(self, process, url):
        self._process = process
        self.url = url
        atexit.register(self.close)

    def close(self):
        """Ends the viewer."""
        atexit.unregister(self.close)
        self._process.terminate()
        self._process.communicate()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __repr__(self):
        return f"<raywright.Viewer {self.url}>"

    def _repr_html_(self):
        return f'<iframe src="{self.url}" width="100%" height="640" style="border:0"></iframe>'


def show(source, **flags):
    """Starts the viewer of a path or "preset:NAME", and returns it. Keywords are the flags of `raywright view`.

    The page is served by this machine alone, until `close()` or the end of this process.
    """
    words = []
    for name, value in flags.items():
        flag = "--" + name.replace("_", "-")
        if value is True:
            words.append(flag)
        elif value is not False and value is not None:
            words.append(f"{flag}={'x'.join(map(str, value)) if name == 'size' else value}")
    command = [sys.executable, "-m", "raywright", "view", str(source), "--no-open", *words]
    with tempfile.TemporaryFile("w+") as messages:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=messages, text=True)
        url = process.stdout.readline().strip()
        if not url.startswith("http"):
            process.communicate()
            messages.seek(0)
            raise Error(messages.read().strip() or "the viewer did not start")
    return Viewer(process, url)
