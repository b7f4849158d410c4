// SPDX-License-Identifier: MIT
#include "generator/nn/tensor.h"

#include <cmath>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::nn {
namespace {

using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

const Tensor& Find(const TensorMap& tensors, const std::string& name, const std::string& where,
                   std::size_t dimensions) {
  const auto found = tensors.find(name);
  if (found == tensors.end()) {
    throw Error(where, fmt::format("there is no tensor '{}'", name), kNetworkRemedy);
  }
  const Tensor& tensor = found->second;
  std::size_t size = 1;
  for (const std::size_t length : tensor.shape) size *= length;
  if (tensor.shape.size() != dimensions || size == 0 || size != tensor.values.size()) {
    throw Error(where,
                fmt::format("'{}' does not have {} dimension(s) of values", name, dimensions),
                kNetworkRemedy);
  }
  for (const float value : tensor.values) {
    if (!std::isfinite(value)) {
      throw Error(where, fmt::format("'{}' holds values that are not finite", name),
                  "The training that wrote it diverged: use an earlier checkpoint");
    }
  }
  return tensor;
}

}  // namespace

Eigen::MatrixXf ReadMatrix(const TensorMap& tensors, const std::string& name,
                           const std::string& where) {
  const Tensor& tensor = Find(tensors, name, where, 2);
  return Eigen::Map<const RowMajor>(tensor.values.data(),
                                    static_cast<Eigen::Index>(tensor.shape[0]),
                                    static_cast<Eigen::Index>(tensor.shape[1]));
}

Eigen::MatrixXf ReadMatrix(const TensorMap& tensors, const std::string& name,
                           const std::string& where, Eigen::Index rows, Eigen::Index cols) {
  Eigen::MatrixXf matrix = ReadMatrix(tensors, name, where);
  if (matrix.rows() != rows || matrix.cols() != cols) {
    throw Error(where,
                fmt::format("'{}' is {} x {}, {} x {} is needed", name, matrix.rows(),
                            matrix.cols(), rows, cols),
                kNetworkRemedy);
  }
  return matrix;
}

Eigen::VectorXf ReadVector(const TensorMap& tensors, const std::string& name,
                           const std::string& where, Eigen::Index size) {
  const Tensor& tensor = Find(tensors, name, where, 1);
  if (static_cast<Eigen::Index>(tensor.values.size()) != size) {
    throw Error(where,
                fmt::format("'{}' has {} values, {} are needed", name, tensor.values.size(), size),
                kNetworkRemedy);
  }
  return Eigen::Map<const Eigen::VectorXf>(tensor.values.data(), size);
}

Tensor MatrixTensor(const Eigen::MatrixXf& matrix) {
  const RowMajor rows = matrix;
  return {{static_cast<std::size_t>(rows.rows()), static_cast<std::size_t>(rows.cols())},
          {rows.data(), rows.data() + rows.size()}};
}

Tensor VectorTensor(const Eigen::VectorXf& vector) {
  return {{static_cast<std::size_t>(vector.size())}, {vector.begin(), vector.end()}};
}

}  // namespace holdfast::nn
