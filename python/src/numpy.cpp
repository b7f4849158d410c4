// SPDX-License-Identifier: MIT
#include "python/src/numpy.h"

#include <cmath>

#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/rotation.h"

namespace holdfast::python {
namespace {

std::string ShapeText(const Shape& shape) {
  std::vector<std::string> lengths;
  for (const py::ssize_t n : shape) lengths.push_back(n < 0 ? "n" : std::to_string(n));
  return fmt::format("({}{})", fmt::join(lengths, ", "), shape.size() == 1 ? "," : "");
}

py::array AnyArray(const py::handle& value, const char* name, const Shape& shape, const char* kinds,
                   const char* what) {
  const std::string expected =
      fmt::format("{}: expected {} of shape {}", name, what, ShapeText(shape));
  if (value.is_none()) throw py::type_error(expected + ", got None");
  py::array array;
  try {
    array = py::array(py::reinterpret_borrow<py::object>(value));
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_Exception) || error.matches(PyExc_MemoryError)) throw;
    throw py::type_error(fmt::format("{}, got {} ({})", expected, TypeText(value), error.what()));
  }
  if (std::string(kinds).find(array.dtype().kind()) == std::string::npos) {
    throw py::type_error(
        fmt::format("{}, got dtype {}", expected, std::string(py::str(array.dtype()))));
  }
  bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
  for (std::size_t k = 0; fits && k < shape.size(); ++k) {
    fits = shape[k] < 0 || array.shape(static_cast<py::ssize_t>(k)) == shape[k];
  }
  if (!fits) {
    throw py::value_error(fmt::format(
        "{}, got {}", expected, ShapeText(Shape(array.shape(), array.shape() + array.ndim()))));
  }
  RequireMemory(static_cast<double>(array.size()), 1.0, name);
  return array;
}

}  // namespace

bool IsPath(const py::handle& value) {
  return py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
}

std::string TypeText(const py::handle& value) { return py::str(py::type::of(value)); }

py::ssize_t Dimensions(const py::handle& value) {
  const py::array any = py::array::ensure(value);  // clears exceptions
  return any ? any.ndim() : 0;
}

void RequireMemory(double rows, double columns, const std::string& name) {
  const double bytes = rows * columns * sizeof(double);
  const double memory = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
                        static_cast<double>(::sysconf(_SC_PAGE_SIZE));
  if (bytes <= memory / 4) return;
  throw py::value_error(fmt::format(
      "{}: {:.0f} numbers take {:.0f} GB, more than a quarter of this computer's memory "
      "({:.0f} GB): give them in parts",
      name, rows * columns, 1e-9 * bytes, 1e-9 * memory));
}

py::array_t<double> Floats(const py::handle& value, const char* name, const Shape& shape,
                           bool gaps) {
  const py::array any = AnyArray(value, name, shape, "fiub", "numbers");
  const py::array_t<double, py::array::c_style | py::array::forcecast> array(any);
  const double* numbers = array.data();
  for (py::ssize_t i = 0; i < array.size(); ++i) {
    if (std::isfinite(numbers[i]) || (gaps && std::isnan(numbers[i]))) continue;
    std::vector<py::ssize_t> at(shape.size());
    py::ssize_t rest = i;
    for (std::size_t k = shape.size(); k-- > 0;) {
      at[k] = rest % array.shape(static_cast<py::ssize_t>(k));
      rest /= array.shape(static_cast<py::ssize_t>(k));
    }
    throw py::value_error(fmt::format("{}[{}] is {}: only finite numbers are taken", name,
                                      fmt::join(at, ", "),
                                      std::isnan(numbers[i]) ? "NaN" : "infinite"));
  }
  return array;
}

py::array_t<int> Integers(const py::handle& value, const char* name, const Shape& shape) {
  const py::array any = AnyArray(value, name, shape, "iu", "whole numbers");
  const py::array_t<std::int64_t, py::array::c_style | py::array::forcecast> wide(any);
  py::array_t<int> array(std::vector<py::ssize_t>(any.shape(), any.shape() + any.ndim()));
  for (py::ssize_t i = 0; i < wide.size(); ++i) {
    const std::int64_t number = wide.data()[i];
    // Unsigned numbers beyond int64 become negative.
    if (number != static_cast<int>(number) || (number < 0 && any.dtype().kind() == 'u')) {
      throw py::value_error(fmt::format("{}: {} is out of range", name, number));
    }
    array.mutable_data()[i] = static_cast<int>(number);
  }
  return array;
}

