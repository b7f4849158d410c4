// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>

#include <nlohmann/json.hpp>

#include "geometry/body/skeleton.h"

namespace holdfast::python {

namespace py = pybind11;

/// A shape as messages write it; -1 is any length.
using Shape = std::vector<py::ssize_t>;

/// Whether it names a file: a text, or what has __fspath__.
bool IsPath(const py::handle& value);
/// Its type, for messages.
std::string TypeText(const py::handle& value);

/// `value` as float64 in C order (a copy only where it is not that already): numpy arrays, lists,
/// tensors on the CPU. Throws ValueError or TypeError, saying what was expected of `name` and what
/// came, for another shape, for what is no real number, for numbers that are not finite, and for
/// more than fit into a quarter of this computer's memory (views repeat numbers at no cost, copies
/// do not).
py::array_t<double> Floats(const py::handle& value, const char* name, const Shape& shape);

/// The same of whole numbers.
py::array_t<int> Integers(const py::handle& value, const char* name, const Shape& shape);

/// Number of dimensions that numpy sees in `value`; 0 for what is no array.
py::ssize_t Dimensions(const py::handle& value);

/// ValueError for more float64 numbers (rows x columns) than fit into a quarter of this computer's
/// memory.
void RequireMemory(double rows, double columns, const std::string& name);

/// (T, 3) as one column a row.
Eigen::Matrix3Xd Columns(const py::handle& value, const char* name, py::ssize_t rows = -1);
/// (N,), any length.
Eigen::VectorXd Vector(const py::handle& value, const char* name);
/// (T, 165) or (T, 55, 3).
std::vector<JointPose> Poses(const py::handle& value, const char* name);

/// The columns of a matrix as an array's rows (n, rows), copied.
template <typename Derived>
py::array_t<typename Derived::Scalar> Rows(const Eigen::MatrixBase<Derived>& matrix) {
  py::array_t<typename Derived::Scalar> array({matrix.cols(), matrix.rows()});
  Eigen::Map<Eigen::Matrix<typename Derived::Scalar, Eigen::Dynamic, Eigen::Dynamic>>(
      array.mutable_data(), matrix.rows(), matrix.cols()) = matrix;
  return array;
}

/// The same without a copy, into memory that `owner` keeps alive.
template <typename Matrix>
py::array_t<typename Matrix::Scalar> RowsOf(Matrix& matrix, const py::object& owner) {
  return py::array_t<typename Matrix::Scalar>({matrix.cols(), matrix.rows()}, matrix.data(), owner);
}

/// The same in dicts, lists, numbers, strings and None.
py::object ToPython(const nlohmann::json& json);

}  // namespace holdfast::python
