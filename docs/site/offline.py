# SPDX-License-Identifier: MIT
"""The site works from a folder, without a server or a network."""
import re
from pathlib import Path

from sphinx.util import logging

log = logging.getLogger(__name__)
LOADS = {
    ".html": re.compile(r"<(?:script|img|iframe|link)\b[^>]*\b(?:src|href)=\"(?:https?:|/)[^\"]*", re.I),
    ".css": re.compile(r"(?:@import |url\()\s*[\"']?(?:https?:|/)[^\"')]*"),
    ".js": re.compile(r"^import .*", re.M),
}


def bundle_theme(static):
    """Debian's furo imports a style sheet and a script from a server's folders, and has lost what
    makes it dark where the browser is."""
    style, script = static / "styles/furo.css", static / "scripts/furo.js"
    text = re.sub(
        r"@import url\((/javascript/[^)]*)\);",
        lambda found: Path("/usr/share" + found[1]).read_text(),
        style.read_text(),
    )
    dark = re.search(r'body\[data-theme="?dark"?\]\s*\{([^}]*)\}', text)
    if dark and "prefers-color-scheme" not in text:
        text += (
            "@media not print { @media (prefers-color-scheme: dark) {"
            f' body:not([data-theme="light"]) {{{dark[1]}}} }} }}\n'
        )
    style.write_text(text)
    script.write_text(
        re.sub(
            r'^import Gumshoe from "\./(.*)";',
            lambda found: (static / "scripts" / found[1]).read_text(),
            script.read_text(),
        )
    )


def finish(app, exception):
    if exception or app.builder.format != "html":
        return
    bundle_theme(Path(app.outdir) / "_static")
    for path in Path(app.outdir).rglob("*"):
        for found in LOADS[path.suffix].findall(path.read_text()) if path.suffix in LOADS else ():
            log.warning("%s needs what is outside the site: %s", path, found)


def setup(app):
    app.connect("build-finished", finish)
    return {"parallel_read_safe": True}
