// SPDX-License-Identifier: MIT
// What DataValue::Array() gives: the numbers of whatever holds numbers.
#include <algorithm>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/chumpy_value.h"
#include "geometry/io/container/data_store.h"
#include "geometry/io/container/npy_header.h"
#include "geometry/io/container/sparse_value.h"

namespace holdfast {
namespace {

[[noreturn]] void FailUneven(const std::string& where) {
  throw Error(where, "holds lists of unequal length, or of numbers and lists, not one array",
              "Save it as an array");
}

bool IsNumber(const DataNode& node) {
  return std::holds_alternative<bool>(node) || std::holds_alternative<std::int64_t>(node) ||
         std::holds_alternative<double>(node);
}

// Leaves that are numbers, or arrays of one shape, in the order they come.
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
        throw Error(where, "repeats its arrays beyond all bounds", "Save it as one array");
      }
      reals.insert(reals.end(), values.begin(), values.end());
      all_integers &= member.array.kind == 'i' || member.array.kind == 'u';
      if (all_integers) {
        const std::vector<std::int64_t> more = member.AsIntegers();
        integers.insert(integers.end(), more.begin(), more.end());
      }
    } else {
      throw Error(where, "holds other things than numbers", "Check the field");
    }
    if (leaf_shape && *leaf_shape != this_shape) FailUneven(where);
    leaf_shape = this_shape;
  }
  if (leaf_shape) shape.insert(shape.end(), leaf_shape->begin(), leaf_shape->end());
  if (shape.size() > kMaxRank) FailUneven(where);
  return all_integers && !leaves.empty() ? MakeNpyArray('i', std::move(shape), integers)
                                         : MakeNpyArray('f', std::move(shape), reals);
}

// Level by level, so that no nesting recurses; what the file shares is counted each time it
// appears.
NpyArray GatherList(const DataStore& store, NodeIndex index, const std::string& where) {
  std::vector<std::size_t> shape;
  std::vector<NodeIndex> level{index}, next, firsts;
  while (!level.empty() && std::holds_alternative<ListNode>(store[level.front()])) {
    if (shape.size() == kMaxRank) {
      throw Error(where, fmt::format("is nested more than {} lists deep", kMaxRank),
                  "Save it as an array");
    }
    // From each level's first list the next one's is reached: one that comes again is in itself.
    if (std::find(firsts.begin(), firsts.end(), level.front()) != firsts.end()) {
      throw Error(where, "is a list that holds itself", "Save it as an array");
    }
    firsts.push_back(level.front());
    const std::size_t length = std::get<ListNode>(store[level.front()]).items.size();
    if (length > store.MemoryLimit() / (4 * sizeof(double)) / level.size()) {
      throw Error(where, "repeats its lists beyond all bounds", "Save it as an array");
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
  std::size_t count = 1;
  for (const std::size_t n : array.shape) {
    if (n != 0 && count > std::numeric_limits<std::size_t>::max() / n) count = SIZE_MAX;
    count = count == SIZE_MAX && n != 0 ? count : count * n;
  }
  const bool is_view = !array.strides.empty();
  // A view may repeat its numbers (stride 0), an array may not claim more than it has.
  const std::size_t most =
      is_view ? std::max(store.MemoryLimit(), array.bytes.size()) : array.bytes.size();
  if (size != 0 && count > most / size) {
    throw Error(
        where,
        fmt::format("has shape ({}), more than there are bytes for", fmt::join(array.shape, ", ")),
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
  if (IsSparse(store, index)) return {where, SparseToDense(store, index, where)};
  const auto* object = std::get_if<std::unique_ptr<ObjectNode>>(&node);
  throw Error(where,
              object
                  ? fmt::format("is a {}, which holds no numbers in itself", (*object)->class_name)
                  : "is not an array of numbers",
              "Check that it is a file of the kind that is asked for");
}

}  // namespace holdfast
