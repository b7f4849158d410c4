// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <variant>

#include "generator/nn/mlp_weights.h"
#include "generator/nn/residual_weights.h"
#include "generator/nn/tensor.h"

namespace holdfast::nn {

/// A network of either architecture, as a file holds it.
using AnyWeights = std::variant<MlpWeights, ResidualWeights>;

int InputSize(const AnyWeights& weights);
int OutputSize(const AnyWeights& weights);

/// Whether `name` is a tensor of a network called `prefix`, of either architecture.
bool IsTensorOf(const std::string& prefix, const std::string& name);

/// Reads what MlpFromTensors or ResidualFromTensors does: a chain of layers where there are tensors
/// `<prefix>.layers.*`, a residual network where there are any of its own. Throws Error as they do,
/// and for names of both or of neither.
AnyWeights AnyFromTensors(const TensorMap& tensors, const std::string& prefix,
                          const std::string& where);

/// The inverse of AnyFromTensors.
void AddTensors(const AnyWeights& weights, const std::string& prefix, TensorMap& tensors);

}  // namespace holdfast::nn
