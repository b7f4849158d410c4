# SPDX-License-Identifier: MIT
"""The published evaluations, run on the module: python3 -m holdfast.evaluate --help."""
