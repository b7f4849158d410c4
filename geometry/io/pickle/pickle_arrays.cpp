// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle_arrays.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/npy_header.h"

namespace holdfast {
namespace {

constexpr std::string_view kArrayClass = "numpy.ndarray";
constexpr std::string_view kJoblibClass = "joblib.numpy_pickle.NumpyArrayWrapper";
constexpr std::size_t kMaxItemSize = std::size_t{1} << 20;
// Approximate size of a node in the map of dtypes.
constexpr std::size_t kDtypeBytes = 96;

}  // namespace

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
  // Rows of the last dimension become lists, then rows of the one before, up to the first.
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
  // numpy's earliest pickles have no version number.
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

bool PickleNumpy::IsJoblibArray(NodeIndex index) const {
  const ObjectNode* object = context_.ObjectAt(index);
  return object != nullptr && !object->is_class && object->class_name == kJoblibClass;
}

NodeIndex PickleNumpy::JoblibArray(NodeIndex instance, PickleScanner& scanner) {
  const ObjectNode* object = context_.ObjectAt(instance);
  const auto field = [&](std::string_view name) -> std::optional<NodeIndex> {
    const DictNode* fields = object->fields ? context_.DictAt(*object->fields) : nullptr;
    if (fields == nullptr) return std::nullopt;
    for (const auto& [key, value] : fields->entries) {
      if (context_.TextAt(key) == name) return value;
    }
    return std::nullopt;
  };
  const auto shape = field("shape"), order = field("order"), dtype = field("dtype");
  const auto sizes = shape ? context_.SizesAt(*shape) : std::nullopt;
  const auto layout = order ? context_.TextAt(*order) : std::nullopt;
  if (!sizes || !layout || !dtype) scanner.FailDamaged("has an array of joblib of unknown state");
  const ElementType& element = ElementAt(*dtype);
  if (element.kind == 'O') {
    scanner.FailRefused("holds an array of Python objects in joblib's form",
                        "Save what is needed as arrays (numpy.savez)");
  }
  if (const auto aligned = field("numpy_array_alignment_bytes");
      aligned && !context_.IsNone(*aligned)) {
    scanner.Take(scanner.Byte());
  }
  const auto needed = CheckedProduct(*sizes, element.size);
  if (!needed) scanner.FailDamaged("has an array of impossible shape");
  const NodeIndex bytes = context_.store.AddBytesView(scanner.Take(*needed));
  DataNode made = MakeArray(*dtype, *sizes, *layout == "F", bytes);
  return context_.store.AddArray(std::move(*std::get<std::unique_ptr<ArrayNode>>(made)));
}

namespace {

// Approximate size of a storage with its table entries.
constexpr std::size_t kSourceBytes = 512;

// One past the last element that a view touches; nullopt on overflow.
std::optional<std::size_t> EndOfView(const ArrayNode& array, std::size_t offset) {
  std::size_t last = offset;
  for (std::size_t d = 0; d < array.shape.size(); ++d) {
    if (array.shape[d] == 0) return offset;
    const std::size_t factors[] = {array.shape[d] - 1, array.strides[d]};
    const auto step = CheckedProduct(factors, 1);
    if (!step || *step > SIZE_MAX - 1 - last) return std::nullopt;
    last += *step;
  }
  return last + 1;
}

bool IsContiguous(const ArrayNode& array) {
  std::size_t stride = 1;
  for (std::size_t d = array.shape.size(); d-- > 0;) {
    if (array.shape[d] != 1 && array.strides[d] != stride) return false;
    stride *= array.shape[d];
  }
  return true;
}

}  // namespace

ElementType ElementFromCode(std::string_view code) {
  ElementType element;
  element.kind = code.front();
  std::from_chars(code.data() + 1, code.data() + code.size(), element.size);
  return element;
}

NodeIndex PickleTorch::AddSource(Source source, std::string class_name) {
  context_.store.Charge(kSourceBytes + 2 * source.request.key.size());
  const NodeIndex node = context_.store.AddObject({std::move(class_name), false, {}, {}});
  source_of_.emplace(node, sources_.size());
  sources_.push_back(std::move(source));
  return node;
}

NodeIndex PickleTorch::Storage(NodeIndex persistent_id) {
  const PickleScanner& scanner = context_.scanner;
  const std::vector<NodeIndex>* parts = context_.ItemsAt(persistent_id);
  if (parts == nullptr || parts->size() < 5 || context_.TextAt((*parts)[0]) != "storage") {
    scanner.FailRefused("refers to data outside of the pickle that is not a torch storage",
                        "Save it without persistent ids");
  }
  if (!context_.options.storage) {
    scanner.FailRefused("is the pickle of a torch file without its tensor data",
                        "Give the whole file that torch.save wrote");
  }
  const AllowedGlobal* type = context_.GlobalAt((*parts)[1]);
  const auto key_text = context_.TextAt((*parts)[2]);
  const auto key_number = context_.IntegerAt((*parts)[2]);
  const auto count = context_.IntegerAt((*parts)[4]);
  if (type == nullptr || type->role != GlobalRole::kTorchStorage || (!key_text && !key_number) ||
      !count || *count < 0) {
    scanner.FailDamaged("has a torch storage of unknown form");
  }
  if (parts->size() > 5 && !context_.IsNone((*parts)[5])) {
    scanner.FailRefused("holds a view of a torch storage, as torch before 0.4 wrote it",
                        "Load it with torch and save it again");
  }
  Source source;
  source.request.key = key_text ? std::string(*key_text) : std::to_string(*key_number);
  source.request.element = ElementFromCode(type->element);
  source.request.count = static_cast<std::uint64_t>(*count);
  if (source.request.element.kind == 'c') {
    scanner.FailRefused("holds complex numbers, which are not read",
                        "Save real and imaginary parts as separate tensors");
  }
  const std::string identity =
      fmt::format("{} {} {}", type->element, source.request.count, source.request.key);
  const auto known = known_.find(identity);
  if (known != known_.end()) return known->second;
  const NodeIndex node = AddSource(std::move(source), fmt::format("torch.{}", type->name));
  known_.emplace(identity, node);
  return node;
}

NodeIndex PickleTorch::StorageFromBytes(const Arguments& arguments) {
  const auto* file =
      arguments.size() == 1 ? std::get_if<BytesNode>(&context_.store[arguments[0]]) : nullptr;
  if (file == nullptr) context_.scanner.FailDamaged("has a torch storage of unknown form");
  if (!context_.options.nested_torch_file) {
    context_.scanner.FailRefused("holds a torch file within",
                                 "Save the tensors with torch.save, or as numpy arrays");
  }
  Source source;
  source.is_nested = true;
  source.bytes = context_.options.nested_torch_file(
      std::as_bytes(std::span(file->bytes.data(), file->bytes.size())), source.request.element);
  source.request.count =
      source.bytes.view.size() / std::max<std::size_t>(1, source.request.element.size);
  // Its bytes may be allocated again each time the pickle names the same file.
  context_.store.Charge(source.bytes.view.size());
  return AddSource(std::move(source), "torch.Storage");
}

NodeIndex PickleTorch::AddView(const Arguments& arguments, const ElementType* element) {
  const auto source = arguments.size() < 4 ? source_of_.end() : source_of_.find(arguments[0]);
  if (source == source_of_.end()) {
    context_.scanner.FailDamaged("has a torch tensor without a storage");
  }
  const auto offset = context_.IntegerAt(arguments[1]);
  auto shape = context_.SizesAt(arguments[2]);
  auto strides = context_.SizesAt(arguments[3]);
  if (!offset || *offset < 0 || !shape || !strides || shape->size() != strides->size()) {
    context_.scanner.FailDamaged("has a torch tensor of impossible shape");
  }
  ArrayNode array;
  array.element = element ? *element : sources_[source->second].request.element;
  array.shape = *std::move(shape);
  array.strides = *std::move(strides);
  context_.store.Charge(2 * sizeof(View));
  const NodeIndex node = context_.store.AddArray(std::move(array));
  views_.push_back({node, source->second, static_cast<std::size_t>(*offset)});
  return node;
}

NodeIndex PickleTorch::Tensor(const Arguments& arguments) { return AddView(arguments, nullptr); }

NodeIndex PickleTorch::UntypedTensor(const Arguments& arguments) {
  const AllowedGlobal* type = arguments.size() < 7 ? nullptr : context_.GlobalAt(arguments[6]);
  if (type == nullptr || type->element.empty()) {
    context_.scanner.FailDamaged("has a torch tensor without a known dtype");
  }
  const ElementType element = ElementFromCode(type->element);
  return AddView(arguments, &element);
}

void PickleTorch::Lay(const View& view, const DataBytes& bytes) {
  ArrayNode& array = *std::get<std::unique_ptr<ArrayNode>>(context_.store[view.node]);
  const std::size_t size = array.element.size;
  const std::size_t there = size == 0 ? 0 : bytes.view.size() / size;
  const auto end = EndOfView(array, view.offset);
  if (!end || *end > there) {
    throw Error(
        context_.store.Where(),
        fmt::format("has a torch tensor of shape ({}), stride ({}) from element {} on, in a "
                    "storage of {} elements",
                    fmt::join(array.shape, ", "), fmt::join(array.strides, ", "), view.offset,
                    there),
        "The file is damaged: get it from its source again");
  }
  if (IsContiguous(array)) array.strides.clear();
  array.bytes = bytes.view.subspan(view.offset * size, (*end - view.offset) * size);
}

void PickleTorch::Bind() {
  for (Source& source : sources_) {
    if (source.is_nested) {
      context_.store.Keep(source.bytes.owner);
      continue;
    }
    const TorchStorageRequest& request = source.request;
    source.bytes = context_.options.storage(request);
    if (source.bytes.view.size() / request.element.size < request.count) {
      throw Error(
          context_.store.Where(),
          fmt::format("has {} bytes of torch storage '{}' where {} elements of {} bytes "
                      "are announced",
                      source.bytes.view.size(), request.key, request.count, request.element.size),
          "The file is damaged or cut off: get it from its source again");
    }
    source.bytes.view = source.bytes.view.first(request.count * request.element.size);
    context_.store.Keep(source.bytes.owner);
  }
  for (const View& view : views_) Lay(view, sources_[view.source].bytes);
}

}  // namespace holdfast
