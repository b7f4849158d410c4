// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle_numpy.h"

#include <algorithm>
#include <charconv>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace holdfast {
namespace {

constexpr std::string_view kArrayClass = "numpy.ndarray";
constexpr std::size_t kMaxItemSize = std::size_t{1} << 20;
// A node of the map of dtypes, roughly.
constexpr std::size_t kDtypeBytes = 96;

}  // namespace

std::optional<std::size_t> CheckedProduct(std::span<const std::size_t> factors, std::size_t first) {
  std::size_t product = first;
  bool overflows = false;
  for (const std::size_t factor : factors) {
    if (factor == 0) return 0;
    overflows |= product > std::numeric_limits<std::size_t>::max() / factor;
    product *= factor;
  }
  if (overflows) return std::nullopt;
  return product;
}

std::optional<std::vector<std::size_t>> PickleContext::SizesAt(NodeIndex index) const {
  const std::vector<NodeIndex>* items = ItemsAt(index);
  if (items == nullptr || items->size() > kMaxRank) return std::nullopt;
  std::vector<std::size_t> sizes;
  for (const NodeIndex item : *items) {
    const auto size = IntegerAt(item);
    if (!size || *size < 0) return std::nullopt;
    sizes.push_back(static_cast<std::size_t>(*size));
  }
  return sizes;
}

PickleNumpy::Layout PickleNumpy::ParseDtype(std::string_view text) const {
  Layout dtype{{'V', 0, false}, {}};
  const std::string whole(text);
  if (!text.empty() && std::string_view("<>|=").find(text.front()) != std::string_view::npos) {
    dtype.element.big_endian = text.front() == '>';
    text.remove_prefix(1);
  }
  if (text.empty()) context_.scanner.FailDamaged("has a dtype without a type");
  char& kind = dtype.element.kind;
  kind = text.front() == '?' ? 'b' : text.front();
  std::size_t size = text == "?" ? 1 : 0;
  const char* end = text.data() + text.size();
  if (text.size() > 1) {
    const auto [stop, error] = std::from_chars(text.data() + 1, end, size);
    if (error != std::errc() || stop != end) size = kMaxItemSize + 1;
  }
  dtype.element.size = kind == 'U' && size <= kMaxItemSize ? 4 * size : size;
  const bool is_number =
      (kind == 'f' && (size == 2 || size == 4 || size == 8)) ||
      ((kind == 'i' || kind == 'u') && (size == 1 || size == 2 || size == 4 || size == 8)) ||
      (kind == 'b' && size == 1);
  const bool is_text = (kind == 'U' || kind == 'S') && size <= kMaxItemSize;
  if (!is_number && !is_text && kind != 'O') {
    dtype.refused = kind == 'c'   ? "complex numbers"
                    : kind == 'V' ? "records (a structured dtype)"
                    : kind == 'f' ? "numbers longer than 64 bits"
                    : kind == 'M' || kind == 'm'
                        ? "dates"
                        : fmt::format("elements of dtype '{}'", whole.substr(0, 20));
  }
  return dtype;
}

NodeIndex PickleNumpy::Dtype(const Arguments& arguments) {
  if (arguments.empty()) context_.scanner.FailDamaged("has a dtype without a type");
  Layout dtype;
  if (const auto text = context_.TextAt(arguments[0])) {
    dtype = ParseDtype(*text);
  } else if (const AllowedGlobal* type = context_.GlobalAt(arguments[0]);
             type != nullptr && !type->element.empty()) {
    dtype = ParseDtype(type->element);
  } else {
    dtype.refused = "records (a structured dtype)";
  }
  const NodeIndex index = context_.store.AddObject({"numpy.dtype", false, {}, {}});
  context_.store.Charge(kDtypeBytes + dtype.refused.size());
  dtypes_.emplace(index, std::move(dtype));
  return index;
}

void PickleNumpy::SetDtypeState(NodeIndex index, NodeIndex state) {
  const std::vector<NodeIndex>* parts = context_.ItemsAt(state);
  const auto order =
      parts != nullptr && parts->size() >= 2 ? context_.TextAt((*parts)[1]) : std::nullopt;
  if (!order || order->size() != 1) context_.scanner.FailDamaged("has a dtype of unknown state");
  Layout& dtype = dtypes_.at(index);
  dtype.element.big_endian = *order == ">";
  for (std::size_t part = 2; part < std::min<std::size_t>(parts->size(), 5); ++part) {
    if (!context_.IsNone((*parts)[part])) dtype.refused = "records (a structured dtype)";
  }
}

const ElementType& PickleNumpy::ElementAt(NodeIndex index) const {
  const auto found = dtypes_.find(index);
  if (found == dtypes_.end()) context_.scanner.FailDamaged("has an array without a dtype");
  if (!found->second.refused.empty()) {
    context_.scanner.FailRefused(fmt::format("holds {}, which are not read", found->second.refused),
                                 "Save what is needed as arrays of real numbers");
  }
  return found->second.element;
}

