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

/// Shape of an array in messages; -1 is any length.
using Shape = std::vector<py::ssize_t>;

/// Returns whether `value` names a file: a str, or an object with __fspath__.
bool IsPath(const py::handle& value);
/// Returns the type of `value`, for messages.
std::string TypeText(const py::handle& value);

/// Converts `value` to float64 in C order, copying only if necessary: numpy arrays, lists, tensors
/// on the CPU. Throws ValueError or TypeError, naming the expected and actual value of `name`, for
/// another shape, non-real or non-finite numbers (NaN is taken if `gaps`), and arrays larger than a
/// quarter of this computer's memory (views repeat numbers at no cost, copies do not).
py::array_t<double> Floats(const py::handle& value, const char* name, const Shape& shape,
                           bool gaps = false);

/// Same, for integers.
py::array_t<int> Integers(const py::handle& value, const char* name, const Shape& shape);

/// Number of dimensions of `value` as a numpy array; 0 if it is not an array.
py::ssize_t Dimensions(const py::handle& value);

/// Throws ValueError if rows x columns float64 numbers exceed a quarter of this computer's memory.
void RequireMemory(double rows, double columns, const std::string& name);

/// Converts (T, 3) to one column per row.
Eigen::Matrix3Xd Columns(const py::handle& value, const char* name, py::ssize_t rows = -1);
/// Converts (N,) of any length.
Eigen::VectorXd Vector(const py::handle& value, const char* name);
/// Converts axis-angle (T, 165) or (T, 55, 3), matrices (T, 55, 3, 3), or 6D (T, 55, 6): the first
/// two columns of the matrix, one after the other. Throws ValueError for what is no rotation.
std::vector<JointPose> Poses(const py::handle& value, const char* name);

/// Returns the columns of a matrix as rows of an array (n, rows), copied.
template <typename Derived>
py::array_t<typename Derived::Scalar> Rows(const Eigen::MatrixBase<Derived>& matrix) {
  py::array_t<typename Derived::Scalar> array({matrix.cols(), matrix.rows()});
  Eigen::Map<Eigen::Matrix<typename Derived::Scalar, Eigen::Dynamic, Eigen::Dynamic>>(
      array.mutable_data(), matrix.rows(), matrix.cols()) = matrix;
  return array;
}

/// Same without a copy; `owner` keeps the memory alive.
template <typename Matrix>
py::array_t<typename Matrix::Scalar> RowsOf(Matrix& matrix, const py::object& owner) {
  return py::array_t<typename Matrix::Scalar>({matrix.cols(), matrix.rows()}, matrix.data(), owner);
}

/// Converts JSON to dicts, lists, numbers, strings and None.
py::object ToPython(const nlohmann::json& json);

}  // namespace holdfast::python
