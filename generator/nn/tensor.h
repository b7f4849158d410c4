// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace holdfast::nn {

inline constexpr const char* kNetworkRemedy = "Give a file of a network of this kind";

/// A named array of a weights file, C order.
struct Tensor {
  std::vector<std::size_t> shape;
  std::vector<float> values;
};
using TensorMap = std::map<std::string, Tensor, std::less<>>;

/// Matrix `name` of any size but zero. Throws Error (`where` names the file) when it is missing,
/// not a matrix, or holds values that are not finite.
Eigen::MatrixXf ReadMatrix(const TensorMap& tensors, const std::string& name,
                           const std::string& where);
/// The same of a given size.
Eigen::MatrixXf ReadMatrix(const TensorMap& tensors, const std::string& name,
                           const std::string& where, Eigen::Index rows, Eigen::Index cols);
/// Vector `name` of a given size.
Eigen::VectorXf ReadVector(const TensorMap& tensors, const std::string& name,
                           const std::string& where, Eigen::Index size);

/// The inverses of the above.
Tensor MatrixTensor(const Eigen::MatrixXf& matrix);
Tensor VectorTensor(const Eigen::VectorXf& vector);

}  // namespace holdfast::nn
