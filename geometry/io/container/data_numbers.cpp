// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstring>
#include <ranges>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/data_store.h"
#include "geometry/io/container/npy_header.h"

// Implements DataValue::Array(): the numbers of any value that holds numbers.

namespace holdfast {
namespace {

constexpr std::size_t kMaxSteps = 64;

[[noreturn]] void FailUneven(const std::string& where) {
  throw Error(where, "holds lists of unequal length, or of numbers and lists, not one array",
              "Save it as an array");
}

bool IsNumber(const DataNode& node) {
  return std::holds_alternative<bool>(node) || std::holds_alternative<std::int64_t>(node) ||
         std::holds_alternative<double>(node);
}

// Joins leaves, which are numbers or arrays of one shape, in their order.
NpyArray JoinLeaves(const DataStore& store, const std::vector<NodeIndex>& leaves,
                    std::vector<std::size_t> shape, const std::string& where) {
  std::vector<double> reals;
  std::vector<std::int64_t> integers;
  bool all_integers = true;
  std::optional<std::vector<std::size_t>> leaf_shape;
  std::size_t bytes = 0;
  for (const NodeIndex leaf : leaves) {
    const DataNode& node = store[leaf];
    std::vector<std::size_t> this_shape;
    if (IsNumber(node)) {
      const auto* real = std::get_if<double>(&node);
      const auto* boolean = std::get_if<bool>(&node);
      const std::int64_t integer =
          real ? 0 : (boolean ? std::int64_t{*boolean} : std::get<std::int64_t>(node));
      all_integers &= real == nullptr;
      reals.push_back(real ? *real : static_cast<double>(integer));
      if (all_integers) integers.push_back(integer);
    } else if (const auto* array = std::get_if<std::unique_ptr<ArrayNode>>(&node)) {
      const NpyMember member = GatherArray(store, **array, where);
      this_shape = member.array.shape;
      const std::vector<double> values = member.AsDoubles();
      bytes += 2 * sizeof(double) * values.size();
      if (bytes > store.MemoryLimit()) {
        throw Error(where, "repeats its arrays beyond the memory limit", "Save it as one array");
      }
      reals.insert(reals.end(), values.begin(), values.end());
      all_integers &= member.array.kind == 'i' || member.array.kind == 'u';
      if (all_integers) {
        const std::vector<std::int64_t> more = member.AsIntegers();
        integers.insert(integers.end(), more.begin(), more.end());
      }
    } else {
      throw Error(where, "holds values that are not numbers", "Check the field");
    }
    if (leaf_shape && *leaf_shape != this_shape) FailUneven(where);
    leaf_shape = this_shape;
  }
  if (leaf_shape) shape.insert(shape.end(), leaf_shape->begin(), leaf_shape->end());
  if (shape.size() > kMaxRank) FailUneven(where);
  return all_integers && !leaves.empty() ? MakeNpyArray('i', std::move(shape), integers)
                                         : MakeNpyArray('f', std::move(shape), reals);
}

// Works level by level, so that nesting needs no recursion. Shared parts are counted each time they
// appear.
NpyArray GatherList(const DataStore& store, NodeIndex index, const std::string& where) {
  std::vector<std::size_t> shape;
  std::vector<NodeIndex> level{index}, next, firsts;
  while (!level.empty() && std::holds_alternative<ListNode>(store[level.front()])) {
    if (shape.size() == kMaxRank) {
      throw Error(where, fmt::format("is nested more than {} lists deep", kMaxRank),
                  "Save it as an array");
    }
    // Each level's first list leads to the next one's: a list that repeats contains itself.
    if (std::find(firsts.begin(), firsts.end(), level.front()) != firsts.end()) {
      throw Error(where, "is a list that holds itself", "Save it as an array");
    }
    firsts.push_back(level.front());
    const std::size_t length = std::get<ListNode>(store[level.front()]).items.size();
    if (length > store.MemoryLimit() / (4 * sizeof(double)) / level.size()) {
      throw Error(where, "repeats its lists beyond the memory limit", "Save it as an array");
    }
    next.clear();
    next.reserve(length * level.size());
    for (const NodeIndex item : level) {
      const auto* list = std::get_if<ListNode>(&store[item]);
      if (list == nullptr || list->items.size() != length) FailUneven(where);
      next.insert(next.end(), list->items.begin(), list->items.end());
    }
    shape.push_back(length);
    std::swap(level, next);
  }
  return JoinLeaves(store, level, std::move(shape), where);
}

float FromBrainFloat(const std::byte* bytes, bool big_endian) {
  const auto low = static_cast<std::uint32_t>(bytes[big_endian ? 1 : 0]);
  const auto high = static_cast<std::uint32_t>(bytes[big_endian ? 0 : 1]);
  const std::uint32_t bits = high << 24 | low << 16;
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

[[noreturn]] void Fail(const std::string& where, std::string_view problem) {
  throw Error(where, problem, "The file is damaged: get it from its source again");
}

// Throws Error if the field does not exist.
NodeIndex RequireField(const DataStore& store, NodeIndex index, std::string_view name,
                       const std::string& where) {
  if (const auto field = FindField(store, index, name)) return *field;
  const ObjectNode* object = ObjectAt(store, index);
  throw Error(where,
              fmt::format("is a {} without '{}'", object ? object->class_name : "dict", name),
              "The file is damaged, or of an unknown version");
}

// Numbers of a field that is itself an array or a list of numbers, not another instance, so that
// nested instances cause no recursion. Throws Error for anything else.
NpyMember PlainNumbers(const DataStore& store, NodeIndex index, const std::string& where) {
  if (ObjectAt(store, index) != nullptr) {
    throw Error(where,
                fmt::format("is a {} where an array is needed", ObjectAt(store, index)->class_name),
                "Save its value as an array");
  }
  return GatherNumbers(store, index, where);
}

// "csc", "csr" or "coo" for a scipy.sparse matrix (or array) of that format; else empty.
std::string_view SparseFormat(const DataStore& store, NodeIndex index) {
  const ObjectNode* object = ObjectAt(store, index);
  if (object == nullptr || !object->class_name.starts_with("scipy.sparse.")) return {};
  std::string_view name(object->class_name);
  name.remove_prefix(name.rfind('.') + 1);
  const std::string_view format = name.substr(0, 3), rest = name.substr(format.size());
  const bool known = (format == "csc" || format == "csr" || format == "coo") &&
                     (rest == "_matrix" || rest == "_array");
  return known ? format : std::string_view();
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

// Returns the dense matrix, float64, in C order; duplicate entries are summed. Throws Error if the
// parts are inconsistent or the dense matrix exceeds the memory limit of the file.
NpyArray SparseToDense(const DataStore& store, NodeIndex index, const std::string& where) {
  const std::string_view format = SparseFormat(store, index);
  // `_shape` since 2007; `shape` in files written by hand.
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
  if (format == "coo") {
    const std::vector<std::int64_t> row = Integers(store, index, "row", where);
    const std::vector<std::int64_t> column = Integers(store, index, "col", where);
    if (row.size() != values.size() || column.size() != values.size()) {
      FailMatrix(where, "rows, columns and values differ in number");
    }
    for (std::size_t i = 0; i < values.size(); ++i) add(row[i], column[i], values[i]);
  } else {
    const std::vector<std::int64_t> start = Integers(store, index, "indptr", where);
    const std::vector<std::int64_t> place = Integers(store, index, "indices", where);
    const std::size_t lines = format == "csc" ? columns : rows;
    const auto known = static_cast<std::int64_t>(std::min(place.size(), values.size()));
    if (start.size() != lines + 1 || start.front() != 0)
      FailMatrix(where, "indptr does not fit its shape");
    for (std::size_t line = 0; line < lines; ++line) {
      if (start[line + 1] < start[line] || start[line + 1] > known) {
        FailMatrix(where, "indptr does not fit its indices");
      }
      for (std::int64_t i = start[line]; i < start[line + 1]; ++i) {
        const auto across = static_cast<std::int64_t>(line);
        const std::int64_t along = place[i];
        const double value = values[i];
        format == "csc" ? add(along, across, value) : add(across, along, value);
      }
    }
  }
  return MakeNpyArray('f', {rows, columns}, dense);
}

bool IsClass(const ObjectNode& object, std::string_view module, std::string_view name) {
  const std::string_view all(object.class_name);
  return all.starts_with("chumpy.") && all.size() > name.size() && all.ends_with(name) &&
         all[all.size() - name.size() - 1] == '.' && all.find(module) != std::string_view::npos;
}

// Sizes of `count` numbers in a shape in which one size may be -1.
std::vector<std::size_t> Reshaped(std::size_t count, const std::vector<std::int64_t>& newshape,
                                  const std::string& where) {
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
  const bool fits = unknown == 0   ? known == count
                    : unknown == 1 ? known != 0 && count % known == 0
                                   : false;
  if (!fits) Fail(where, fmt::format("has {} numbers that do not fit its shape", count));
  std::vector<std::size_t> shape;
  for (const std::int64_t n : newshape) {
    shape.push_back(n == -1 ? count / known : static_cast<std::size_t>(n));
  }
  return shape;
}

std::vector<double> Selected(const std::vector<double>& numbers,
                             const std::vector<std::int64_t>& places, std::size_t memory_limit,
                             const std::string& where) {
  if (places.size() > memory_limit / sizeof(double))
    Fail(where, "selects more numbers than the memory limit allows");
  std::vector<double> chosen;
  chosen.reserve(places.size());
  const auto count = static_cast<std::int64_t>(numbers.size());
  for (const std::int64_t place : places) {
    const std::int64_t i = place < 0 ? place + count : place;  // Python also counts from the end
    if (i < 0 || i >= count) Fail(where, fmt::format("selects element {} of {}", place, count));
    chosen.push_back(numbers[i]);
  }
  return chosen;
}

bool IsChumpy(const DataStore& store, NodeIndex index) {
  const ObjectNode* object = ObjectAt(store, index);
  return object != nullptr && object->class_name.starts_with("chumpy.");
}

// Returns the value of a chumpy array, as its `.r` would. The first releases of the body models
// contain three kinds: a plain array (chumpy.ch.Ch: field x), selected elements of another array
// (chumpy.reordering.Select: a, idxs, preferred_shape), and a reshaped array
// (chumpy.reordering.Reshape: a, newshape). Throws Error for every other expression, which would
// have to be evaluated.
NpyArray ChumpyValue(const DataStore& store, NodeIndex index, const std::string& where) {
  // Descends to the array that everything is made from, then applies the steps in reverse.
  std::vector<NodeIndex> steps;
  while (SparseFormat(store, index).empty()) {
    const ObjectNode* object = ObjectAt(store, index);
    if (object == nullptr) break;
    if (steps.size() == kMaxSteps) Fail(where, "is a chumpy expression that is nested too deeply");
    if (IsClass(*object, "ch", "Ch")) {
      index = RequireField(store, index, "x", where);
      steps.push_back(0);  // counted, but does nothing
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
  std::vector<std::size_t> shape = base.array.shape;
  std::vector<double> numbers = base.AsDoubles();
  for (const NodeIndex step : std::views::reverse(steps)) {
    const ObjectNode* object = ObjectAt(store, step);
    if (object == nullptr) continue;
    if (IsClass(*object, "reordering", "Select")) {
      const NpyMember places =
          PlainNumbers(store, RequireField(store, step, "idxs", where), where + "[idxs]");
      numbers = Selected(numbers, places.AsIntegers(), store.MemoryLimit(), where);
      shape = {numbers.size()};
      // Stored by chumpy for a slice; without it the result is as flat as its indices.
      if (const auto wanted = FindField(store, step, "preferred_shape")) {
        shape = Reshaped(numbers.size(), PlainNumbers(store, *wanted, where).AsIntegers(), where);
      }
    } else {
      const NodeIndex newshape = RequireField(store, step, "newshape", where);
      shape = Reshaped(numbers.size(), PlainNumbers(store, newshape, where).AsIntegers(), where);
    }
  }
  return MakeNpyArray('f', std::move(shape), numbers);
}

}  // namespace

std::string ElementTypeName(const ElementType& element) {
  switch (element.kind) {
    case 'f':
      return fmt::format("float{}", 8 * element.size);
    case 'i':
      return fmt::format("int{}", 8 * element.size);
    case 'u':
      return fmt::format("uint{}", 8 * element.size);
    case 'b':
      return "bool";
    case 'B':
      return "bfloat16";
    default:
      return "text";
  }
}

NpyMember GatherArray(const DataStore& store, const ArrayNode& array, const std::string& where) {
  const std::size_t size = array.element.size;
  const std::size_t count = CheckedProduct(array.shape, 1).value_or(SIZE_MAX);
  const bool is_view = !array.strides.empty();
  // A view may repeat its numbers (stride 0); an array must not claim more than it has.
  const std::size_t most =
      is_view ? std::max(store.MemoryLimit(), array.bytes.size()) : array.bytes.size();
  if (size != 0 && count > most / size) {
    throw Error(where,
                fmt::format("has shape ({}), which needs more bytes than there are",
                            fmt::join(array.shape, ", ")),
                "The file is damaged: get it from its source again");
  }
  NpyMember member{
      where,
      {array.element.kind, size, array.element.big_endian, array.fortran_order, array.shape, {}}};
  std::vector<std::byte>& data = member.array.data;
  if (!is_view) {
    data.assign(array.bytes.begin(),
                array.bytes.begin() + static_cast<std::ptrdiff_t>(count * size));
  } else if (count > 0) {
    data.resize(count * size);
    std::vector<std::size_t> index(array.shape.size(), 0);
    std::size_t from = 0;
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(data.data() + i * size, array.bytes.data() + from * size, size);
      for (std::size_t d = array.shape.size(); d-- > 0;) {
        from += array.strides[d];
        if (++index[d] < array.shape[d]) break;
        from -= array.strides[d] * array.shape[d];
        index[d] = 0;
      }
    }
  }
  if (array.element.kind == 'B') {
    std::vector<float> values(count);
    for (std::size_t i = 0; i < count; ++i) {
      values[i] = FromBrainFloat(data.data() + 2 * i, array.element.big_endian);
    }
    member.array = MakeNpyArray('f', array.shape, values);
    member.array.fortran_order = array.fortran_order;
  }
  return member;
}

NpyMember GatherNumbers(const DataStore& store, NodeIndex index, const std::string& where) {
  const DataNode& node = store[index];
  if (const auto* array = std::get_if<std::unique_ptr<ArrayNode>>(&node)) {
    return GatherArray(store, **array, where);
  }
  if (std::holds_alternative<ListNode>(node)) return {where, GatherList(store, index, where)};
  if (IsNumber(node)) return {where, JoinLeaves(store, {index}, {}, where)};
  if (IsChumpy(store, index)) return {where, ChumpyValue(store, index, where)};
  if (!SparseFormat(store, index).empty()) return {where, SparseToDense(store, index, where)};
  const auto* object = std::get_if<std::unique_ptr<ObjectNode>>(&node);
  throw Error(where,
              object ? fmt::format("is a {}, which holds no numbers", (*object)->class_name)
                     : "is not an array of numbers",
              "Check that it is the right kind of file");
}

}  // namespace holdfast
