// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <unordered_map>

#include <fmt/format.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/error.h"
#include "geometry/io/pickle/data_file.h"
#include "python/src/bindings.h"
#include "python/src/numpy.h"
#include "python/src/run.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

constexpr int kMaxNested = 200;

// The numbers (or texts) with their type and shape, without a copy.
py::array ArrayOf(NpyMember member) {
  auto owned = std::make_unique<NpyArray>(std::move(member.array));
  const NpyArray& array = *owned;
  const std::size_t length = array.kind == 'U' ? array.item_size / 4 : array.item_size;
  const py::dtype type(fmt::format("{}{}{}", array.big_endian ? '>' : '<', array.kind, length));
  std::vector<py::ssize_t> shape(array.shape.begin(), array.shape.end());
  if (array.data.size() != array.NumElements() * array.item_size) {
    throw Error(member.where, "does not have the number of bytes that its shape requires",
                "Download the file again");
  }
  if (array.data.empty()) return py::array(type, shape);
  std::vector<py::ssize_t> strides(shape.size());
  auto step = static_cast<py::ssize_t>(array.item_size);
  for (std::size_t k = 0; k < shape.size(); ++k) {
    const std::size_t axis = array.fortran_order ? k : shape.size() - 1 - k;
    strides[axis] = step;
    step *= shape[axis];
  }
  const std::byte* const bytes = array.data.data();
  const py::capsule owner(owned.release(), [](void* held) { delete static_cast<NpyArray*>(held); });
  return py::array(type, shape, strides, bytes, owner);
}

py::str TextOf(const DataValue& value) {
  const std::string text = value.Text();
  return py::reinterpret_steal<py::str>(
      PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "replace"));
}

// Converts the values of one file to Python objects. A value that the file references twice becomes
// one object, so the work is bounded by the file size, and lists may contain themselves.
class Converter {
 public:
  py::object operator()(const DataValue& value, int depth = 0) {
    switch (value.Kind()) {
      case DataKind::kNone:
        return py::none();
      case DataKind::kBool:
        return py::bool_(value.Number() != 0.0);
      case DataKind::kInteger:
        return py::int_(value.Integer());
      case DataKind::kReal:
        return py::float_(value.Number());
      case DataKind::kText:
        return TextOf(value);
      case DataKind::kBytes:
        return py::bytes(value.Text());
      default:
        break;
    }
    if (depth == kMaxNested) {
      throw Error(value.Where(), fmt::format("is nested more than {} deep", kMaxNested),
                  "Check the file");
    }
    const auto known = made_.find(value.Index());
    if (known != made_.end()) return known->second;
    if (value.Kind() == DataKind::kList) {
      py::list list;
      made_[value.Index()] = list;
      for (std::size_t i = 0; i < value.Size(); ++i) list.append((*this)(value[i], depth + 1));
      return list;
    }
    const bool is_object = value.Kind() == DataKind::kObject;
    if (value.Kind() == DataKind::kArray || (is_object && value.HoldsNumbers())) {
      return made_[value.Index()] = ArrayOf(value.Array());
    }
    if (is_object && value.Names().empty()) {
      throw Error(value.Where(),
                  fmt::format("is {}, which cannot be converted to data", value.Describe()),
                  "Save its contents as arrays");
    }
    py::dict dict;
    made_[value.Index()] = dict;
    for (const std::string& name : value.Names()) {
      dict[py::str(name)] = (*this)(value[name], depth + 1);
    }
    return dict;
  }

 private:
  std::unordered_map<std::uint32_t, py::object> made_;
};

py::object LoadSafe(const std::filesystem::path& path) {
  const DataValue root = RunAside([path] { return DataFile(path).Root(); });
  return Converter()(root);
}

}  // namespace

void BindData(py::module_& module) {
  module.def("load_pickle_safe", &LoadSafe, "path"_a,
             R"(Reads a pickle without executing anything in it.

Also reads torch files, .npz, .npy, safetensors and JSON, gzipped or not. The format is detected
from the content.

Tuples and sets become lists. scipy.sparse and chumpy arrays become numpy arrays. Other plain
objects become dicts of their fields. Keys become strings. Keys that are neither strings nor
integers are left out.

Parameters
----------
path : path

Returns
-------
dict
    Arrays (with their types and shapes), numbers, strings, None, lists and dicts; or the value in
    the file if it is not a dict.

Raises
------
Error
    If the file needs any class other than those of plain data. The message names the class.
)");
}

}  // namespace holdfast::python