Eigen::Matrix3Xd Columns(const py::handle& value, const char* name, py::ssize_t rows) {
  const py::array_t<double> array = Floats(value, name, {rows, 3});
  return Eigen::Map<const Eigen::Matrix3Xd>(array.data(), 3, array.shape(0));
}

Eigen::VectorXd Vector(const py::handle& value, const char* name) {
  const py::array_t<double> array = Floats(value, name, {-1});
  return Eigen::Map<const Eigen::VectorXd>(array.data(), array.size());
}

namespace {

// The rotation of 9 numbers, rows of a matrix, or of 6, its first two columns.
Eigen::Vector3d RotationVector(const double* numbers, bool matrix, const char* name, py::ssize_t t,
                               int joint) {
  Eigen::Matrix3d rotation;
  if (matrix) {
    rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers);
  } else {
    const Eigen::Map<const Eigen::Vector3d> first(numbers), second(numbers + 3);
    rotation.col(0) = first.normalized();
    rotation.col(1) = (second - rotation.col(0).dot(second) * rotation.col(0)).normalized();
    rotation.col(2) = rotation.col(0).cross(rotation.col(1));
  }
  constexpr double kOff = 1e-3;
  if (!((rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm() < kOff) ||
      rotation.determinant() < 0.0) {
    throw py::value_error(
        fmt::format("{}[{}, {}] is not a rotation: orthogonalize it first", name, t, joint));
  }
  return LogSO3(rotation);
}

std::vector<JointPose> PosesOfRotations(const py::array_t<double>& array, bool matrices,
                                        const char* name) {
  std::vector<JointPose> poses(static_cast<std::size_t>(array.shape(0)));
  const int size = matrices ? 9 : 6;
  const double* numbers = array.data();
  for (py::ssize_t t = 0; t < array.shape(0); ++t) {
    for (int joint = 0; joint < kNumJoints; ++joint, numbers += size) {
      poses[t].col(joint) = RotationVector(numbers, matrices, name, t, joint);
    }
  }
  return poses;
}

}  // namespace

std::vector<JointPose> Poses(const py::handle& value, const char* name) {
  const py::ssize_t dimensions = Dimensions(value);
  if (dimensions == 4) {
    return PosesOfRotations(Floats(value, name, {-1, kNumJoints, 3, 3}), true, name);
  }
  if (dimensions == 3 && py::array::ensure(value).shape(2) == 6) {
    return PosesOfRotations(Floats(value, name, {-1, kNumJoints, 6}), false, name);
  }
  const py::array_t<double> array = dimensions == 3 ? Floats(value, name, {-1, kNumJoints, 3})
                                                    : Floats(value, name, {-1, 3 * kNumJoints});
  std::vector<JointPose> poses(static_cast<std::size_t>(array.shape(0)));
  static_assert(sizeof(JointPose) == 3 * kNumJoints * sizeof(double));
  if (array.size() > 0) {
    std::copy_n(array.data(), array.size(), poses.front().data());
  }
  return poses;
}

py::object ToPython(const nlohmann::json& json) {
  if (json.is_object()) {
    py::dict dict;
    for (const auto& [key, value] : json.items()) dict[py::str(key)] = ToPython(value);
    return dict;
  }
  if (json.is_array()) {
    py::list list;
    for (const nlohmann::json& value : json) list.append(ToPython(value));
    return list;
  }
  if (json.is_string()) return py::str(json.get_ref<const std::string&>());
  if (json.is_boolean()) return py::bool_(json.get<bool>());
  if (json.is_number_unsigned()) return py::int_(json.get<std::uint64_t>());
  if (json.is_number_integer()) return py::int_(json.get<std::int64_t>());
  if (json.is_number()) return py::float_(json.get<double>());
  return py::none();
}

}  // namespace holdfast::python
