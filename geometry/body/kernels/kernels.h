// SPDX-License-Identifier: MIT
#pragma once

/// The body model's loops over many frames, compiled once for each instruction set: pointers to a
/// person's blend shapes and weights and to joint transforms come in; vertices, and sums of
/// derivatives, come out.
///
/// From the inside out:
///   skinning_arguments.h  arguments; PoseTile, AdjointTile of each set
///   skinning_loop.h       blend shapes, skinning and their adjoints; private, per instruction set
#include "geometry/body/kernels/skinning_arguments.h"
