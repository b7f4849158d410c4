# SPDX-License-Identifier: MIT
"""Live reports: the commands are run when the site is built, and their pages are embedded.

    ```{holdfast-report} NAME
    holdfast fit demo_drink mug -o held
    holdfast report held -o page.html
    ```

shows the commands, and below them page.html, which the last one writes.
"""
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

from docutils import nodes
from sphinx.util.docutils import SphinxDirective


class HoldfastReport(SphinxDirective):
    required_arguments = 1
    has_content = True

    def run(self):
        app = self.env.app
        page = Path(app.outdir) / "gallery" / f"{self.arguments[0]}.html"
        page.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as folder:
            for line in self.content:
                program, *arguments = shlex.split(line)
                assert program == "holdfast", line
                done = subprocess.run([app.config.holdfast_program, *arguments, "--quiet"], cwd=folder, capture_output=True, text=True)
                if done.returncode != 0:
                    raise self.error(f"'{line}' ends with {done.returncode}: {done.stderr}")
            shutil.copy(Path(folder) / "page.html", page)
        up = "../" * self.env.docname.count("/")
        frame = (f'<iframe src="{up}gallery/{page.name}" loading="lazy" title="{self.arguments[0]}" '
                 'style="width:100%;height:36rem;border:1px solid #8884;border-radius:6px"></iframe>')
        commands = nodes.literal_block("\n".join(self.content), "\n".join(self.content))
        return [commands, nodes.raw("", frame, format="html")]


def setup(app):
    app.add_directive("holdfast-report", HoldfastReport)
    return {"parallel_read_safe": True}
