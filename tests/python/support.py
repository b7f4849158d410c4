# SPDX-License-Identifier: MIT
import json

import pytest


def refused(error, words, call, *arguments, **options):
    """The call raises `error` with a text that matches `words`."""
    with pytest.raises(error, match=words):
        call(*arguments, **options)


def results(folder):
    return json.loads((folder / "evaluation.json").read_text())
