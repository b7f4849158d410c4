// SPDX-License-Identifier: MIT
#pragma once

/// Neural networks without autograd: weights by name come in, and columns of inputs; outputs and
/// gradients come out, with the best instruction set.
///
/// From the inside out:
///   aligned_array.h        memory on cache lines
///   random_stream.h        random numbers by counting
///   tensor.h               named arrays of weights files
///   mlp_weights.h          a chain of layers as stored
///   residual_weights.h     a residual network as stored
///   any_weights.h          a network of either architecture
///   packed_matrix.h        a constant matrix, packed for products
///   column_network.h       ColumnNetwork, Tape; MakeNetwork
///   mlp.h, residual_mlp.h  its two architectures
#include "generator/nn/any_weights.h"
#include "generator/nn/column_network.h"
#include "generator/nn/random_stream.h"
#include "generator/nn/tensor.h"
