# SPDX-License-Identifier: MIT
"""Links that GitHub alone can follow: docs/README.md is the site's first page, and folders are on no
page, so that their names become text."""
from pathlib import Path

from docutils import nodes
from sphinx import addnodes
from sphinx.transforms import SphinxTransform


class Links(SphinxTransform):
    default_priority = 5

    def apply(self, **kwargs):
        root = Path(self.env.srcdir)
        for link in list(self.document.findall(addnodes.pending_xref)):
            if link.get("reftype") != "myst":
                continue
            target, hash_, anchor = link["reftarget"].partition("#")
            if not target:
                continue
            page = Path(self.env.doc2path(self.env.docname)).parent
            path = (page / target).resolve()
            if path == root / "docs/README.md":
                up = "../" * len(page.relative_to(root).parts)
                link["reftarget"] = f"{up}docs/index.md{hash_}{anchor}"
            elif path.is_dir():
                link.replace_self(nodes.inline("", "", *link.children))


def setup(app):
    app.add_transform(Links)
    return {"parallel_read_safe": True}
