# SPDX-License-Identifier: MIT
"""Training of the networks in PyTorch: python3 -m holdfast.train --help."""
