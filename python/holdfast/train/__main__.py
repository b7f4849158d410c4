# SPDX-License-Identifier: MIT
"""python3 -m holdfast.train wandr|imos|recognizer [options]"""

import importlib
import sys

import holdfast

NETWORKS = {
    "wandr": "the network of 'reach'",
    "imos": "the networks of 'synthesize'",
    "recognizer": "the action classifier that evaluates syntheses",
}


def main(arguments):
    if not arguments or arguments[0] in ("-h", "--help"):
        print(__doc__ + "\n\nTrains a network with PyTorch, on a GPU if available.\n\nNetworks:")
        for name, text in NETWORKS.items():
            print(f"  {name:<12} {text}")
        return 0 if arguments else 2
    name, *rest = arguments
    if name not in NETWORKS:
        print(f"holdfast.train: no network '{name}'. Choose one of: {', '.join(NETWORKS)}",
              file=sys.stderr)
        return 2
    try:
        return importlib.import_module(f"holdfast.train.{name}").main(rest)
    except ModuleNotFoundError as error:
        if error.name != "torch":
            raise
        print("holdfast.train: needs PyTorch. Install the package python3-torch (./setup train)",
              file=sys.stderr)
        return 1
    except holdfast.Error as error:
        print(f"holdfast.train: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
