// SPDX-License-Identifier: MIT
#include "geometry/io/container/chumpy_value.h"

#include <cstring>
#include <ranges>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/object_fields.h"
#include "geometry/io/container/sparse_value.h"

namespace holdfast {
namespace {

constexpr std::size_t kMaxSteps = 64;

struct Values {
  std::vector<std::size_t> shape;
  std::vector<double> numbers;  // C order
};

[[noreturn]] void Fail(const std::string& where, std::string_view problem) {
  throw Error(where, problem, "The file is damaged: get it from its source again");
}

bool IsClass(const ObjectNode& object, std::string_view module, std::string_view name) {
  const std::string_view all(object.class_name);
  return all.starts_with("chumpy.") && all.size() > name.size() && all.ends_with(name) &&
         all[all.size() - name.size() - 1] == '.' && all.find(module) != std::string_view::npos;
}

void Reshape(Values& values, const std::vector<std::int64_t>& newshape, const std::string& where) {
  std::size_t known = 1;
  std::size_t unknown = 0;
  for (const std::int64_t n : newshape) {
    if (n == -1) {
      ++unknown;
    } else if (n < 0 || (n != 0 && known > SIZE_MAX / static_cast<std::size_t>(n))) {
      Fail(where, "is reshaped to an impossible shape");
    } else {
      known *= static_cast<std::size_t>(n);
    }
  }
  const std::size_t count = values.numbers.size();
  const bool fits = unknown == 0   ? known == count
                    : unknown == 1 ? known != 0 && count % known == 0
                                   : false;
  if (!fits) Fail(where, fmt::format("has {} numbers that do not fit its shape", count));
  values.shape.clear();
  for (const std::int64_t n : newshape) {
    values.shape.push_back(n == -1 ? count / known : static_cast<std::size_t>(n));
  }
}

void Select(Values& values, const std::vector<std::int64_t>& places, std::size_t memory_limit,
            const std::string& where) {
  if (places.size() > memory_limit / sizeof(double)) Fail(where, "selects beyond all bounds");
  std::vector<double> chosen;
  chosen.reserve(places.size());
  const auto count = static_cast<std::int64_t>(values.numbers.size());
  for (const std::int64_t place : places) {
    const std::int64_t i = place < 0 ? place + count : place;  // Python counts from the end, too
    if (i < 0 || i >= count) Fail(where, fmt::format("selects number {} of {}", place, count));
    chosen.push_back(values.numbers[static_cast<std::size_t>(i)]);
  }
  values.shape = {chosen.size()};
  values.numbers = std::move(chosen);
}

}  // namespace

bool IsChumpy(const DataStore& store, NodeIndex index) {
  const ObjectNode* object = ObjectAt(store, index);
  return object != nullptr && object->class_name.starts_with("chumpy.");
}

NpyArray ChumpyValue(const DataStore& store, NodeIndex index, const std::string& where) {
  // Down to the array that everything is made from, then up again.
  std::vector<NodeIndex> steps;
  while (!IsSparse(store, index)) {
    const ObjectNode* object = ObjectAt(store, index);
    if (object == nullptr) break;
    if (steps.size() == kMaxSteps) Fail(where, "is a chumpy expression without end");
    if (IsClass(*object, "ch", "Ch")) {
      index = RequireField(store, index, "x", where);
      steps.push_back(0);  // counts, does nothing
    } else if (IsClass(*object, "reordering", "Select") ||
               IsClass(*object, "reordering", "Reshape")) {
      steps.push_back(index);
      index = RequireField(store, index, "a", where);
    } else {
      throw Error(where,
                  fmt::format("is a {}, which would have to be computed", object->class_name),
                  "Save its value: numpy.array(x) for each field, in a Python that has chumpy");
    }
  }
  const NpyMember base = GatherNumbers(store, index, where);
  Values values{base.array.shape, base.AsDoubles()};
  for (const NodeIndex step : std::views::reverse(steps)) {
    const ObjectNode* object = ObjectAt(store, step);
    if (object == nullptr) continue;
    if (IsClass(*object, "reordering", "Select")) {
      const NpyMember places =
          PlainNumbers(store, RequireField(store, step, "idxs", where), where + "[idxs]");
      Select(values, places.AsIntegers(), store.MemoryLimit(), where);
      // Kept by chumpy for a slice; without it the result is as flat as its indices.
      if (const auto shape = FindField(store, step, "preferred_shape")) {
        Reshape(values, PlainNumbers(store, *shape, where).AsIntegers(), where);
      }
    } else {
      const NodeIndex newshape = RequireField(store, step, "newshape", where);
      Reshape(values, PlainNumbers(store, newshape, where).AsIntegers(), where);
    }
  }
  NpyArray array{'f', sizeof(double), false, false, std::move(values.shape), {}};
  array.data.resize(values.numbers.size() * sizeof(double));
  if (!values.numbers.empty()) {
    std::memcpy(array.data.data(), values.numbers.data(), array.data.size());
  }
  return array;
}

}  // namespace holdfast
