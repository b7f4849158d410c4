# SPDX-License-Identifier: MIT
"""python3 -m holdfast.evaluate STUDY [options]"""

import importlib
import sys

import holdfast

STUDIES = {
    "fit": "fits by the paper's terms, its authors' recipe and all terms",
    "handovers": "objects passed from hand to hand, and detection of hand-overs",
    "hold": "grasps simulated in MuJoCo, with gravity in six directions",
    "reach": "WANDR's protocol, its ablations and other methods",
    "naturalness": "sets of motions compared with captured motions",
    "synthesis": "IMoS's Table 2 with its ablations",
    "transfer": "clips transferred to robot hands",
    "markers": "marker recordings solved with all markers and with markers left out",
    "captures": "captured clips refined with their objects",
    "study": "a perceptual study: films in pairs, a page that records choices, their statistics",
}


def main(arguments):
    if not arguments or arguments[0] in ("-h", "--help"):
        print(__doc__ + "\nReproduces the published evaluations.\n\nStudies:")
        for name, text in STUDIES.items():
            print(f"  {name:<12} {text}")
        return 0 if arguments else 2
    name, *rest = arguments
    if name not in STUDIES:
        print(f"holdfast.evaluate: no study '{name}'. Choose one of: {', '.join(STUDIES)}",
              file=sys.stderr)
        return 2
    study = importlib.import_module(f"holdfast.evaluate.{name}")
    try:
        return study.main(rest)
    except holdfast.Error as error:
        print(f"holdfast.evaluate: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("holdfast.evaluate: interrupted; run the same command again to continue",
              file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
