# SPDX-License-Identifier: MIT
"""Equations as MathML, which browsers draw by themselves: KaTeX converts them when the site is built."""
import json
import os
import subprocess

from docutils.nodes import SkipNode
from sphinx.errors import ExtensionError

CONVERT = """
const { text, display } = JSON.parse(require('fs').readFileSync(0));
console.log(require('katex').renderToString(text, { displayMode: display, output: 'mathml', strict: 'error' }));
"""


def mathml(text, display):
    done = subprocess.run(
        ["node", "-e", CONVERT],
        input=json.dumps({"text": text, "display": display}),
        env=os.environ | {"NODE_PATH": "/usr/share/nodejs"},
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise ExtensionError(f"equation {text!r}: {done.stderr.strip()}")
    return done.stdout.strip()


def inline(self, node):
    self.body.append(mathml(node.astext(), False))
    raise SkipNode


def block(self, node):
    self.body.append(f'<div class="equation">{mathml(node.astext(), True)}</div>')
    raise SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(block, None))
    return {"parallel_read_safe": True}
