// SPDX-License-Identifier: MIT
#include "geometry/io/container/data_value.h"

#include <cmath>
#include <iterator>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/data_store.h"
#include "geometry/io/container/text_scanner.h"

namespace holdfast {
namespace {

constexpr std::size_t kMaxNamesInError = 40;

const ArrayNode* ArrayOf(const DataStore& store, NodeIndex index) {
  const auto* array = std::get_if<std::unique_ptr<ArrayNode>>(&store[index]);
  return array == nullptr ? nullptr : array->get();
}

std::string Shorten(std::string text) {
  constexpr std::size_t kLongest = 60;
  return text.size() <= kLongest ? text : text.substr(0, kLongest - 3) + "...";
}

}  // namespace

DataValue::DataValue(std::shared_ptr<const DataStore> store, std::uint32_t index, std::string where)
    : store_(std::move(store)), index_(index), where_(std::move(where)) {}

DataKind DataValue::Kind() const {
  const DataNode& node = (*store_)[index_];
  if (const auto* bytes = std::get_if<BytesNode>(&node)) {
    return bytes->is_python2_text && IsUtf8(bytes->bytes) ? DataKind::kText : DataKind::kBytes;
  }
  if (const ArrayNode* array = ArrayOf(*store_, index_)) {
    const bool is_text = array->element.kind == 'U' || array->element.kind == 'S';
    return is_text && array->shape.empty() ? DataKind::kText : DataKind::kArray;
  }
  using enum DataKind;
  constexpr DataKind kByAlternative[] = {kNone,  kBool, kInteger, kReal,  kText,
                                         kBytes, kList, kDict,    kArray, kObject};
  static_assert(std::size(kByAlternative) == std::variant_size_v<DataNode>);
  return kByAlternative[node.index()];
}

std::string DataValue::Describe() const {
  const DataNode& node = (*store_)[index_];
  switch (Kind()) {
    case DataKind::kNone:
      return "None";
    case DataKind::kBool:
      return std::get<bool>(node) ? "True" : "False";
    case DataKind::kInteger:
      return std::to_string(std::get<std::int64_t>(node));
    case DataKind::kReal:
      return fmt::format("{}", std::get<double>(node));
    case DataKind::kText:
      return fmt::format("text \"{}\"", Shorten(Text()));
    case DataKind::kBytes:
      return fmt::format("{} bytes", std::get<BytesNode>(node).bytes.size());
    case DataKind::kArray: {
      const ArrayNode& array = *std::get<std::unique_ptr<ArrayNode>>(node);
      return fmt::format("array ({}) of {}", fmt::join(array.shape, ", "),
                         ElementTypeName(array.element));
    }
    case DataKind::kList:
      return fmt::format("list of {}", Size());
    case DataKind::kDict:
      return fmt::format("dict of {}", std::get<std::unique_ptr<DictNode>>(node)->named.size());
    case DataKind::kObject:
      break;
  }
  const ObjectNode& object = *std::get<std::unique_ptr<ObjectNode>>(node);
  return object.is_class ? fmt::format("the class {}", object.class_name) : object.class_name;
}

bool DataValue::Has(std::string_view name) const {
  return FindField(*store_, index_, name).has_value();
}

std::vector<std::string> DataValue::Names() const {
  std::vector<std::string> names;
  if (const DictNode* dict = NamesAt(*store_, index_)) {
    names.reserve(dict->named.size());
    for (const auto& [name, value] : dict->named) names.emplace_back(name);
  }
  return names;
}

std::optional<DataValue> DataValue::Find(std::string_view name) const {
  const auto found = FindField(*store_, index_, name);
  if (!found) return std::nullopt;
  return DataValue(store_, *found, fmt::format("{}[{}]", where_, name));
}

DataValue DataValue::operator[](std::string_view name) const {
  if (auto value = Find(name)) return *std::move(value);
  const DictNode* dict = NamesAt(*store_, index_);
  if (dict == nullptr) {
    throw Error(where_,
                fmt::format("is {}, where named values with '{}' are needed", Describe(), name),
                "Check that it is the right kind of file");
  }
  throw Error(fmt::format("{}[{}]", where_, name), "is missing",
              dict->named.empty()
                  ? "It has no names"
                  : fmt::format("It has: {}", SomeNames(Names(), kMaxNamesInError)));
}

std::size_t DataValue::Size() const {
  const auto* list = std::get_if<ListNode>(&(*store_)[index_]);
  return list == nullptr ? 0 : list->items.size();
}

DataValue DataValue::operator[](std::size_t index) const {
  const auto* list = std::get_if<ListNode>(&(*store_)[index_]);
  if (list == nullptr) {
    throw Error(where_, fmt::format("is {}, where a list is needed", Describe()),
                "Check that it is the right kind of file");
  }
  if (index >= list->items.size()) {
    throw Error(where_,
                fmt::format("has {} items, but item {} was requested", list->items.size(), index),
                "Check the file");
  }
  return DataValue(store_, list->items[index], fmt::format("{}[{}]", where_, index));
}

bool DataValue::HoldsNumbers() const {
  switch (Kind()) {
    case DataKind::kBool:
    case DataKind::kInteger:
    case DataKind::kReal:
      return true;
    case DataKind::kArray: {
      const char kind = ArrayOf(*store_, index_)->element.kind;
      return kind != 'U' && kind != 'S';
    }
    case DataKind::kList:
    case DataKind::kObject:
      try {
        GatherNumbers(*store_, index_, where_);
        return true;
      } catch (const Error&) {
        return false;
      }
    default:
      return false;
  }
}

NpyMember DataValue::Array() const& { return GatherNumbers(*store_, index_, where_); }

NpyMember DataValue::Array() && {
  // The last handle of an array that stands alone moves its bytes out: a member of a large .npz
  // never exists twice.
  const ArrayNode* array = ArrayOf(*store_, index_);
  const bool may_move = array != nullptr && array->alone && store_.use_count() == 1 &&
                        array->alone.use_count() == 1 && array->strides.empty() &&
                        array->element.kind != 'B' && array->bytes.size() == array->alone->size();
  if (!may_move) return GatherNumbers(*store_, index_, where_);
  NpyMember member;
  member.where = where_;
  member.array = {array->element.kind,  array->element.size, array->element.big_endian,
                  array->fortran_order, array->shape,        std::move(*array->alone)};
  store_.reset();
  return member;
}

double DataValue::Number() const {
  const DataNode& node = (*store_)[index_];
  if (const auto* real = std::get_if<double>(&node)) return *real;
  if (const auto* integer = std::get_if<std::int64_t>(&node)) return static_cast<double>(*integer);
  if (const auto* boolean = std::get_if<bool>(&node)) return *boolean ? 1.0 : 0.0;
  const NpyMember member = Array();
  if (member.array.NumElements() != 1) {
    throw Error(where_, fmt::format("has shape {}, where one number is needed", member.ShapeText()),
                "Check the field");
  }
  return member.AsDoubles().front();
}

std::int64_t DataValue::Integer() const {
  if (const auto* integer = std::get_if<std::int64_t>(&(*store_)[index_])) return *integer;
  if (const ArrayNode* array = ArrayOf(*store_, index_); array && array->element.kind != 'f') {
    const NpyMember member = Array();
    if (member.array.NumElements() == 1) return member.AsIntegers().front();
  }
  const double number = Number();
  if (!(std::fabs(number) < 0x1p53) || number != std::floor(number)) {
    throw Error(where_, fmt::format("is {}, where a whole number is needed", number),
                "Check the field");
  }
  return static_cast<std::int64_t>(number);
}

std::string DataValue::Text() const {
  const DataNode& node = (*store_)[index_];
  if (const auto* text = std::get_if<TextNode>(&node)) return std::string(text->text);
  if (const auto* bytes = std::get_if<BytesNode>(&node)) return std::string(bytes->bytes);
  if (const ArrayNode* array = ArrayOf(*store_, index_)) {
    return GatherArray(*store_, *array, where_).AsText();
  }
  throw Error(where_, fmt::format("is {}, where a text is needed", Describe()), "Check the field");
}

}  // namespace holdfast
