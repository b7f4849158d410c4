// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "generator/nn/tensor.h"

namespace holdfast::imos {

/// Tensors of the network that recognizes actions, from PyTorch's initial distribution, with the
/// names and shapes of the authors' PyTorch module (Ghosh et al. 2023): lstm2_2 of (x, y) and
/// lstm2_3 of (x, z) of 22 joints (`weight_ih_l0` 512 x 44 and so on, gates i, f, g, o), conv1_2_2
/// and conv1_2_3 (1 x 1 x 3), hidden2label (29 x 128).
nn::TensorMap RandomRecognizer(std::uint64_t seed);

}  // namespace holdfast::imos
