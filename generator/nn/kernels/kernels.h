// SPDX-License-Identifier: MIT
#pragma once

/// The loops of a layer, compiled once for each instruction set: pointers to packed matrices and
/// columns come in; products, norms and activations come out.
///
/// From the inside out:
///   layer_arguments.h  arguments; LayerLoops of each set
///   residual_loops.h   norms, silu, leaky ReLU, sums
///   layer_loops.h      products, moments; private, per instruction set
#include "generator/nn/kernels/layer_arguments.h"