NodeIndex PickleNumpy::EmptyArray() {
  return context_.store.AddObject({std::string(kArrayClass), false, {}, {}});
}

bool PickleNumpy::IsEmptyArray(NodeIndex index) const {
  const ObjectNode* object = context_.ObjectAt(index);
  return object != nullptr && !object->is_class && object->class_name == kArrayClass;
}

DataNode PickleNumpy::MakeArray(NodeIndex dtype, std::vector<std::size_t> shape, bool fortran_order,
                                NodeIndex bytes) const {
  auto array = std::make_unique<ArrayNode>();
  array->element = ElementAt(dtype);
  array->shape = std::move(shape);
  array->fortran_order = fortran_order;
  const auto* data = std::get_if<BytesNode>(&context_.store[bytes]);
  const auto needed = CheckedProduct(array->shape, array->element.size);
  if (data == nullptr || !needed || *needed != data->bytes.size()) {
    context_.scanner.FailDamaged(fmt::format(
        "has an array of shape ({}) and {} bytes each, with {}", fmt::join(array->shape, ", "),
        array->element.size, data ? fmt::format("{} bytes", data->bytes.size()) : "no bytes"));
  }
  array->bytes = std::as_bytes(std::span(data->bytes.data(), data->bytes.size()));
  context_.store.Charge(sizeof(ArrayNode) + 16 + 16 * array->shape.size());
  return array;
}

DataNode PickleNumpy::NestObjects(const std::vector<NodeIndex>& items,
                                  const std::vector<std::size_t>& shape) {
  const auto count = CheckedProduct(shape, 1);
  if (!count || *count != items.size()) {
    context_.scanner.FailDamaged(fmt::format("has an array of shape ({}) with {} objects",
                                             fmt::join(shape, ", "), items.size()));
  }
  context_.store.Charge(2 * sizeof(NodeIndex) * items.size());
  std::vector<NodeIndex> level = items;
  // The last dimension's rows become lists, then theirs, up to the first.
  for (std::size_t d = shape.size(); d-- > 1 && shape[d] > 0;) {
    std::vector<NodeIndex> rows;
    for (std::size_t i = 0; i < level.size(); i += shape[d]) {
      const auto begin = level.begin() + static_cast<std::ptrdiff_t>(i);
      rows.push_back(
          context_.store.AddList({begin, begin + static_cast<std::ptrdiff_t>(shape[d])}));
    }
    level = std::move(rows);
  }
  return ListNode{std::move(level)};
}

void PickleNumpy::SetArrayState(NodeIndex array, NodeIndex state) {
  const std::vector<NodeIndex>* parts = context_.ItemsAt(state);
  // The version number was not there in numpy's earliest pickles.
  if (parts == nullptr || parts->size() < 4 || parts->size() > 5) {
    context_.scanner.FailDamaged("has an array of unknown state");
  }
  const std::size_t at = parts->size() - 4;
  const auto shape = context_.SizesAt((*parts)[at]);
  if (!shape) context_.scanner.FailDamaged("has an array of impossible shape");
  const NodeIndex dtype = (*parts)[at + 1];
  const bool fortran_order = context_.IsTrue((*parts)[at + 2]);
  const NodeIndex data = (*parts)[at + 3];
  if (ElementAt(dtype).kind == 'O') {
    const std::vector<NodeIndex>* items = context_.ItemsAt(data);
    if (items == nullptr) context_.scanner.FailDamaged("has an array of objects without a list");
    DataNode nested = NestObjects(*items, *shape);
    context_.store[array] = std::move(nested);
    if (shape->empty()) {
      context_.store.Charge(kDtypeBytes);
      object_scalars_.insert(array);
    }
  } else {
    DataNode made = MakeArray(dtype, *shape, fortran_order, data);
    context_.store[array] = std::move(made);
  }
}

NodeIndex PickleNumpy::Scalar(const Arguments& arguments) {
  if (arguments.size() != 2) context_.scanner.FailDamaged("has a numpy scalar without a value");
  if (ElementAt(arguments[0]).kind == 'O') return arguments[1];
  DataNode made = MakeArray(arguments[0], {}, false, arguments[1]);
  return context_.store.AddArray(std::move(*std::get<std::unique_ptr<ArrayNode>>(made)));
}

NodeIndex PickleNumpy::FromBuffer(const Arguments& arguments) {
  const auto shape = arguments.size() < 4 ? std::nullopt : context_.SizesAt(arguments[2]);
  const auto order = arguments.size() < 4 ? std::nullopt : context_.TextAt(arguments[3]);
  if (!shape || !order || (*order != "C" && *order != "F")) {
    context_.scanner.FailDamaged("has an array of unknown state");
  }
  DataNode made = MakeArray(arguments[1], *shape, *order == "F", arguments[0]);
  return context_.store.AddArray(std::move(*std::get<std::unique_ptr<ArrayNode>>(made)));
}

}  // namespace holdfast
