// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle_torch.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

// A storage with its places in the tables, roughly.
constexpr std::size_t kSourceBytes = 512;

// One past the last element that a view touches; nothing when that is beyond all counting.
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
    scanner.FailRefused(
        "names something that lies outside of the pickle and is not a torch storage",
        "Save it without persistent ids");
  }
  if (!context_.options.storage) {
    scanner.FailRefused("is the pickle of a torch file, without the numbers that belong to it",
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
                        "Save real and imaginary parts as tensors of their own");
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
  // Its bytes may be made anew each time the pickle names the same file.
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
