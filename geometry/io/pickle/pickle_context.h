// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "geometry/io/container/data_store.h"
#include "geometry/io/pickle/pickle.h"
#include "geometry/io/pickle/pickle_globals.h"
#include "geometry/io/pickle/pickle_scanner.h"

namespace holdfast {

/// A node that is not there.
inline constexpr NodeIndex kNoValue = std::numeric_limits<NodeIndex>::max();

/// What the parts of the pickle reader share while one pickle is read.
struct PickleContext {
  DataStore& store;
  const PickleScanner& scanner;
  const PickleOptions& options;
  /// Rows of the table of allowed names, by the node that stands for the name.
  std::unordered_map<NodeIndex, const AllowedGlobal*> globals = {};

  const AllowedGlobal* GlobalAt(NodeIndex index) const {
    const auto found = globals.find(index);
    return found == globals.end() ? nullptr : found->second;
  }
  const std::vector<NodeIndex>* ItemsAt(NodeIndex index) const {
    const auto* list = std::get_if<ListNode>(&store[index]);
    return list == nullptr ? nullptr : &list->items;
  }
  const DictNode* DictAt(NodeIndex index) const {
    const auto* dict = std::get_if<std::unique_ptr<DictNode>>(&store[index]);
    return dict == nullptr ? nullptr : dict->get();
  }
  ObjectNode* ObjectAt(NodeIndex index) const {
    auto* object = std::get_if<std::unique_ptr<ObjectNode>>(&store[index]);
    return object == nullptr ? nullptr : object->get();
  }
  /// Of texts and bytes alike: Python 2 has one type for both.
  std::optional<std::string_view> TextAt(NodeIndex index) const {
    if (const auto* text = std::get_if<TextNode>(&store[index])) return text->text;
    if (const auto* bytes = std::get_if<BytesNode>(&store[index])) return bytes->bytes;
    return std::nullopt;
  }
  std::optional<std::int64_t> IntegerAt(NodeIndex index) const {
    if (const auto* integer = std::get_if<std::int64_t>(&store[index])) return *integer;
    return std::nullopt;
  }
  bool IsNone(NodeIndex index) const {
    return std::holds_alternative<std::monostate>(store[index]);
  }
  bool IsTrue(NodeIndex index) const {
    const auto* boolean = std::get_if<bool>(&store[index]);
    return boolean != nullptr ? *boolean : IntegerAt(index).value_or(0) != 0;
  }
  /// Sizes that are not negative, at most 32 of them.
  std::optional<std::vector<std::size_t>> SizesAt(NodeIndex index) const;
};

/// Product, or nothing when it does not fit.
std::optional<std::size_t> CheckedProduct(std::span<const std::size_t> factors, std::size_t first);

}  // namespace holdfast
