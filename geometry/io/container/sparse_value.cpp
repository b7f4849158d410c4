// SPDX-License-Identifier: MIT
#include "geometry/io/container/sparse_value.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/object_fields.h"

namespace holdfast {
namespace {

enum class Form { kByColumns, kByRows, kPairs };

std::optional<Form> FormOf(const DataStore& store, NodeIndex index) {
  const ObjectNode* object = ObjectAt(store, index);
  if (object == nullptr || !object->class_name.starts_with("scipy.sparse.")) return std::nullopt;
  const std::string_view name(object->class_name);
  const std::string_view last = name.substr(name.rfind('.') + 1);
  if (last == "csc_matrix" || last == "csc_array") return Form::kByColumns;
  if (last == "csr_matrix" || last == "csr_array") return Form::kByRows;
  if (last == "coo_matrix" || last == "coo_array") return Form::kPairs;
  return std::nullopt;
}

[[noreturn]] void FailMatrix(const std::string& where, std::string_view problem) {
  throw Error(where, fmt::format("is a sparse matrix whose {}", problem),
              "The file is damaged: get it from its source again");
}

std::vector<std::int64_t> Integers(const DataStore& store, NodeIndex object, std::string_view name,
                                   const std::string& where) {
  return PlainNumbers(store, RequireField(store, object, name, where),
                      fmt::format("{}[{}]", where, name))
      .AsIntegers();
}

}  // namespace

bool IsSparse(const DataStore& store, NodeIndex index) { return FormOf(store, index).has_value(); }

NpyArray SparseToDense(const DataStore& store, NodeIndex index, const std::string& where) {
  const Form form = *FormOf(store, index);
  // `_shape` since 2007; `shape` in what others write by hand.
  const auto shape_field = FindField(store, index, "_shape");
  const std::vector<std::int64_t> shape =
      Integers(store, index, shape_field ? "_shape" : "shape", where);
  if (shape.size() != 2 || shape[0] < 0 || shape[1] < 0)
    FailMatrix(where, "shape is not two sizes");
  const auto rows = static_cast<std::size_t>(shape[0]);
  const auto columns = static_cast<std::size_t>(shape[1]);
  if (columns != 0 && rows > store.MemoryLimit() / sizeof(double) / columns) {
    throw Error(
        where,
        fmt::format("is a sparse {} x {} matrix, too large to be filled with zeros", rows, columns),
        "Save a smaller one");
  }
  const std::vector<double> values =
      PlainNumbers(store, RequireField(store, index, "data", where), where + "[data]").AsDoubles();
  std::vector<double> dense(rows * columns, 0.0);
  const auto add = [&](std::int64_t row, std::int64_t column, double value) {
    if (row < 0 || column < 0 || row >= shape[0] || column >= shape[1]) {
      FailMatrix(where, "entries lie outside it");
    }
    dense[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)] += value;
  };
  if (form == Form::kPairs) {
    const std::vector<std::int64_t> row = Integers(store, index, "row", where);
    const std::vector<std::int64_t> column = Integers(store, index, "col", where);
    if (row.size() != values.size() || column.size() != values.size()) {
      FailMatrix(where, "rows, columns and values differ in number");
    }
    for (std::size_t i = 0; i < values.size(); ++i) add(row[i], column[i], values[i]);
  } else {
    const std::vector<std::int64_t> start = Integers(store, index, "indptr", where);
    const std::vector<std::int64_t> place = Integers(store, index, "indices", where);
    const std::size_t lines = form == Form::kByColumns ? columns : rows;
    const auto known = static_cast<std::int64_t>(std::min(place.size(), values.size()));
    if (start.size() != lines + 1 || start.front() != 0)
      FailMatrix(where, "indptr does not fit its shape");
    for (std::size_t line = 0; line < lines; ++line) {
      if (start[line + 1] < start[line] || start[line + 1] > known) {
        FailMatrix(where, "indptr does not fit its indices");
      }
      for (std::int64_t i = start[line]; i < start[line + 1]; ++i) {
        const auto across = static_cast<std::int64_t>(line);
        const std::int64_t along = place[static_cast<std::size_t>(i)];
        const double value = values[static_cast<std::size_t>(i)];
        form == Form::kByColumns ? add(along, across, value) : add(across, along, value);
      }
    }
  }
  NpyArray array{'f', sizeof(double), false, false, {rows, columns}, {}};
  array.data.resize(dense.size() * sizeof(double));
  if (!dense.empty()) std::memcpy(array.data.data(), dense.data(), array.data.size());
  return array;
}

}  // namespace holdfast
