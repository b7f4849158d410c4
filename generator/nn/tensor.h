// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace holdfast::nn {

inline constexpr const char* kNetworkRemedy = "Give a file of a network of this kind";

/// A named array of a weights file, in C order.
struct Tensor {
  std::vector<std::size_t> shape;
  std::vector<float> values;
};
using TensorMap = std::map<std::string, Tensor, std::less<>>;

/// Reads the matrix `name` of any nonzero size. Throws Error (`where` names the file) if it is
/// missing, not a matrix, or has non-finite values.
Eigen::MatrixXf ReadMatrix(const TensorMap& tensors, const std::string& name,
                           const std::string& where);
/// Same, for a matrix of a given size.
Eigen::MatrixXf ReadMatrix(const TensorMap& tensors, const std::string& name,
                           const std::string& where, Eigen::Index rows, Eigen::Index cols);
/// Same, for a vector of a given size.
Eigen::VectorXf ReadVector(const TensorMap& tensors, const std::string& name,
                           const std::string& where, Eigen::Index size);

/// Inverses of the above.
Tensor MatrixTensor(const Eigen::MatrixXf& matrix);
Tensor VectorTensor(const Eigen::VectorXf& vector);

}  // namespace holdfast::nn
